"""What an FMU says about itself."""

from __future__ import annotations

import zipfile
from dataclasses import dataclass
from pathlib import Path

from fmpy import read_model_description

from romgen.errors import InputError


@dataclass(frozen=True)
class UnitFacts:
    """The head of a model description and the binaries beside it.

    Attributes
    ----------
    name, guid, fmi_version, generation_tool : as written in modelDescription.xml.
    interfaces : "CoSimulation", "ModelExchange".
    platforms : folders with a binary.
    inputs, outputs : (name, unit) of each.
    """

    name: str
    guid: str
    fmi_version: str
    generation_tool: str
    interfaces: tuple[str, ...]
    platforms: tuple[str, ...]
    inputs: tuple[tuple[str, str], ...]
    outputs: tuple[tuple[str, str], ...]


def unit_facts(path: Path) -> UnitFacts:
    """Read the description of an FMU.

    Raises
    ------
    InputError : the file is no archive with a model description.
    """
    try:
        description = read_model_description(str(path), validate=False)
        with zipfile.ZipFile(path) as archive:
            names = archive.namelist()
    except Exception as error:  # fmpy raises plain Exception, zipfile and lxml their own, for what is no FMU
        raise InputError(f"is not an FMU ({error})", where=str(path)) from error
    parts = [name.split("/") for name in names if name.startswith("binaries/") and not name.endswith("/")]
    interfaces = {"CoSimulation": description.coSimulation, "ModelExchange": description.modelExchange}

    def variables(causality: str) -> tuple[tuple[str, str], ...]:
        return tuple((v.name, v.unit or "1") for v in description.modelVariables if v.causality == causality)

    return UnitFacts(
        name=description.modelName,
        guid=description.guid,
        fmi_version=description.fmiVersion,
        generation_tool=description.generationTool or "",
        interfaces=tuple(name for name, value in interfaces.items() if value is not None),
        platforms=tuple(sorted({part[1] for part in parts if len(part) > 2})),
        inputs=variables("input"),
        outputs=variables("output"),
    )
