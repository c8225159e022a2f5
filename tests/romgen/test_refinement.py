"""Refinement on trajectories: gradient, recovery of a known normal form, rest positions, masked samples, priors."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
import pytest

import romgen.refinement as refinement
from romgen.arrays import BoolArray, ComplexArray, FloatArray, IntArray
from romgen.dissipation import demand
from romgen.normal_form import resonance_table
from romgen.output_map import displacement, output_map, slopes
from romgen.polynomial import monomials, zeta
from romgen.refined_chart import chart_terms, velocity_rows
from romgen.refined_dynamics import RefinedDynamics, Segment, simulated
from romgen.refinement import _evaluated, _prior, growth, linearise, moved, refine, regrown
from romgen.trained_range import box_range

LAMBDA = np.array([-2.0 + 60.0j, -3.0 + 121.0j])
STARTS = (np.array([0.45, 0.05 + 0.02j]), np.array([0.1j, 0.4]))
RESTS = np.array([[0.03, -0.01], [-0.02, 0.05]])
MAX_STEP = 2 * np.pi / (20 * 121.0)


def known() -> RefinedDynamics:
    """1:2 normal form with a quadratic exchange, cubic shifts and a cubic output."""
    table = resonance_table(LAMBDA, 3, (1, 2))
    output = output_map(np.array([0.9 + 0.2j, 1.1 - 0.1j]), table)
    rng = np.random.default_rng(5)
    B, C = (
        size * (rng.normal(size=terms.shape) + 1j * rng.normal(size=terms.shape)) * terms
        for size, terms in ((4.0, table.resonant), (0.1, output.terms))
    )
    own = (output.exponents[:, :2] == output.exponents[:, 2:]).all(axis=1)
    C[:, own] = C[:, own].real
    amplitude = np.array([0.5, 0.5])
    return RefinedDynamics(
        LAMBDA,
        LAMBDA,
        np.zeros(2, dtype=complex),
        amplitude,
        table.exponents,
        table.resonant,
        B,
        output,
        C,
        np.zeros((2, 2)),
    )


def data(model: RefinedDynamics, kept: BoolArray | None = None, shots: int = 1) -> tuple[Segment, ...]:
    t = np.linspace(0.0, 0.8, 400)
    keep = np.ones(400, dtype=bool) if kept is None else kept
    segments: list[Segment] = []
    for k, start in enumerate(STARTS):
        whole = Segment(t, np.zeros((400, 2)), start.astype(complex), keep, k, 1.0)
        z = simulated(model, [whole], MAX_STEP)[0]
        eta = displacement(model.output, model.C, z) + RESTS[k]
        share = 1.0 / float(np.linalg.norm(eta, axis=1).max())
        blocks = np.split(np.arange(400), shots)
        segments += [Segment(t[rows], eta[rows], z[rows[0]], keep[rows], k, share) for rows in blocks]
    return tuple(segments)


def disturbed(model: RefinedDynamics, segments: Sequence[Segment]) -> tuple[RefinedDynamics, tuple[Segment, ...]]:
    starts = tuple(replace(s, z0=s.z0 * 1.02 + 0.005j) for s in segments)
    return replace(model, B=model.B * 0.9, C=np.zeros_like(model.C)), starts


@pytest.mark.parametrize("shots", [1, 4])
def test_gradient_matches_finite_differences(shots: int) -> None:
    truth = known()
    model, segments = disturbed(truth, data(truth, shots=shots))
    here = linearise(model, segments, MAX_STEP)
    assert here.model.cost == pytest.approx(_evaluated(model, segments, MAX_STEP).cost, rel=1e-9)
    scale = np.sqrt(np.diag(here.hessian))
    for k in range(len(here.gradient)):
        step = np.zeros_like(here.gradient)
        step[k] = 1e-4 / scale[k]
        ahead, behind = (_evaluated(*moved(here.model, segments, sign * step), MAX_STEP).cost for sign in (1.0, -1.0))
        # the output map and the rests are eliminated, which leaves the gradient exact; central difference
        slope = (ahead - behind) / (2.0 * step[k])
        assert 2.0 * here.gradient[k] == pytest.approx(slope, rel=1e-4, abs=1e-4 * scale[k] * here.model.cost**0.5)


def test_gradient_with_missing_dissipation_matches_finite_differences() -> None:
    """The states reach 0.5, where the coefficients of the test are ten times the linear damping."""
    truth = known()
    model, segments = disturbed(truth, data(truth))
    model = replace(model, demand=demand(box_range(truth.amplitude), LAMBDA), B=4.0 * truth.B)
    missing, half_gradient, _ = growth(model)
    assert missing > 0.0
    here = linearise(model, segments, MAX_STEP)
    assert here.model.cost == pytest.approx(_evaluated(model, segments, MAX_STEP).cost, rel=1e-9)
    shared = len(half_gradient)
    for k in range(shared):
        step = np.zeros_like(here.gradient)
        step[k] = 1e-4
        ahead, behind = (growth(moved(model, segments, sign * step)[0])[0] for sign in (1.0, -1.0))
        # the weights of the energy follow to 1e-3 of their logarithm, which their optimum forgives to second order
        tolerance = 1e-3 * float(np.abs(half_gradient).max())
        assert 2.0 * half_gradient[k] == pytest.approx((ahead - behind) / 2e-4, rel=1e-3, abs=tolerance)


def test_known_normal_form_and_rest_positions_are_recovered(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(refinement, "PRIOR_ERROR", 1e-6)
    truth = known()
    segments = data(truth)
    model, starts = refine(*disturbed(truth, segments), MAX_STEP, 30, 1e-5)
    # exact data and priors of 1e-12: the cost falls to the square of the solver's relative decrease and below
    assert model.cost < 1e-8
    # coefficients act with amplitudes of 1/2 or less, so a misfit of 1e-4 leaves a percent at the weakest
    strong = np.abs(truth.B) > 1.0
    assert model.B[strong] == pytest.approx(truth.B[strong], rel=0.02)
    assert model.eigenvalues == pytest.approx(LAMBDA, rel=1e-4)
    assert model.rest == pytest.approx(RESTS, abs=1e-3)
    for start, segment in zip(starts, segments, strict=True):
        assert start.z0 == pytest.approx(segment.z0, abs=1e-3)


def test_segments_find_a_frequency_that_is_wrong_by_periods(monkeypatch: pytest.MonkeyPatch) -> None:
    """10 % at 19 Hz over 0.8 s is 1.5 periods: from there one segment per motion keeps a wrong number of periods."""
    monkeypatch.setattr(refinement, "PRIOR_ERROR", 1e-6)
    truth = known()
    wrong = replace(truth, eigenvalues=LAMBDA * 1.1, reference=LAMBDA * 1.1, C=np.zeros_like(truth.C))
    found, lost = (refine(wrong, data(truth, shots=n), MAX_STEP, 30, 1e-5)[0] for n in (20, 1))
    # exact data, and a prior that adds 4e-8 to the cost at the true value
    assert found.eigenvalues == pytest.approx(LAMBDA, rel=1e-3)
    assert np.abs(lost.eigenvalues.imag / LAMBDA.imag - 1.0).max() > 0.01


def test_masked_samples_change_nothing() -> None:
    truth = known()
    keep = np.arange(400) % 100 < 60
    model, hidden = disturbed(truth, data(truth, keep))
    spoiled = tuple(replace(s, eta=np.where(keep[:, None], s.eta, 0.3)) for s in hidden)
    first, second = (refine(model, s, MAX_STEP, 3, 1e-5)[0] for s in (hidden, spoiled))
    assert np.allclose(first.B, second.B, rtol=1e-12)
    assert first.cost == pytest.approx(second.cost, rel=1e-12)


def test_terms_that_no_motion_excites_stay_small() -> None:
    """One mode at a time leaves the products of both modes free; the prior is that of the corner, not of the data."""
    truth = known()
    alone = tuple(
        replace(s, z0=z0) for s, z0 in zip(data(truth), (np.array([0.4, 0j]), np.array([0j, 0.4])), strict=True)
    )
    grown = regrown(truth, resonance_table(LAMBDA, 5, (1, 2)))
    model, _ = refine(grown, alone, MAX_STEP, 10, 1e-5)
    E = model.exponents
    mixed = (E[:, [0, 2]].sum(axis=1) > 0) & (E[:, [1, 3]].sum(axis=1) > 0) & (E.sum(axis=1) == 5)
    rate = np.abs(model.B[:, mixed]) * 0.5**4 / LAMBDA.imag[:, None]
    # three standard deviations at the corner
    assert rate.max() < 3.0 * refinement.PRIOR_RATE


def test_growing_keeps_the_motion() -> None:
    truth = known()
    larger = regrown(truth, resonance_table(LAMBDA, 5, (1, 2)))
    segments = data(truth)
    for before, after in zip(simulated(truth, segments, MAX_STEP), simulated(larger, segments, MAX_STEP), strict=True):
        assert np.array_equal(before, after)


def test_every_resonant_term_is_missing_from_its_row() -> None:
    table = resonance_table(LAMBDA, 3, (1, 2))
    output = output_map(np.ones(2, dtype=complex), table)
    E, rows = output.exponents.tolist(), output.terms
    # eta_1: conj(z_1) z_2 is resonant with row 1, so is its conjugate z_1 conj(z_2); z_2 and z_1^2 are free
    assert not rows[0, E.index([1, 0, 0, 1])]
    assert not rows[0, E.index([1, 0, 0, 0])]
    assert rows[0, E.index([0, 1, 0, 0])]
    assert rows[0, E.index([2, 0, 0, 0])]
    assert not rows[1, E.index([2, 0, 0, 0])]
    assert [0, 0, 1, 0] not in E


def test_velocity_is_the_rate_of_the_displacement() -> None:
    truth = known()
    z = np.vstack(simulated(truth, data(truth), MAX_STEP))
    E, eta = chart_terms(truth.output, truth.C)
    rows = velocity_rows(truth, (E, eta), z, 1e-12)
    fitted = _values(E, rows, z)
    rate = truth.eigenvalues * z + zeta_terms(truth, z)
    exact = np.einsum("tji,ti->tj", slopes(truth.output, truth.C, z), rate).real
    # what degree 3 leaves of a rate of degree 5: C times B at amplitudes below 1/2
    assert np.abs(fitted - exact).max() < 0.01 * np.abs(exact).max()


def zeta_terms(model: RefinedDynamics, z: ComplexArray) -> ComplexArray:
    rate: ComplexArray = monomials(zeta(z), model.exponents) @ model.B.T
    return rate


def _values(E: IntArray, rows: ComplexArray, z: ComplexArray) -> FloatArray:
    values: FloatArray = (monomials(zeta(z), E) @ rows.T).real
    return values


def test_prior_is_one_at_its_standard_deviation() -> None:
    truth = known()
    moved = replace(truth, eigenvalues=LAMBDA + 1j * refinement.PRIOR_IMAG * LAMBDA.imag, B=np.zeros_like(truth.B))
    weight, value = _prior(moved)
    assert float(weight @ value**2) == pytest.approx(2 * refinement.PRIOR_ERROR**2, rel=1e-12)
