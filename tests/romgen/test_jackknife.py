"""Replicates against refits, their deviation against a closed form, and confidence limits that cover the truth."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
import pytest
from scipy.signal import lfilter
from scipy.stats import binom

from romgen.arrays import FloatArray
from romgen.backbone import Backbone, backbone
from romgen.chart import ReducedTrajectory
from romgen.confidence_band import ConfidenceBand, confidence_band
from romgen.jackknife import blocks_of, effective_blocks, jackknife_deviation
from romgen.normal_form import NormalFormFit, fit_normal_form, with_replicates
from romgen.order_selection import autonomous_model
from romgen.reduced_dynamics import LinearPart
from romgen.simulate import simulate
from romgen.trajectory_fit import fit_on_trajectories
from tests.normal_form_models import damped_oscillator

DAMPING, CUBIC = 0.01, 0.2
RIDGE = 1e-12
RHO = np.array([0.1, 0.3])
# Pole radius of the noise: a band of width 0.1 around the frequency of the oscillator, correlated over 20 periods.
RADIUS = 0.97


def decays() -> list[ReducedTrajectory]:
    """x'' + c x' + x + k x^3 = 0 from three amplitudes, without noise."""
    model = damped_oscillator(DAMPING, cubic=CUBIC)
    t = np.arange(0.0, 400.0, 0.3)
    runs = []
    for number, start in enumerate((0.6, 0.45, 0.3)):
        z = simulate(model, t, np.array([0.5 * start + 0j]), max_step=0.02)[:, 0]
        x, v = 2.0 * z.real, 2.0 * (model.eigenvalues[0] * z).real
        a = -DAMPING * v - x - CUBIC * x**3
        y = np.column_stack([x, v])
        runs.append(ReducedTrajectory(str(number), t, y, np.column_stack([v, a]), y[:, :1], y[:, 1:]))
    return runs


def narrow_band(rng: np.random.Generator, n: int, step: float, size: float) -> FloatArray:
    """Noise of unit frequency that stays correlated over many periods, of mean square size^2."""
    pole = [1.0, -2.0 * RADIUS * np.cos(step), RADIUS**2]
    noise = lfilter([1.0], pole, rng.standard_normal(n + 500))[500:]
    response = lfilter([1.0], pole, np.eye(1, 2000)[0])
    return np.asarray(size * noise / np.sqrt(np.sum(response**2)))


def with_noise(clean: Sequence[ReducedTrajectory], rng: np.random.Generator, size: float) -> list[ReducedTrajectory]:
    """Noise on the acceleration."""
    noisy = []
    for r in clean:
        rate = r.y_dot.copy()
        rate[:, 1] += narrow_band(rng, len(r.t), r.t[1] - r.t[0], size)
        noisy.append(replace(r, y_dot=rate))
    return noisy


def direct(training: Sequence[ReducedTrajectory]) -> NormalFormFit:
    return with_replicates(fit_normal_form(training, 3, (), RIDGE), training, RIDGE)


def curve(fit: NormalFormFit) -> Backbone:
    """The backbone at the amplitudes 2 RHO of x; the unit of z follows the largest sample of the data."""
    unit = 2.0 * float(np.abs(fit.dynamics.vectors[0, 0])) * fit.dynamics.scale[0]
    return backbone(autonomous_model(fit), rho=2.0 * RHO / unit)


def limits(fit: NormalFormFit) -> ConfidenceBand:
    assert fit.replicates is not None
    return confidence_band(autonomous_model(fit), curve(fit), fit.replicates)


def covered(band: ConfidenceBand, truth: Backbone) -> FloatArray:
    """Whether frequency and damping of the truth lie within the limits, (2, n)."""
    pairs = (band.frequency_hz, truth.frequency_hz), (band.damping_ratio, truth.damping_ratio)
    return np.array([(bounds[:, 0] <= value) & (value <= bounds[:, 1]) for bounds, value in pairs], dtype=float)


def test_deviation_of_a_mean_is_the_textbook_one() -> None:
    """Replicates of a mean: the jackknife gives s / sqrt(n) exactly (Tukey)."""
    x = np.random.default_rng(1).standard_normal(15)
    means = (x.sum() - x) / 14
    assert jackknife_deviation(means) == pytest.approx(x.std(ddof=1) / np.sqrt(15), rel=1e-12)


def test_effective_blocks_count_those_that_matter() -> None:
    d = np.array([1.0, -1.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0])
    assert effective_blocks(d) == pytest.approx(3 * 2**2 / 2 - 2)
    assert effective_blocks(np.tile([1.0, -1.0], 50)) == 99.0


