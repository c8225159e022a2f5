"""Starts of the refinement: fast exchange needs the direct fit, small motions give Lambda."""

from __future__ import annotations

import numpy as np
import pytest

from romgen import refinement, trajectory_fit
from romgen.arrays import ComplexArray, FloatArray
from romgen.chart import ReducedTrajectory
from romgen.differences import first_derivative
from romgen.errors import NumericalError
from romgen.etdrk4 import march
from romgen.learning_notes import learning_notes
from romgen.linear_reference import LinearReference, linear_reference
from romgen.normal_form import FitOrigin, fit_normal_form, resonance_table
from romgen.order_selection import motion_error
from romgen.shooting_start import band_passed, charted, rates, segments
from romgen.trajectory_fit import fit_on_trajectories, is_long_enough
from tests.romgen.fmu.models import random_model

LAMBDA = np.array([-0.5 + 60.0j, -0.8 + 121.0j])
STEP = 0.002


def motion(z: ComplexArray, rest: FloatArray) -> ReducedTrajectory:
    """Return the motion eta = Re z + rest with its derivatives by differences."""
    eta = z.real + rest
    rate = first_derivative(eta, STEP)
    cut = (len(eta) - len(rate)) // 2
    twice = first_derivative(rate, STEP)
    y = np.hstack([eta[2 * cut : -2 * cut], rate[cut:-cut]])
    y_dot = np.hstack([rate[cut:-cut], twice])
    return ReducedTrajectory("motion", STEP * np.arange(len(y)), y, y_dot, y[:, :2], y[:, 2:])


def exchanging() -> list[ReducedTrajectory]:
    """1:2 resonance in which nearly all energy changes the mode within two periods; orders 2 and 3."""
    table = resonance_table(LAMBDA, 3, (1, 2))
    E, B = table.exponents, np.zeros(table.resonant.shape, dtype=np.complex128)
    # conj(z_1) z_2 and z_1^2 keep abs(z_1)^2 + 2 abs(z_2)^2
    B[0, (E == [0, 1, 1, 0]).all(axis=1)], B[1, (E == [2, 0, 0, 0]).all(axis=1)] = 60.0j, 30.0j
    B[0, (E == [2, 0, 1, 0]).all(axis=1)], B[1, (E == [0, 2, 0, 1]).all(axis=1)] = -10.0j, 5.0j
    t = STEP * np.arange(1601)
    still = np.zeros((1600, 2), dtype=np.complex128)
    starts = (np.array([0.45, 0.05j]), np.array([0.1, 0.35 + 0.1j]), np.array([0.3j, -0.2]))
    return [motion(march(t, z0.astype(complex), LAMBDA, E, B, still, still, 2e-4), np.zeros(2)) for z0 in starts]


def test_fast_exchange_is_refined_from_the_direct_fit(monkeypatch: pytest.MonkeyPatch) -> None:
    """Better than the direct fit on what both were fitted to, and than what band-passed signals alone lead to."""
    motions = exchanging()
    direct = fit_normal_form(motions, 3, (1, 2), 1e-8)
    refined = fit_on_trajectories(motions, 3, (1, 2), 1e-8)
    monkeypatch.setattr(trajectory_fit, "charted", lambda fit, training: band_passed(fit.dynamics, training))
    banded = fit_on_trajectories(motions, 3, (1, 2), 1e-8)
    errors = [np.mean([motion_error(fit, r) for r in motions]) for fit in (direct, refined, banded)]
    assert errors[1] < min(errors[0], errors[2])


