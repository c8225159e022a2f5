"""Refinement on trajectories: gradient against finite differences, recovery of a known normal form, masked samples."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from romgen.arrays import ComplexArray, FloatArray
from romgen.etdrk4 import march
from romgen.polynomial import exponents, monomials, zeta
from romgen.refinement import RefinedDynamics, Segment, _cost, _linearise, _moved, _prior_weight, grown, refine
from romgen.resonance import integer_resonance

LAMBDA = np.array([-2.0 + 60.0j, -3.0 + 121.0j])
STARTS = (np.array([0.45, 0.05 + 0.02j]), np.array([0.1j, 0.4]))
MAX_STEP = 2 * np.pi / (20 * 121.0)


def known() -> RefinedDynamics:
    """1:2 normal form with a quadratic exchange, cubic shifts and a quadratic output."""
    E = exponents(4, 2, 3)
    resonant = integer_resonance(LAMBDA, E, (1, 2)).resonant
    rng = np.random.default_rng(5)
    B, C = (scale * (rng.normal(size=(2, len(E))) + 1j * rng.normal(size=(2, len(E)))) for scale in (4.0, 0.1))
    return RefinedDynamics(LAMBDA, LAMBDA, E, resonant, ~resonant, np.where(resonant, B, 0), np.where(resonant, 0, C))


def free(model: RefinedDynamics, t: FloatArray, z0: ComplexArray) -> ComplexArray:
    still = np.zeros((len(t) - 1, 2), dtype=complex)
    return march(t, z0.astype(complex), model.eigenvalues, model.exponents, model.B, still, still, MAX_STEP)


def data(model: RefinedDynamics) -> tuple[Segment, ...]:
    t = np.linspace(0.0, 0.8, 400)
    segments = []
    for z0 in STARTS:
        z = free(model, t, z0)
        q = z + monomials(zeta(z), model.exponents) @ model.C.T
        segments.append(Segment(t, q, z0.astype(complex), np.ones(len(t), dtype=bool)))
    return tuple(segments)


def disturbed(model: RefinedDynamics, segments: tuple[Segment, ...]) -> tuple[RefinedDynamics, tuple[Segment, ...]]:
    starts = tuple(replace(s, z0=s.z0 * 1.02 + 0.005j) for s in segments)
    return replace(model, B=model.B * 0.9, C=np.zeros_like(model.C)), starts


def test_gradient_matches_finite_differences() -> None:
    truth = known()
    model, segments = disturbed(truth, data(truth))
    weight = _prior_weight(model, len(segments))
    here = _linearise(model, segments, (0.0, MAX_STEP), weight)
    assert here.model.cost == pytest.approx(_cost(model, segments, (0.0, MAX_STEP), here.weight), rel=1e-9)
    scale = np.sqrt(np.diag(here.hessian))
    for k in range(len(here.gradient)):
        step = np.zeros_like(here.gradient)
        step[k] = 1e-4 / scale[k]
        ahead, behind = (
            _cost(*_moved(here.model, segments, sign * step), (0.0, MAX_STEP), here.weight) for sign in (1.0, -1.0)
        )
        # the output map is eliminated, which leaves the gradient exact; central difference of second order
        slope = (ahead - behind) / (2.0 * step[k])
        assert 2.0 * here.gradient[k] == pytest.approx(slope, rel=1e-4, abs=1e-4 * scale[k] * here.model.cost**0.5)


def test_known_normal_form_is_recovered() -> None:
    truth = known()
    segments = data(truth)
    model, starts = refine(*disturbed(truth, segments), 0.0, MAX_STEP, 30)
    # exact data and no ridge: the cost falls to the square of the solver's relative decrease and below
    assert model.cost < 1e-8
    # coefficients act with amplitudes of 1/2 or less, so a misfit of 1e-4 leaves a percent at the weakest
    strong = np.abs(truth.B) > 1.0
    assert model.B[strong] == pytest.approx(truth.B[strong], rel=0.02)
    assert model.eigenvalues == pytest.approx(LAMBDA, rel=1e-4)
    for start, segment in zip(starts, segments, strict=True):
        assert start.z0 == pytest.approx(segment.z0, abs=1e-3)


def test_masked_samples_change_nothing() -> None:
    truth = known()
    model, segments = disturbed(truth, data(truth))
    keep = np.arange(400) % 100 < 60
    hidden = tuple(replace(s, kept=keep) for s in segments)
    spoiled = tuple(replace(s, q=np.where(keep[:, None], s.q, 0.3)) for s in hidden)
    first, second = (refine(model, s, 1e-6, MAX_STEP, 3)[0] for s in (hidden, spoiled))
    assert np.allclose(first.B, second.B, rtol=1e-12)
    assert first.cost == pytest.approx(second.cost, rel=1e-12)


def test_growing_keeps_the_motion() -> None:
    truth = known()
    E = exponents(4, 2, 5)
    larger = grown(truth, E, integer_resonance(LAMBDA, E, (1, 2)).resonant)
    t = np.linspace(0.0, 0.2, 50)
    assert np.array_equal(free(larger, t, STARTS[0]), free(truth, t, STARTS[0]))
    assert larger.output.sum() == (~larger.resonant).sum()