def test_replicates_of_a_direct_fit_are_refits() -> None:
    """One step against a new fit of all but one block, in units of the jackknife deviation.

    The new fit has other vectors and another scale; both steps are first order, so they differ by the square of the
    change, relative to the deviation far below 0.2.
    """
    training = with_noise(decays(), np.random.default_rng(2), 2e-3)
    fit = direct(training)
    assert fit.replicates is not None
    kept, of = fit.resonance.resonant, blocks_of(training)
    first = len(training[0].t)
    for block in (0, 9, 20):
        masks = np.split(of != block, [first, 2 * first])
        refit = fit_normal_form([r.masked(keep) for r, keep in zip(training, masks, strict=True)], 3, (), RIDGE)
        # |z|^2 z is in units of the scale of z, set by the largest amplitude of the data: back to that of the full fit
        unit = np.abs(refit.dynamics.vectors[0] * refit.dynamics.scale[0]) / np.abs(
            fit.dynamics.vectors[0] * fit.dynamics.scale[0]
        )
        again = refit.normal_form.coefficients[kept] / unit**2
        for ours, new, all_of_them in (
            (fit.replicates.eigenvalues[block], refit.dynamics.eigenvalues, fit.replicates.eigenvalues),
            (fit.replicates.normal_form[block][kept], again, fit.replicates.normal_form[:, kept]),
        ):
            assert abs(ours - new) < 0.2 * jackknife_deviation(all_of_them)


def test_a_given_linear_part_has_no_spread() -> None:
    known = LinearPart(np.array([1.0]), np.array([0.5 * DAMPING]))
    training = with_noise(decays(), np.random.default_rng(4), 2e-3)
    kept = with_replicates(fit_normal_form(training, 3, (), RIDGE, known), training, RIDGE, keep_linear=True)
    for fit in (kept, fit_on_trajectories(training, 3, (), RIDGE, known)):
        assert fit.replicates is not None
        np.testing.assert_array_equal(fit.replicates.eigenvalues, np.tile(fit.dynamics.eigenvalues, (24, 1)))
        spread = jackknife_deviation(fit.replicates.normal_form)
        assert np.all(spread[fit.resonance.resonant] > 0.0)
        assert not spread[~fit.resonance.resonant].any()


def test_limits_of_a_direct_fit_cover_the_truth_as_often_as_they_say() -> None:
    """120 noisy repetitions; the count of covered truths lies within the 99.9 % range of the binomial law.

    Truth is the fit without noise. The deviation for independent samples covers far less: the noise is correlated.
    """
    clean, n = decays(), 120
    exact = fit_normal_form(clean, 3, (), RIDGE)
    counts, naive = np.zeros((2, RHO.size)), 0
    rng = np.random.default_rng(3)
    for _ in range(n):
        fit = direct(with_noise(clean, rng, 2e-3))
        counts += covered(limits(fit), curve(exact))
        assert fit.conjugacy is not None
        kept = fit.resonance.resonant
        # 95 % of a circular complex normal lie within sqrt(-ln 0.05) deviations
        reach = np.sqrt(-np.log(0.05)) * fit.conjugacy.B_deviation[kept]
        error = np.abs(fit.normal_form.coefficients - exact.normal_form.coefficients)[kept]
        naive += int(np.all(error <= reach))
    assert np.all(counts >= binom.ppf(0.0005, n, 0.95))
    assert naive < binom.ppf(0.0005, n, 0.95)


def noisy_displacement(clean: Sequence[ReducedTrajectory], rng: np.random.Generator) -> list[ReducedTrajectory]:
    """White noise on the displacement, as a fit on trajectories sees it; rates are kept."""
    noisy = []
    for r in clean:
        y = r.y.copy()
        y[:, 0] += 5e-3 * rng.standard_normal(len(y))
        noisy.append(replace(r, y=y))
    return noisy


def test_limits_of_a_fit_on_trajectories() -> None:
    """One repetition: the truth, the fit without noise, lies within twice the limits (99.99 % for a normal law)."""
    clean = decays()
    truth = curve(fit_on_trajectories(clean, 3, (), RIDGE))
    fit = fit_on_trajectories(noisy_displacement(clean, np.random.default_rng(5)), 3, (), RIDGE)
    assert fit.replicates is not None
    assert fit.replicates.normal_form.shape == (24, *fit.normal_form.coefficients.shape)
    band = limits(fit)
    for bounds, value in ((band.frequency_hz, truth.frequency_hz), (band.damping_ratio, truth.damping_ratio)):
        assert np.all(np.abs(bounds.mean(axis=1) - value) < bounds[:, 1] - bounds[:, 0])


@pytest.mark.slow
def test_limits_of_fits_on_trajectories_cover_the_truth() -> None:
    """As for the direct fit, 60 repetitions."""
    clean, n = decays(), 60
    truth = curve(fit_on_trajectories(clean, 3, (), RIDGE))
    rng = np.random.default_rng(6)
    counts = np.zeros((2, RHO.size))
    for _ in range(n):
        counts += covered(limits(fit_on_trajectories(noisy_displacement(clean, rng), 3, (), RIDGE)), truth)
    assert np.all(counts >= binom.ppf(0.0005, n, 0.95)), counts / n
