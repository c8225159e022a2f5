"""The headline numbers at the top of the report, each with its limit and verdict."""

from __future__ import annotations

import numpy as np

from romgen.arrays import FloatArray
from romgen.report.blocks import Card
from romgen.report.inputs import ReportInputs


def _frequencies_hz(inputs: ReportInputs) -> FloatArray:
    """Linear frequencies of the master modes: the model's where there is one, else the first modes."""
    if inputs.model is not None:
        return np.asarray(inputs.model.eigenvalues.imag / (2.0 * np.pi))
    return np.zeros(0) if inputs.modes is None else inputs.modes.frequency_hz[:2]


def frequency_cards(inputs: ReportInputs) -> list[Card]:
    """f1, f2 and their ratio; they are findings and carry no limit."""
    frequency_hz = _frequencies_hz(inputs)
    source = "reduced model, small amplitude" if inputs.model is not None else "preloaded FE model"
    cards = [Card(f"Frequency {k + 1}", f"{f:.2f}", "Hz", source) for k, f in enumerate(frequency_hz[:2])]
    if frequency_hz.size > 1:
        cards.append(Card("Frequency ratio", f"{frequency_hz[1] / frequency_hz[0]:.4f}", "", "mode 2 to mode 1"))
    return cards


def nmte_card(inputs: ReportInputs) -> list[Card]:
    """The worst validation motion against the limit."""
    unseen = [pair for pair in inputs.reconstructions if pair.role == "validation"]
    if not unseen:
        return []
    worst, limit = max(unseen, key=lambda pair: pair.nmte_percent), inputs.limits.nmte_percent
    note = f"limit {limit:g} %, worst of {len(unseen)}: {worst.trajectory.name}"
    passed = bool(worst.nmte_percent <= limit)
    return [Card("Validation NMTE", f"{worst.nmte_percent:.2f}", "%", note, passed)]


def forced_card(inputs: ReportInputs) -> list[Card]:
    """The worst forced amplitude against the finite-element model; it is a finding and carries no limit."""
    if not inputs.forced_points:
        return []
    worst = max(inputs.forced_points, key=lambda point: abs(point.error_percent))
    note = f"worst of {len(inputs.forced_points)} points computed by finite elements"
    return [Card("Forced amplitude error", f"{abs(worst.error_percent):.2f}", "%", note)]


def preload_card(inputs: ReportInputs) -> list[Card]:
    """Largest difference between contact force and applied force."""
    known = [] if inputs.preload is None else [i for i in inputs.preload.interfaces if np.isfinite(i.applied_force_n)]
    known = [interface for interface in known if interface.applied_force_n != 0.0]
    if not known:
        return []
    worst = max(100.0 * abs(i.normal_force_n / i.applied_force_n - 1.0) for i in known)
    limit, shown = inputs.limits.preload_percent, f"{worst:.2g}" if worst >= 1e-6 else "< 1e-6"
    return [Card("Clamping force error", shown, "%", f"limit {limit:g} %, worst interface", worst <= limit)]


def fmu_card(inputs: ReportInputs) -> list[Card]:
    """Agreement of the native unit with the Python model."""
    check, limit = inputs.fmu_check, inputs.limits.fmu_relative
    if check is None:
        return []
    problems = len(check.fmpy_problems)
    note = f"limit {limit:.0e} relative; fmpy reports {problems or 'no'} problem{'s' if problems > 1 else ''}"
    passed = bool(check.native_vs_python_rel <= limit and not problems)
    return [Card("FMU against Python", f"{check.native_vs_python_rel:.1e}", "", note, passed)]


def time_card(inputs: ReportInputs) -> list[Card]:
    """Wall time of all stages and the largest memory."""
    if not inputs.stages:
        return []
    total = sum(stage.wall_s for stage in inputs.stages)
    memory = max(stage.peak_memory_bytes for stage in inputs.stages) / 2**20
    return [Card("Run time", f"{total:.1f}", "s", f"all stages; peak memory {memory:,.0f} MiB")]


def cards(inputs: ReportInputs) -> tuple[Card, ...]:
    """All headline numbers that this study has."""
    builders = (frequency_cards, nmte_card, forced_card, preload_card, fmu_card, time_card)
    return tuple(card for build in builders for card in build(inputs))