def test_starts_that_all_blow_up_are_refused(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(refinement, "FAR", 0.1)
    with pytest.raises(NumericalError, match="blow up"):
        fit_on_trajectories(exchanging(), 3, (1, 2), 1e-8)


def test_a_motion_begins_where_samples_count() -> None:
    """What a fit has not seen before its first sample is not simulated; a motion seen from its start keeps it."""
    (r, *_) = exchanging()
    fit = fit_normal_form([r], 3, (1, 2), 1e-8)
    late = np.arange(len(r.t)) >= 500
    for n in (1, 4):
        (first, *_) = segments(charted(fit, [r]), [r], [late], n)
        assert first.t[0] == r.t[500]
        assert np.array_equal(first.z0, charted(fit, [r]).signals[0][500])
        assert first.kept.all()
        assert segments(charted(fit, [r]), [r], [np.ones(len(r.t), dtype=bool)], n)[0].t[0] == r.t[0]


def test_offsets_do_not_shorten_a_motion() -> None:
    """Mode 2 alone at 60 and 121 rad/s for 1.6 s: 31 of its periods, and an offset that mode 1 never crosses."""
    t = STEP * np.arange(801)
    z = np.exp(np.outer(t, LAMBDA)) * [0.001, 0.3]
    assert is_long_enough([motion(z, np.array([0.02, -0.01]))])
    assert not is_long_enough([motion(z[:400], np.array([0.02, -0.01]))])


def test_small_motions_give_the_linear_part_that_a_polynomial_over_all_amplitudes_bends() -> None:
    """Frequency 60 - 8 sqrt(abs(z_1)) rad/s, which no polynomial follows, and a motion that comes to rest elsewhere.

    Below 15 % of the amplitude 0.4 the frequency is between 60 and 60 - 8 sqrt(0.06); what the regression misses of 60
    goes with the root of the largest amplitude that it sees, sqrt(0.15) of what that over all samples does.
    """
    t = STEP * np.arange(3001)
    amplitude = 0.4 * np.exp(-0.9 * t)
    # integral of 8 sqrt(0.4) exp(-0.45 t)
    phase = 60.0 * t - 8.0 * np.sqrt(0.4) * (1.0 - np.exp(-0.45 * t)) / 0.45
    second = 0.3 * np.exp((-1.5 + 121.0j) * t)
    r = motion(np.column_stack([amplitude * np.exp(1j * phase), second]), np.array([0.01, -0.01]))
    kept = [np.ones(len(r.t), dtype=bool)]
    start = band_passed(fit_normal_form([r], 3, (1, 2), 1e-8).dynamics, [r])
    table = resonance_table(start.dynamics.eigenvalues, 3, (1, 2))
    reference = linear_reference(start, [r], kept, table, (1e-8, False))
    small = reference.eigenvalues
    everything = rates(start, [r], kept, table, keep_linear=False)[0]
    assert reference.origin == "small motions"
    assert 60.0 - 8.0 * np.sqrt(0.06) < small[0].imag < 60.0
    assert abs(small[0].imag - 60.0) < 1.5 * np.sqrt(0.15) * abs(everything[0].imag - 60.0)
    assert small[0].real == pytest.approx(-0.9, rel=0.05)


def test_motions_that_disagree_about_the_limit_of_small_motions_loosen_the_tie() -> None:
    """Frequencies 60 and 60.3 rad/s: the mean over eight blocks of each is known to 0.3 / 2 / sqrt(15) = 0.039 rad/s.

    Var = (G - 1) / G sum (w_b - w)^2 with w_b = w +- 0.15 / (G - 1), G = 16, if all blocks weigh alike; only the blocks
    with small samples count, four or more of each motion: 0.15 / sqrt(G - 1) lies between 0.039 and 0.057 then, and
    blocks that weigh unequally add to it.
    """
    t = STEP * np.arange(3001)

    def found(frequencies: tuple[float, float]) -> LinearReference:
        motions = [
            motion(np.exp(np.outer(t, [-0.9 + 1j * omega, -1.5 + 121.0j])) * [0.4, 0.3], np.zeros(2))
            for omega in frequencies
        ]
        start = band_passed(fit_normal_form(motions, 3, (1, 2), 1e-8).dynamics, motions)
        table = resonance_table(start.dynamics.eigenvalues, 3, (1, 2))
        return linear_reference(start, motions, [np.ones(len(r.t), dtype=bool) for r in motions], table, (1e-8, False))

    differing, same = found((60.0, 60.3)), found((60.15, 60.15))
    assert differing.eigenvalues[0].imag == pytest.approx(60.15, abs=0.05)
    assert 0.03 < differing.spread[0].imag < 0.08
    assert same.spread[0].imag < 0.1 * differing.spread[0].imag


def test_blocks_that_are_distorted_throughout_still_have_a_reference() -> None:
    """A record of six periods: a block is shorter than the distorted edge, the replicates want one for each."""
    t = STEP * np.arange(330)
    r = motion(np.exp(np.outer(t, LAMBDA)) * [0.05, 0.4], np.zeros(2))
    kept = [np.ones(len(r.t), dtype=bool)]
    start = band_passed(fit_normal_form([r], 3, (1, 2), 1e-8).dynamics, [r])
    table = resonance_table(start.dynamics.eigenvalues, 3, (1, 2))
    reference = linear_reference(start, [r], kept, table, (1e-8, False))
    assert reference.without.shape == (8, 2)
    assert np.array_equal(reference.without[0], reference.eigenvalues)
    assert np.all(np.isfinite(reference.spread))


def test_motions_that_end_while_they_are_large_tie_the_linear_part_to_all_amplitudes() -> None:
    """After 1.5 s mode 1 is at a quarter of its start, not below 0.15."""
    t = STEP * np.arange(751)
    r = motion(np.exp(np.outer(t, [-0.9 + 60.0j, -1.5 + 121.0j])) * [0.4, 0.3], np.zeros(2))
    kept = [np.ones(len(r.t), dtype=bool)]
    start = band_passed(fit_normal_form([r], 3, (1, 2), 1e-8).dynamics, [r])
    table = resonance_table(start.dynamics.eigenvalues, 3, (1, 2))
    reference = linear_reference(start, [r], kept, table, (1e-8, False))
    assert reference.origin == "all amplitudes"
    assert np.array_equal(reference.eigenvalues, rates(start, [r], kept, table, keep_linear=False)[0])
    notes = learning_notes([], None, random_model(), [], FitOrigin("band-passed signals", "all amplitudes"))
    assert "record longer ring-downs" in notes[0]
