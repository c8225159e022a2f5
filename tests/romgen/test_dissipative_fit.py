"""A fit becomes dissipative where its data are silent, and stays as it is where they contradict."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

import romgen.dissipation as dissipation
import romgen.dissipative_fit as dissipative_fit
import romgen.refinement as refinement
from romgen.arrays import FloatArray
from romgen.dissipation import demand
from romgen.dissipative_fit import dissipative, projected
from romgen.normal_form import resonance_table
from romgen.output_map import displacement
from romgen.polynomial import PolynomialMap
from romgen.refined_dynamics import RefinedDynamics, Segment, simulated
from romgen.refinement import growth, linearise, moved, refine, regrown
from romgen.stability import tried_stability
from romgen.trained_range import TrainedRange, trained_range
from tests.romgen.test_refinement import LAMBDA, MAX_STEP, data, known

TRAINED = trained_range(np.array([[0.5, 0.0], [0.0, 0.5]], dtype=complex))


def grown(start: float) -> tuple[RefinedDynamics, tuple[Segment, ...]]:
    """z_1' = .. + 500 abs(z_1)^4 z_1 and its motions from ``start`` times those of the other tests."""
    quiet = regrown(replace(known(), B=0.2 * known().B), resonance_table(LAMBDA, 5, (1, 2)))
    fifth = (quiet.exponents == [3, 0, 2, 0]).all(axis=1)
    model = replace(quiet, B=quiet.B + 500.0 * fifth * np.array([[1.0], [0.0]]))
    small = tuple(replace(s, z0=s.z0 * start) for s in data(quiet))
    runs = zip(small, simulated(model, small, MAX_STEP), strict=True)
    return model, tuple(replace(s, eta=displacement(model.output, model.C, z)) for s, z in runs)


def is_stable(model: RefinedDynamics, trained: TrainedRange) -> bool:
    return tried_stability(model.eigenvalues, PolynomialMap(model.exponents, model.B), trained, (1.0,)).is_stable


def test_motions_decay_where_the_data_are_silent(monkeypatch: pytest.MonkeyPatch) -> None:
    """The term adds 0.3 1/s where the data were, up to 0.15, and 31 1/s, against 2, at the 0.5 where it must not."""
    monkeypatch.setattr(refinement, "PRIOR_ERROR", 1e-6)
    fit, segments = refine(*grown(1.0 / 3.0), MAX_STEP, 5, 1e-5)
    demanding = replace(fit, demand=demand(TRAINED, LAMBDA))
    near = projected(demanding, segments, MAX_STEP)
    # the penalty of a rate that is 0.1 % of the linear one too high, at all states
    assert growth(near[0])[0] < dissipation.PENALTY * 1e-6 < 1e-3 * growth(demanding)[0]
    made, _ = refine(*near, MAX_STEP, 10, 1e-5)
    assert not is_stable(fit, TRAINED)
    assert is_stable(made, TRAINED)
    # 0.3 1/s for the first tenth of a decay at 2 1/s moves it by 3 % at most; a mean square of 1e-5 is a tenth of that
    assert made.cost < 1e-5


def test_projection_is_the_minimum_of_the_quadratic_model() -> None:
    model, segments = grown(1.0 / 3.0)
    here = linearise(model, segments, MAX_STEP)
    demanding = replace(here.model, demand=demand(TRAINED, LAMBDA))
    near, starts = projected(demanding, segments, MAX_STEP)
    change = difference(demanding, near, segments, starts)

    def total(c: FloatArray) -> float:
        quadratic = float(c @ (here.hessian @ c + 2.0 * here.gradient))
        return quadratic + growth(moved(demanding, segments, c)[0])[0]

    least = total(change)
    assert least < 1e-3 * total(np.zeros_like(change))
    # directions of equal cost, a twentieth of the change long
    size = 0.05 * np.sqrt(change @ here.hessian @ change)
    root = np.linalg.cholesky(here.hessian + 1e-12 * np.diag(np.diag(here.hessian)))
    for direction in np.random.default_rng(2).normal(size=(20, len(change))):
        step = size * np.linalg.solve(root.T, direction / np.linalg.norm(direction))
        # the search for the weights of the energy leaves a thousandth
        assert total(change + step) > 0.999 * least


def difference(
    before: RefinedDynamics, after: RefinedDynamics, old: tuple[Segment, ...], new: tuple[Segment, ...]
) -> FloatArray:
    shared = np.concatenate([after.eigenvalues - before.eigenvalues, (after.B - before.B)[before.resonant]])
    starts = [b.z0 - a.z0 for a, b in zip(old, new, strict=True)]
    pairs = np.column_stack([shared.real, shared.imag]).ravel()
    joined: FloatArray = np.concatenate([pairs, *(np.concatenate([z.real, z.imag]) for z in starts)])
    return joined


def test_dissipation_that_the_data_contradict_is_not_forced(monkeypatch: pytest.MonkeyPatch) -> None:
    """Motions from 0.15 leave the term open, those from 0.225 show 1.3 1/s of it."""
    monkeypatch.setattr(refinement, "PRIOR_ERROR", 1e-6)
    monkeypatch.setattr(dissipative_fit, "STEPS", 4)
    open_model, segments = grown(1.0 / 3.0)
    fit = linearise(open_model, segments, MAX_STEP).model
    made, _ = dissipative(fit, segments, MAX_STEP)
    assert made.demand is not None
    assert fit.cost < made.cost <= (1.0 + dissipative_fit.CONFLICT) * fit.cost + dissipative_fit.PRIOR_ERROR**2
    shown, motions = grown(0.5)
    fit = linearise(shown, motions, MAX_STEP).model
    assert dissipative(fit, motions, MAX_STEP)[0] is fit
