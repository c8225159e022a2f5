"""Frequencies, damping and near-integer ratios of the modes."""

from __future__ import annotations

import itertools

from romgen.arrays import FloatArray
from romgen.report.blocks import TableBlock
from romgen.report.style import unit_text
from romgen.structure import Modes

RATIO_TOLERANCE = 0.1


def frequency_table(modes: Modes) -> TableBlock:
    """Frequency, damping ratio and modal load of every mode."""
    rows = tuple(
        (
            f"{k + 1}",
            f"{modes.frequency_hz[k]:.3f}",
            f"{100.0 * modes.damping_ratio[k]:.4f}",
            *(f"{value:+.4e}" for value in modes.modal_load[k]),
            *(f"{100.0 * value / modes.total_mass:.2f}" for row in modes.effective_mass[k : k + 1] for value in row),
        )
        for k in range(modes.frequency_hz.size)
    )
    loads = tuple(
        f"load by {name} [√kg per {unit_text(unit)}]"
        for name, unit in zip(modes.inputs, modes.input_units, strict=True)
    )
    masses = tuple(f"mass along {axis} [%]" for axis in "xyz") if len(modes.effective_mass) else ()
    caption = (
        "Modes about the preloaded state. "
        f"Damping is Rayleigh: alpha = {modes.alpha:.6g} 1/s, beta = {modes.beta:.6g} s. "
        "A modal load near zero means that input does not drive the mode. The effective mass is the share of the mass "
        "that moves with a mode along an axis."
    )
    return TableBlock(caption, ("mode", "frequency [Hz]", "damping ratio [%]", *loads, *masses), rows)


def near_integer_ratios(
    frequency_hz: FloatArray, tolerance: float = RATIO_TOLERANCE, highest: int = 3
) -> list[tuple[int, int, int, int, float]]:
    """Pairs of modes whose frequencies are nearly n:m.

    Returns
    -------
    (i, j, n, m, detuning) per pair, modes counted from 0, i < j: f_j / f_i = (m / n) (1 + detuning) with
    abs(detuning) <= tolerance, n and m coprime, 1 <= n <= m <= highest; nearest first.
    """
    ratios = [(n, m) for m in range(1, highest + 1) for n in range(1, m + 1) if m == 1 or _coprime(n, m)]
    found = [
        (i, j, n, m, float(frequency_hz[j] / frequency_hz[i] * n / m - 1.0))
        for i, j in itertools.combinations(range(frequency_hz.size), 2)
        for n, m in ratios
    ]
    return sorted((pair for pair in found if abs(pair[4]) <= tolerance), key=lambda pair: abs(pair[4]))


def _coprime(n: int, m: int) -> bool:
    """Whether n < m share no factor."""
    return n < m and all(m % d or n % d for d in range(2, n + 1))


def ratio_table(modes: Modes) -> TableBlock:
    """Near-integer frequency ratios, the candidates for internal resonance."""
    rows = tuple(
        (
            f"{i + 1} and {j + 1}",
            f"{n}:{m}",
            f"{modes.frequency_hz[j] / modes.frequency_hz[i]:.4f}",
            f"{100.0 * detuning:+.2f}",
        )
        for i, j, n, m, detuning in near_integer_ratios(modes.frequency_hz)
    )
    caption = (
        f"Frequency ratios within {100 * RATIO_TOLERANCE:.0f} % of a ratio of small integers. Frequencies "
        "shift with amplitude, so such modes may lock and exchange energy; both belong on the manifold."
    )
    return TableBlock(caption, ("modes", "near", "ratio [1]", "off by [%]"), rows)
