"""Cross-checks of a study before anything is computed: names, files, overlaps, units."""

from __future__ import annotations

import difflib
import re
from collections.abc import Iterable, Iterator
from itertools import product

import numpy as np

from romgen.settings.data import DataSettings
from romgen.settings.finite_elements import RingDownSettings
from romgen.settings.learning import FmuSettings
from romgen.settings.points import place_problems, place_warnings, unknown_bodies
from romgen.settings.study import BASE_ACCELERATION, Study

PLATFORMS = ("host", "all", "linux64", "win64", "darwin64", "aarch64-linux", "aarch64-darwin")
PNG = b"\x89PNG\r\n\x1a\n"
# Plausible solids, foam to tungsten; outside of it the unit system is probably not SI.
DENSITY_RANGE = (50.0, 25_000.0)
YOUNG_MODULUS_RANGE = (1e6, 2e12)
_IDENTIFIER = re.compile(r"[A-Za-z][A-Za-z0-9_]*")
# Two starts closer than 1 degree in amplitude space are the same motion at another level.
SAME_MIX = np.cos(np.deg2rad(1.0))


def study_problems(study: Study) -> tuple[str, ...]:
    """Return one line per thing that the study names but does not have, or contradicts."""
    data = study.data
    checks = _model_checks(study) if data is None else (_data_problems(data), _forcing_problems(study, data.sensors))
    problems = [problem for check in checks for problem in check]
    return (*problems, *_learn_problems(study), *_downstream_problems(study))


def study_warnings(study: Study) -> tuple[str, ...]:
    """Return one line per value that is legal but may not be what was meant: units, sensors where bodies touch."""
    lines = list(place_warnings(study))
    for name, material in study.materials.items():
        for key, value, (low, high), unit in (
            ("density", material.density, DENSITY_RANGE, "kg/m^3"),
            ("young_modulus", material.young_modulus, YOUNG_MODULUS_RANGE, "Pa"),
        ):
            if not low <= value <= high:
                lines.append(
                    f"[materials.{name}] {key} = {value:g} {unit} is outside {low:g} to {high:g}; "
                    "is the study in mm-t-s or mm-kg-ms? write SI numbers or a unit, such as '195 GPa'"
                )
    return tuple(lines)


def surfaces(study: Study) -> tuple[str, ...]:
    """Return the names of all block faces, "<block>.<axis>_<min|max>", and of all regions, "<body>.<region>"."""
    faces = (f"{block}.{axis}_{end}" for block, axis, end in product(study.blocks, "xyz", ("min", "max")))
    return (*faces, *(f"{region.body}.{name}" for name, region in study.regions.items()))


def named_surfaces(study: Study) -> tuple[tuple[str, str], ...]:
    """Return where the study names a surface or a set of nodes, and the name, "<body>.<surface>"."""
    joints = [(f"[contacts.{name}]", pair.slave, pair.master) for name, pair in study.contacts.items()]
    joints += [(f"[ties.{name}]", tie.slave, tie.master) for name, tie in study.ties.items()]
    named = [(f"{where} slave:", slave) for where, slave, _ in joints]
    named += [(f"{where} master:", master) for where, _, master in joints]
    named += [(f"[foundations.{name}] surface:", bed.surface) for name, bed in study.foundations.items()]
    named += [(f"[constraints[{k}]] surface:", item.surface) for k, item in enumerate(study.constraints)]
    named += [(f"[loads[{k}]] surface:", item.surface) for k, item in enumerate(study.loads) if item.surface]
    named += [
        (f"[excitations.{name}] surface:", item.surface) for name, item in study.excitations.items() if item.surface
    ]
    return tuple(named)


def unknown(where: str, kind: str, name: str, known: Iterable[str]) -> str:
    """Return the line that says a name is not known, with the closest one that is."""
    known = tuple(known)
    close = difflib.get_close_matches(name, known, n=1, cutoff=0.6)
    advice = f"did you mean '{close[0]}'?" if close else f"known are {', '.join(known) or 'none'}"
    return f"{where} unknown {kind} '{name}'; {advice}"


def _model_checks(study: Study) -> tuple[Iterator[str], ...]:
    return (
        _material_problems(study),
        _surface_problems(study),
        _contact_problems(study),
        _sensor_problems(study),
        _excitation_problems(study),
        _mode_problems(study),
        _ringdown_problems(study.ringdowns, len(study.learn.master_modes)),
    )


def _material_problems(study: Study) -> Iterator[str]:
    for name, body in study.bodies.items():
        if body.material not in study.materials:
            table = "blocks" if name in study.blocks else "meshes"
            yield unknown(f"[{table}.{name}] material:", "material", body.material, study.materials)
    for name, mesh in study.meshes.items():
        if not mesh.file.is_file():
            yield f"[meshes.{name}] file: no such file; got '{mesh.file}'"


