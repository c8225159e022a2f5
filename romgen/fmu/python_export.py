"""Export of the same model as a pythonfmu unit: a cross-check, and a slave that is easy to change."""

from __future__ import annotations

import importlib.metadata
import json
import sys
import tempfile
import zipfile
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import replace
from pathlib import Path

from pythonfmu.builder import FmuBuilder

from romgen.fmu.archive import write_archive
from romgen.fmu.description import (
    PYTHON_INTERFACES,
    DescriptionText,
    content_guid,
    documentation_page,
    generation_time,
    model_description,
    tool_name,
)
from romgen.fmu.interface import FmuInterface, build_interface
from romgen.fmu.model_file import model_json
from romgen.fmu.records import FmuExport, FmuInfo, InterfaceOptions
from romgen.fmu.selection import exported_model, interface_options
from romgen.fmu.templates import default_icon, licence_files, template_text
from romgen.fmu.variable import Variable
from romgen.reduced_model import ReducedModel
from romgen.settings import FmuSettings

NOTES = (
    "needs a Python interpreter with numpy on the target; plain C importers cannot load it",
    "inputs are held in each step; no state saving, no Model Exchange, start values of the states only",
    "modelDescription.xml was rewritten: pythonfmu leaves InitialUnknowns empty and draws a new GUID at each build",
)


def export_pythonfmu(
    model: ReducedModel, path: Path | str, settings: FmuSettings, *, info: FmuInfo | None = None
) -> FmuExport:
    """Write a model as a pythonfmu archive with the variables of the native unit.

    Parameters
    ----------
    model, path, settings, info : as for ``export_fmu``; platforms are those pythonfmu ships.

    Raises
    ------
    InputError : for a model or settings that cannot be exported.
    """
    chosen = exported_model(model, settings.sensors)
    options = replace(interface_options(model, settings, info or FmuInfo()), start_from_sensors=False)
    interface = _numbered_as_registered(build_interface(chosen, options))
    tool = f"{tool_name()}, pythonfmu {importlib.metadata.version('pythonfmu')}"
    text = DescriptionText(chosen.name, tool, info or FmuInfo(), settings.step_size, PYTHON_INTERFACES)
    resources = {
        f"{chosen.name}_slave.py": template_text("slave.py"),
        "rom.json": model_json(chosen),
        "slave.json": _slave_json(interface, options),
    }
    guid = content_guid(model_description(text, interface, guid="", date=""), *resources.values())
    content = {
        **_built_by_pythonfmu(resources, f"{chosen.name}_slave.py"),
        **licence_files(),
        "model.png": text.info.picture or default_icon(),
        "documentation/licenses/pythonfmu.txt": _pythonfmu_licence(),
        "documentation/index.html": documentation_page(chosen, interface, text).encode(),
        "modelDescription.xml": model_description(text, interface, guid=guid, date=generation_time()).encode(),
    }
    size, sha256 = write_archive(Path(path), content)
    platforms = tuple(sorted({name.split("/")[1] for name in content if name.startswith("binaries/")}))
    return FmuExport(str(path), size, sha256, guid, platforms, "pythonfmu", NOTES)


def _numbered_as_registered(interface: FmuInterface) -> FmuInterface:
    """pythonfmu counts variables of all types together, in the order of registration."""
    return replace(interface, variables=tuple(replace(v, reference=k) for k, v in enumerate(interface.variables)))


def _slave_json(interface: FmuInterface, options: InterfaceOptions) -> str:
    """For each variable its type, name, role and place in that role; and the values of parameters and constants."""
    count: dict[str, int] = {}
    rows = []
    for v in interface.variables:
        role = _role(v)
        rows.append(["Boolean" if v.unit is None else "Real", v.name, role, count.get(role, 0)])
        count[role] = count.get(role, 0) + 1
    values = {v.name: float(v.start) for v in interface.variables if _role(v) in {"parameter", "constant"} and v.start}
    return json.dumps({"variables": rows, "parameters": values, "base_share": options.base_share}, indent=0)


def _role(v: Variable) -> str:
    if v.unit is None:
        return "inside" if v.causality == "output" else "warn"
    if v.causality == "local":
        return {"constant": "constant"}.get(v.variability, "state" if v.state is None else "rate")
    return v.causality


def _built_by_pythonfmu(resources: dict[str, str], script: str) -> dict[str, bytes]:
    """The files pythonfmu packs around a slave, by path in the archive."""
    with tempfile.TemporaryDirectory(prefix="romgen_slave_") as folder, _import_state_kept():
        root = Path(folder)
        for name, text in resources.items():
            (root / name).write_text(text, encoding="utf-8")
        others = [root / name for name in resources if name != script]
        built = FmuBuilder.build_FMU(root / script, dest=root / "built.fmu", project_files=others)
        with zipfile.ZipFile(built) as archive:
            return {name.replace("\\", "/"): archive.read(name) for name in archive.namelist()}


@contextmanager
def _import_state_kept() -> Iterator[None]:
    """pythonfmu imports the slave from a temporary folder and leaves both the folder and the module behind."""
    path, modules = list(sys.path), set(sys.modules)
    try:
        yield
    finally:
        sys.path[:] = path
        for name in set(sys.modules) - modules:
            if name.endswith("_slave"):
                del sys.modules[name]


def _pythonfmu_licence() -> bytes:
    files = importlib.metadata.files("pythonfmu") or []
    texts = [file.read_binary() for file in files if file.name.upper().startswith("LICENSE")]
    return b"\n".join(texts) or b"pythonfmu is under the MIT License, see https://github.com/NTNU-IHB/PythonFMU\n"
