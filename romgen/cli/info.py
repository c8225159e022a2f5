"""romgen info: what is in a study, a result.h5, a summary.json or an FMU."""

from __future__ import annotations

import json
from dataclasses import asdict
from pathlib import Path
from typing import Annotated, Any

import typer

from romgen.cli.check import describe
from romgen.cli.failures import reported
from romgen.cli.options import Json, Quiet, open_study
from romgen.cli.output import Output
from romgen.errors import InputError
from romgen.fmu.unit_facts import unit_facts
from romgen.result_store import read_infos


@reported
def info(
    file: Annotated[
        Path, typer.Argument(metavar="FILE", help="study.toml, result.h5, summary.json, FMU or run folder.")
    ],
    json_output: Json = False,
    quiet: Quiet = False,
) -> None:
    """Show what a file of romgen holds."""
    out = Output(quiet=quiet, as_json=json_output)
    if file.is_dir():
        inside = [file / name for name in ("result.h5", "study.toml") if (file / name).is_file()]
        if not inside:
            raise InputError("no run folder and no study", where=str(file), advice="it has no result.h5 or study.toml")
        file = inside[0]
    if not file.is_file():
        raise InputError("no such file", where=str(file))
    show = {".toml": _study, ".h5": _result, ".json": _summary, ".fmu": _unit}.get(file.suffix.lower())
    if show is None:
        raise InputError("unknown kind of file", where=str(file), advice="give a .toml, .h5, .json or .fmu file")
    out.document(show(file, out))


def _study(file: Path, out: Output) -> Any:
    study = open_study(file)
    out.text(describe(study))
    return study.model_dump(mode="json", exclude_none=True)


def _result(file: Path, out: Output) -> Any:
    infos = read_infos(file)
    rows = [
        (name, f"{stage.wall_s:.1f} s", f"{stage.peak_memory_bytes / 1e6:.0f} MB", stage.key[:12])
        for name, stage in infos.items()
    ]
    out.table(("stage", "wall time", "peak memory", "key"), rows, numbers=True)
    for name, stage in infos.items():
        for message in stage.messages:
            out.text(f"{name}: {message}")
    return {name: {"wall_s": stage.wall_s, "key": stage.key} for name, stage in infos.items()}


def _summary(file: Path, out: Output) -> Any:
    try:
        content = json.loads(file.read_text(encoding="utf-8"))
    except ValueError as error:
        raise InputError(f"not valid JSON: {error}", where=str(file)) from error
    for name, value in _leaves(content, ""):
        out.text(f"{name} = {value}")
    return content


def _leaves(content: Any, path: str) -> list[tuple[str, str]]:
    """Flatten nested tables to dotted names; arrays stay in one line."""
    if isinstance(content, dict):
        return [leaf for key, value in content.items() for leaf in _leaves(value, f"{path}.{key}".lstrip("."))]
    return [(path, json.dumps(content))]


def _unit(file: Path, out: Output) -> Any:
    facts = unit_facts(file)
    out.text(f"{facts.name}: FMI {facts.fmi_version} {' and '.join(facts.interfaces)}, {facts.generation_tool}")
    out.text(f"guid {facts.guid}, binaries for {', '.join(facts.platforms) or 'no platform (sources only)'}")
    rows = [("input", name, unit) for name, unit in facts.inputs]
    rows += [("output", name, unit) for name, unit in facts.outputs]
    out.table(("causality", "variable", "unit"), rows)
    return asdict(facts)
