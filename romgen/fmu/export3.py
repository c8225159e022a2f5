"""Export of a reduced model as an FMI 3.0 unit: the same kernel, sensors as arrays."""

from __future__ import annotations

from pathlib import Path

from romgen.fmu.archive import write_archive
from romgen.fmu.arrays3 import array_interface
from romgen.fmu.build import build_binaries
from romgen.fmu.description import (
    DescriptionText,
    content_guid,
    documentation_page,
    generation_time,
    tool_name,
)
from romgen.fmu.export import generated_sources, silent
from romgen.fmu.interface import build_interface
from romgen.fmu.model_file import model_resources
from romgen.fmu.records import FmuExport, FmuInfo, InterfaceOptions
from romgen.fmu.selection import exported_model, interface_options
from romgen.fmu.templates import default_icon, licence_files, licence_files3, render, runtime_sources3
from romgen.fmu.units import unit_of
from romgen.progress import Report
from romgen.reduced_model import ReducedModel
from romgen.settings import FmuSettings

COMMON = {
    "needsExecutionTool": "false",
    "canBeInstantiatedOnlyOncePerProcess": "false",
    "canGetAndSetFMUState": "true",
    "canSerializeFMUState": "true",
    "providesDirectionalDerivatives": "true",
    "providesAdjointDerivatives": "true",
}
INTERFACES = {
    "ModelExchange": {**COMMON, "needsCompletedIntegratorStep": "true"},
    "CoSimulation": {
        **COMMON,
        "canHandleVariableCommunicationStepSize": "true",
        "maxOutputDerivativeOrder": "1",
        "providesIntermediateUpdate": "true",
        "hasEventMode": "false",
    },
}
"""Capabilities by interface."""

FOLDERS = {
    "linux64": "x86_64-linux",
    "win64": "x86_64-windows",
    "darwin64": "x86_64-darwin",
    "aarch64-linux": "aarch64-linux",
    "aarch64-darwin": "aarch64-darwin",
}
"""Platform tuples of FMI 3.0 by the folder names of FMI 2.0."""


def export_fmi3(
    model: ReducedModel,
    path: Path | str,
    settings: FmuSettings,
    *,
    info: FmuInfo | None = None,
    report: Report = silent,
) -> FmuExport:
    """Write a model as one archive for FMI 3.0 Co-Simulation and Model Exchange.

    Sensors, states and modes are Float64 arrays. In Co-Simulation an importer that gives an intermediate update
    callback is asked for the inputs at the middle and the end of every internal step.

    Parameters
    ----------
    model, path, settings, info, report : as for ``export_fmu``.

    Raises
    ------
    InputError : for a model or settings that cannot be exported.
    RomgenError : when a compiler fails.
    """
    info = info or FmuInfo()
    chosen, options = exported_model(model, settings.sensors), interface_options(model, settings, info)
    content, guid = _content(chosen, settings.step_size, info, options)
    sources = {Path(name).name: data for name, data in content.items() if name.endswith((".c", ".h"))}
    binaries = build_binaries(chosen.name, sources, settings.platforms, report)
    for name, data in binaries.files.items():
        _, platform, library = name.split("/")
        content[f"binaries/{FOLDERS[platform]}/{library}"] = data
    size, sha256 = write_archive(Path(path), content)
    return FmuExport(str(path), size, sha256, guid, binaries.platforms, binaries.compiler, binaries.notes)


def generated_sources3(model: ReducedModel, guid: str, options: InterfaceOptions) -> dict[str, bytes]:
    """All C files of a unit: those of FMI 2.0 under a prefix, and the FMI 3.0 functions on top of them."""
    files = {**generated_sources(model, guid, options), **runtime_sources3()}
    guard = b"#define MODEL_SIZES_H\n"
    prefix = f"#define FMI2_FUNCTION_PREFIX {model.name}_ /* not part of the interface here */\n".encode()
    return {**files, "model_sizes.h": files["model_sizes.h"].replace(guard, guard + prefix)}


def _content(
    model: ReducedModel, step_size: float, info: FmuInfo, options: InterfaceOptions
) -> tuple[dict[str, bytes], str]:
    """Everything in the archive but the binaries, and the token made from it."""
    text = DescriptionText(model.name, tool_name(), info, step_size, INTERFACES, version="3.0")
    unnamed = generated_sources3(model, "", options)
    guid = content_guid(_description(model, text, options, ("", "")), *(data for _, data in sorted(unnamed.items())))
    sources = generated_sources3(model, guid, options)
    files = sorted(name for name in sources if name.endswith(".c"))
    content = {
        "modelDescription.xml": _description(model, text, options, (guid, generation_time())).encode(),
        "documentation/index.html": documentation_page(model, build_interface(model, options), text).encode(),
        **model_resources(model, in_file=options.coefficients_in_file),
        "sources/buildDescription.xml": render("buildDescription.xml.j2", name=model.name, source_files=files).encode(),
        **licence_files(),
        "terminalsAndIcons/icon.png": info.picture or default_icon(),
        **licence_files3(),
        **{f"sources/{name}": data for name, data in sources.items()},
    }
    return content, guid


def _description(model: ReducedModel, text: DescriptionText, options: InterfaceOptions, stamp: tuple[str, str]) -> str:
    """The text of modelDescription.xml for a token and a date."""
    interface = build_interface(model, options)
    arrays = array_interface(model, interface, options)
    names = sorted({v.unit for v in interface.variables if v.unit is not None})
    return render(
        "modelDescription3.xml.j2",
        name=text.name,
        info=text.info,
        guid=stamp[0],
        date=stamp[1],
        tool=text.tool,
        step_size=repr(text.step_size),
        interfaces=text.interfaces,
        units=[unit_of(name) for name in names],
        unit_of=unit_of,
        arrays=arrays.arrays,
        time_reference=arrays.time_reference,
        structure=(
            ("Output", arrays.outputs),
            ("ContinuousStateDerivative", arrays.derivatives),
            ("InitialUnknown", arrays.initial_unknowns),
        ),
    )