def _surface_problems(study: Study) -> Iterator[str]:
    """Names on bodies from mesh files are checked when the files are opened."""
    known = surfaces(study)
    for name, region in study.regions.items():
        if region.body not in study.bodies:
            yield unknown(f"[regions.{name}] body:", "body", region.body, study.bodies)
    for where, surface in named_surfaces(study):
        body, _, parts = surface.partition(".")
        if body in study.meshes:
            continue
        for part in [parts] if where.startswith("[contacts") else parts.split("&"):
            if f"{body}.{part}" not in known and not (body in study.blocks and part == "skin"):
                own = [name for name in known if name.split(".")[0] == body]
                yield unknown(where, "surface", f"{body}.{part}" if parts else surface, own or known)


def _contact_problems(study: Study) -> Iterator[str]:
    for name, pair in study.contacts.items():
        if pair.slave.split(".")[0] == pair.master.split(".")[0]:
            yield f"[contacts.{name}] slave and master belong to the same block; got '{pair.slave}', '{pair.master}'"
    for name, bolt in study.bolts.items():
        if bolt.body not in study.bodies:
            yield unknown(f"[bolts.{name}] body:", "body", bolt.body, study.bodies)
    bolted = [bolt.body for bolt in study.bolts.values()]
    if len(set(bolted)) < len(bolted):
        yield f"[bolts] each needs a body of its own; got {', '.join(bolted)}"
    names = [load.name for load in study.loads]
    if len(set(names)) < len(names):
        yield f"[[loads]] names must differ; got {', '.join(names)}"


def _sensor_problems(study: Study) -> Iterator[str]:
    if not study.sensors:
        yield "[sensors] is empty; name at least one, such as [sensors.mid]"
    for where, body in unknown_bodies(study):
        yield unknown(where, "body", body, study.bodies)
    yield from place_problems(study)


def _excitation_problems(study: Study) -> Iterator[str]:
    for name in study.excitations:
        where = f"[excitations.{name}]"
        if not _IDENTIFIER.fullmatch(name):
            yield f"{where} the name becomes a variable of the FMU: letters, digits and underscores; got '{name}'"
        if name in (BASE_ACCELERATION, *study.sensors):
            yield f"{where} the name is taken by another input or a sensor; choose another"


def _mode_problems(study: Study) -> Iterator[str]:
    count = study.modes.count
    for where, modes in (
        ("[modes] rayleigh_modes", study.modes.rayleigh_modes),
        ("[learn] master_modes", study.learn.master_modes),
    ):
        if min(modes) < 1 or max(modes) > count:
            yield f"{where} are numbered from 1 to count = {count}; got {list(modes)}"


def _ringdown_problems(ringdowns: RingDownSettings | None, masters: int) -> Iterator[str]:
    if ringdowns is None:
        return
    names = [start.name for start in ringdowns.starts]
    if len(set(names)) < len(names):
        yield f"[ringdowns] names of starts must differ; got {', '.join(names)}"
    if ringdowns.max_doublings and ringdowns.error_tolerance is None:
        yield "[ringdowns] max_doublings needs an error_tolerance: fixed steps are never doubled"
    if ringdowns.explicit_step is not None and ringdowns.scheme != "central_difference":
        yield '[ringdowns] explicit_step belongs to scheme = "central_difference"'
    for start in ringdowns.starts:
        if len(start.amplitudes) != masters:
            yield f"[ringdowns] start '{start.name}' needs one amplitude per master mode ({masters}); " + (
                f"got {len(start.amplitudes)}"
            )
        elif not np.any(start.amplitudes):
            yield f"[ringdowns] start '{start.name}' has only zero amplitudes"
    for held_out, trained in product(ringdowns.validation, ringdowns.training):
        if _same_mix(held_out.amplitudes, trained.amplitudes):
            yield f"[ringdowns] validation '{held_out.name}' is a multiple of training '{trained.name}'; change its mix"


def _same_mix(a: tuple[float, ...], b: tuple[float, ...]) -> bool:
    lengths = float(np.linalg.norm(a) * np.linalg.norm(b))
    return len(a) == len(b) and len(a) > 1 and lengths > 0 and abs(float(np.dot(a, b))) > SAME_MIX * lengths


def _data_problems(data: DataSettings) -> Iterator[str]:
    for file in data.files:
        if not file.is_file():
            yield f"[data] files: no such file; got '{file}'; put it there, or name it relative to the study file"
    both = set(data.training) & set(data.validation)
    if both:
        yield f"[data] validation overlaps training; got {', '.join(map(str, sorted(both, key=str)))} in both"
    if len(set(data.sensors)) < len(data.sensors):
        yield f"[data] sensors must differ; got {', '.join(data.sensors)}"


