"""Frequencies, damping and near-integer ratios of the modes."""

from __future__ import annotations

from romgen.report.blocks import TableBlock
from romgen.report.style import unit_text
from romgen.structure import RATIO_TOLERANCE, Modes


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


def ratio_table(modes: Modes) -> TableBlock:
    """Near-integer frequency ratios, the candidates for internal resonance."""
    rows = tuple(
        (
            f"{r.first + 1} and {r.second + 1}",
            f"{r.low}:{r.high}",
            f"{modes.frequency_hz[r.second] / modes.frequency_hz[r.first]:.4f}",
            f"{100.0 * r.detuning:+.2f}",
        )
        for r in modes.near_ratios
    )
    caption = (
        f"Frequency ratios within {100 * RATIO_TOLERANCE:.0f} % of a ratio of small integers. Frequencies "
        "shift with amplitude, so such modes may lock and exchange energy; both belong on the manifold."
    )
    return TableBlock(caption, ("modes", "near", "ratio [1]", "off by [%]"), rows)
