"""The sections of the report in reading order; a section without data is None."""

from __future__ import annotations

import json
from collections.abc import Callable

import numpy as np

from romgen.provenance import Provenance
from romgen.report.backbone_figures import backbone_figure, backbone_name
from romgen.report.blocks import Block, ListingBlock, Section, TableBlock, TextBlock
from romgen.report.contact_figures import contact_figure, convergence_figure, resultant_table
from romgen.report.cost_figures import cost_figure, cost_table
from romgen.report.fmu_tables import check_table, export_table, levels_table, problem_listing, replay_table
from romgen.report.forced_figures import modal_figure, response_figure, response_table
from romgen.report.forced_points import forced_points_figure, forced_points_table
from romgen.report.forcing_tables import calibration_table, load_table
from romgen.report.history_figures import history_figure, history_table
from romgen.report.inputs import ReportInputs
from romgen.report.instantaneous_figures import instantaneous_figure, long_enough
from romgen.report.mode_tables import frequency_table, ratio_table
from romgen.report.model_tables import coefficient_table, order_table, spectrum_table, stability_table
from romgen.report.ringdown_figures import energy_figure, energy_table, nmte_table, ringdown_figure
from romgen.report.spectrogram_figures import spectrogram_figure
from romgen.report.structure_figures import mesh_figure, mode_figure


def warnings_section(inputs: ReportInputs) -> Section | None:
    """What a reader must know before believing the numbers."""
    if not inputs.warnings:
        return None
    rows = tuple((f"{k + 1}", text) for k, text in enumerate(inputs.warnings))
    return Section(
        "warnings", "Warnings", (TableBlock("Said by the stages of this run.", ("", "warning"), rows, True),)
    )


def structure_section(inputs: ReportInputs) -> Section | None:
    """The mesh."""
    structure = inputs.structure
    if structure is None:
        return None
    low, high = structure.points.min(axis=0), structure.points.max(axis=0)
    counts = np.bincount(structure.cell_body, minlength=len(structure.bodies))
    text = (
        f"{structure.points.shape[0]:,} nodes, {3 * structure.points.shape[0]:,} degrees of freedom, "
        f"{structure.cells.shape[0]:,} {' and '.join(dict.fromkeys(structure.cell_types))} elements in a box of "
        f"{' x '.join(f'{1e3 * d:.4g}' for d in high - low)} mm."
    )
    rows = tuple((name, f"{count:,}") for name, count in zip(structure.bodies, counts, strict=True))
    table = TableBlock("Bodies of the model.", ("body", "elements"), rows)
    return Section("structure", "Structure", (TextBlock(text), mesh_figure(structure), table))


def preload_section(inputs: ReportInputs) -> Section | None:
    """Static equilibrium and the state of the joints."""
    preload = inputs.preload
    if preload is None:
        return None
    maps: tuple[Block, ...] = ()
    if preload.interfaces:
        maps = (resultant_table(preload), contact_figure(preload))
    return Section("preload", "Preload and contact", (*maps, convergence_figure(preload)))


def modes_section(inputs: ReportInputs) -> Section | None:
    """Linear modes about the preloaded state."""
    modes = inputs.modes
    if modes is None:
        return None
    picture: tuple[Block, ...] = () if inputs.structure is None else (mode_figure(inputs.structure, modes),)
    return Section("modes", "Modes", (frequency_table(modes), *picture, ratio_table(modes)))


def ringdown_section(inputs: ReportInputs) -> Section | None:
    """Recorded motions against the reduced model."""
    pairs = inputs.reconstructions
    if not pairs:
        return None
    validation_first = sorted(pairs, key=lambda pair: pair.role, reverse=True)
    figures = tuple(ringdown_figure(pair) for pair in validation_first)
    return Section("ringdowns", "Ring-downs: reference against reduced model", (nmte_table(pairs), *figures))


def energy_section(inputs: ReportInputs) -> Section | None:
    """Energy balance of the computed transients."""
    if not inputs.ring_downs:
        return None
    figures = tuple(energy_figure(ring_down) for ring_down in inputs.ring_downs)
    return Section("energy", "Energy balance", (energy_table(inputs.ring_downs), *figures))


def spectrogram_section(inputs: ReportInputs) -> Section | None:
    """Frequency content of the validation motions (of all motions without any)."""
    if not inputs.reconstructions or inputs.model is None:
        return None
    unseen = tuple(pair for pair in inputs.reconstructions if pair.role == "validation") or inputs.reconstructions
    frequency_hz = inputs.model.eigenvalues.imag / (2.0 * np.pi)
    maps = (spectrogram_figure(pair, frequency_hz, inputs.model.internal_resonance) for pair in unseen)
    long = [pair for pair in unseen if long_enough(pair, frequency_hz)]
    curves = (instantaneous_figure(pair, frequency_hz) for pair in long)
    short = ", ".join(pair.trajectory.name for pair in unseen if not long_enough(pair, frequency_hz))
    note = (TextBlock(f"Too short for instantaneous frequency and damping: {short}."),) if short else ()
    return Section("spectrogram", "Frequency content and damping of the decay", (*maps, *curves, *note))