def _forcing_problems(study: Study, sensors: tuple[str, ...]) -> Iterator[str]:
    count = len(study.learn.master_modes)
    for name, table in study.forcing.items():
        where = f"[forcing.{name}]"
        if not _IDENTIFIER.fullmatch(name):
            yield f"{where} the name becomes a variable of the FMU: letters, digits and underscores; got '{name}'"
        if name in sensors:
            yield f"{where} the name is taken by a sensor; choose another"
        if any(mode > count for mode in table.modes):
            yield f"{where} modes are numbered from 1 to the {count} of [learn] master_modes; got {list(table.modes)}"
        for k, point in enumerate(table.points, 1):
            if point.sensor not in sensors:
                yield unknown(f"{where} sensor of point {k}:", "sensor", point.sensor, sensors)
            if point.mode is not None and point.mode > count:
                yield f"{where} mode of point {k}: [learn] master_modes has {count} modes; got {point.mode}"
        for sensor, shares in table.participation.items():
            if sensor not in sensors:
                yield unknown(f"{where} participation:", "sensor", sensor, sensors)
            if len(shares) != count:
                yield f"{where} participation of {sensor}: one number per master mode ({count}); got {len(shares)}"
        if table.participation and not any(any(shares) for shares in table.participation.values()):
            yield f"{where} participation is zero for all modes: the input would drive nothing"


def _learn_problems(study: Study) -> Iterator[str]:
    learn = study.learn
    if len(set(learn.master_modes)) < len(learn.master_modes) or not learn.master_modes:
        yield f"[learn] master_modes must differ and not be empty; got {list(learn.master_modes)}"
    if any(mode < 1 for mode in learn.master_modes):
        yield f"[learn] master_modes are numbers from 1; got {list(learn.master_modes)}"
    resonance = learn.internal_resonance
    if resonance not in ("auto", "gap", ()) and len(resonance) != len(learn.master_modes):
        yield f"[learn] internal_resonance needs one integer per master mode; got {list(resonance)}"
    if isinstance(learn.order, int) and not 2 <= learn.order <= 9:
        yield f"[learn] order must be 2 to 9 or 'auto'; got {learn.order}"


def _downstream_problems(study: Study) -> Iterator[str]:
    forced, known = study.forced_response, study.sensor_names
    if forced.sensor is not None and forced.sensor not in known:
        yield unknown("[forced_response] sensor:", "sensor", forced.sensor, known)
    if forced.levels and study.data is not None and not study.forcing:
        yield f"[forced_response] levels need a load input, which data do not have; add [forcing.{forced.input}]"
    elif forced.levels and forced.input not in study.load_inputs:
        yield unknown("[forced_response] input:", "load input", forced.input, study.load_inputs)
    if any(level == 0.0 for level in forced.levels):
        yield f"[forced_response] levels must not be 0; got {list(forced.levels)}"
    low, high = forced.frequency_range_hz or (0.0, 1.0)
    if not low < high:
        yield f"[forced_response] frequency_range_hz must rise; got [{low:g}, {high:g}]"
    if study.forced_validation is not None and (study.data is not None or not forced.levels):
        yield "[forced_validation] needs a finite-element model and [forced_response] levels; remove the table"
    for name, history in study.load_histories.items():
        where = f"[load_histories.{name}]"
        if study.data is not None:
            yield f"{where} needs a finite-element model; remove the table"
        elif history.input not in study.load_inputs:
            yield unknown(f"{where} input:", "load input", history.input, study.load_inputs)
        if history.file is not None and not history.file.is_file():
            yield f"{where} file: no such file; got '{history.file}'"
    yield from _fmu_problems(study.fmu, tuple(study.load_inputs), known)


def _fmu_problems(fmu: FmuSettings, inputs: tuple[str, ...], sensors: tuple[str, ...]) -> Iterator[str]:
    for platform in fmu.platforms:
        if platform not in PLATFORMS:
            yield unknown("[fmu] platforms:", "platform", platform, PLATFORMS)
    for sensor in fmu.sensors or ():
        if sensor not in sensors:
            yield unknown("[fmu] sensors:", "sensor", sensor, sensors)
    for name, (low, high) in fmu.input_range.items():
        if name not in inputs:
            yield unknown("[fmu] input_range:", "load input", name, inputs)
        elif not low <= 0.0 <= high or low == high:
            yield f"[fmu] input_range: {name} starts at 0, its range must hold 0 and more; got [{low:g}, {high:g}]"
    if fmu.icon is not None and not fmu.icon.is_file():
        yield f"[fmu] icon: no such file; got '{fmu.icon}'"
    elif fmu.icon is not None:
        with fmu.icon.open("rb") as file:
            is_png = file.read(len(PNG)) == PNG
        if not is_png:
            yield f"[fmu] icon: importers show PNG images only; got '{fmu.icon}'"