def model_section(inputs: ReportInputs) -> Section | None:
    """The equations that were learned."""
    if inputs.model is None:
        return None
    orders: tuple[Block, ...] = (order_table(inputs.orders),) if inputs.orders else ()
    reason: tuple[Block, ...] = ()
    if inputs.resonance_reason:
        reason = (TextBlock(f"Terms were kept in the normal form by this rule: {inputs.resonance_reason}."),)
    polar: tuple[Block, ...] = ()
    if inputs.polar_form:
        polar = (ListingBlock("Normal form in polar coordinates, zⱼ = ρⱼ exp(iθⱼ).", inputs.polar_form),)
    coefficients = coefficient_table(inputs.model, inputs.coefficient_deviation)
    tried = inputs.model.stability
    stable: tuple[Block, ...] = () if tried is None else (stability_table(tried),)
    blocks = (spectrum_table(inputs.model), *stable, *orders, *reason, *polar, coefficients)
    return Section("model", "Reduced model", blocks)


def forcing_section(inputs: ReportInputs) -> Section | None:
    """Load inputs that were calibrated or given."""
    if not inputs.loads:
        return None
    tables = tuple(calibration_table(load) for load in inputs.loads if load.points)
    return Section("forcing", "Load inputs", (load_table(inputs.loads), *tables))


def forced_section(inputs: ReportInputs) -> Section | None:
    """Frequency response at all levels."""
    response = inputs.forced
    if response is None or not response.curves:
        return None
    modal: tuple[Block, ...] = () if inputs.model is None else (modal_figure(response, inputs.model),)
    notes = tuple(TextBlock(f"{note[:1].upper()}{note[1:]}.") for note in response.notes)
    checked: tuple[Block, ...] = ()
    if inputs.forced_points:
        checked = (forced_points_table(inputs.forced_points), forced_points_figure(inputs.forced_points))
    figure = response_figure(response, inputs.backbones, inputs.forced_points, inputs.loads)
    blocks = (figure, *checked, response_table(response), *modal, *notes)
    return Section("forced", "Forced response", blocks)


def history_section(inputs: ReportInputs) -> Section | None:
    """Load histories in both models."""
    if not inputs.histories:
        return None
    return Section("histories", "Load histories", (history_table(inputs.histories), history_figure(inputs.histories)))


def backbone_section(inputs: ReportInputs) -> Section | None:
    """Free vibration of the reduced model."""
    if not inputs.backbones:
        return None
    figure = backbone_figure(inputs.backbones, inputs.sensor, inputs.measure, inputs.bands)
    notes = tuple(TextBlock(f"{backbone_name(curve)}: {note}.") for curve in inputs.backbones for note in curve.notes)
    return Section("backbone", "Backbone and damping", (figure, *notes))


def fmu_section(inputs: ReportInputs) -> Section | None:
    """The exported unit and its checks."""
    check = inputs.fmu_check
    exports = (
        ("native unit, FMI 2.0", inputs.fmu_export),
        ("pythonfmu unit, FMI 2.0", inputs.pythonfmu_export),
        ("unit with arrays, FMI 3.0", inputs.fmi3_export),
    )
    exported = tuple(export_table(kind, export) for kind, export in exports if export is not None)
    replayed: tuple[Block, ...] = (replay_table(inputs.fmu_replays),) if inputs.fmu_replays else ()
    checked: tuple[Block, ...] = ()
    if check is not None:
        checked = (check_table(check, inputs.limits.fmu_relative), problem_listing(check))
    levels = () if inputs.fmu_levels is None else (levels_table(inputs.fmu_levels),)
    blocks = (*exported, *checked, *levels, *replayed)
    return Section("fmu", "Exported FMU", blocks) if blocks else None


def cost_section(inputs: ReportInputs) -> Section | None:
    """Time and memory."""
    if not inputs.stages:
        return None
    return Section("cost", "Time and memory", (cost_figure(inputs.stages), cost_table(inputs.stages)))


def provenance_section(inputs: ReportInputs) -> Section | None:
    """How to make the numbers again and what they were made with."""
    command = ListingBlock("The command that makes this report again.", inputs.command)
    recorded: tuple[Block, ...] = ()
    if inputs.provenance is not None:
        settings = json.dumps(json.loads(inputs.provenance.study_json), indent=2)
        listing = ListingBlock("All settings of the study, defaults included.", settings, folded=True)
        recorded = (provenance_table(inputs.provenance), listing)
    return Section("provenance", "Provenance and reproduction", (command, *recorded))


def provenance_table(provenance: Provenance) -> TableBlock:
    """Versions, hashes, threads and machine."""
    rows = (
        ("created", provenance.created),
        ("romgen", provenance.romgen_version),
        ("source commit", provenance.git_commit or "installed package"),
        ("study sha256", provenance.study_sha256),
        ("Python", provenance.python),
        ("system", f"{provenance.system}, {provenance.machine}, {provenance.cpu_count} processors"),
        ("threads of compiled kernels", f"{provenance.numba_threads}"),
        *((f"seed of {name}", f"{seed}") for name, seed in provenance.seeds.items()),
        *provenance.environment.items(),
        ("packages", ", ".join(f"{name} {version}" for name, version in provenance.packages.items())),
    )
    return TableBlock("Versions, hashes and machine of this run.", ("what", "value"), rows, True)


BUILDERS: tuple[Callable[[ReportInputs], Section | None], ...] = (
    warnings_section,
    structure_section,
    preload_section,
    modes_section,
    ringdown_section,
    spectrogram_section,
    model_section,
    energy_section,
    forcing_section,
    forced_section,
    history_section,
    backbone_section,
    fmu_section,
    cost_section,
    provenance_section,
)


def sections(inputs: ReportInputs) -> tuple[Section, ...]:
    """All sections that have data, in reading order."""
    built = (build(inputs) for build in BUILDERS)
    return tuple(section for section in built if section is not None)
