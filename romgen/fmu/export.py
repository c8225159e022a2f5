"""Export of a reduced model as a native FMI 2.0 unit."""

from __future__ import annotations

from pathlib import Path

from romgen.fmu.archive import write_archive
from romgen.fmu.build import build_binaries
from romgen.fmu.coefficients import coefficients_header, sizes_header, tables_header
from romgen.fmu.description import (
    NATIVE_INTERFACES,
    DescriptionText,
    content_guid,
    documentation_page,
    generation_time,
    model_description,
    tool_name,
)
from romgen.fmu.factored import factored_model
from romgen.fmu.interface import build_interface
from romgen.fmu.model_file import model_resources
from romgen.fmu.records import PLAIN, FmuExport, FmuInfo, InterfaceOptions
from romgen.fmu.selection import exported_model, interface_options
from romgen.fmu.tables import table_bytes
from romgen.fmu.templates import default_icon, licence_files, runtime_sources
from romgen.progress import Report
from romgen.reduced_model import ReducedModel
from romgen.settings import FmuSettings


def silent(fraction: float, text: str) -> None:
    """Report nothing."""


def export_fmu(
    model: ReducedModel,
    path: Path | str,
    settings: FmuSettings,
    *,
    info: FmuInfo | None = None,
    report: Report = silent,
) -> FmuExport:
    """Write a model as one archive for FMI 2.0 Co-Simulation and Model Exchange.

    The same model, settings, information and compiler give the same bytes in any folder and at any time.

    Parameters
    ----------
    model : the reduced model.
    path : file to write.
    settings : sensors, platforms and step size.
    info : texts of the description and the documentation.
    report : told the finished fraction while compilers run.

    Raises
    ------
    InputError : for a model or settings that cannot be exported.
    RomgenError : when a compiler fails.
    """
    info = info or FmuInfo()
    chosen, options = exported_model(model, settings.sensors), interface_options(model, settings, info)
    content, guid = _content(chosen, settings.step_size, info, options)
    sources = {Path(name).name: data for name, data in content.items() if name.startswith("sources/")}
    binaries = build_binaries(chosen.name, sources, settings.platforms, report)
    size, sha256 = write_archive(Path(path), {**content, **binaries.files})
    return FmuExport(str(path), size, sha256, guid, binaries.platforms, binaries.compiler, binaries.notes)


def generated_sources(model: ReducedModel, guid: str, options: InterfaceOptions = PLAIN) -> dict[str, bytes]:
    """All C files of a unit by name: the runtime, the FMI headers and the generated headers."""
    factored = factored_model(model)
    coefficients, table = coefficients_header(model, factored, options), table_bytes(factored)
    sizes = sizes_header(model, factored, guid, (coefficients, table), options)
    generated = {"coefficients.h": coefficients, "model_sizes.h": sizes}
    if not options.coefficients_in_file:
        generated["tables.h"] = tables_header(table)
    return {**runtime_sources(), **{name: text.encode() for name, text in generated.items()}}


def _content(
    model: ReducedModel, step_size: float, info: FmuInfo, options: InterfaceOptions
) -> tuple[dict[str, bytes], str]:
    """Everything in the archive but the binaries, and the identifier made from it."""
    interface = build_interface(model, options)
    source_files = tuple(sorted(name for name in runtime_sources() if name.endswith(".c")))
    text = DescriptionText(model.name, tool_name(), info, step_size, NATIVE_INTERFACES, source_files)
    unnamed = generated_sources(model, "", options)
    undated = model_description(text, interface, guid="", date="")
    guid = content_guid(undated, *(data for _, data in sorted(unnamed.items())))
    description = model_description(text, interface, guid=guid, date=generation_time())
    content = {
        "modelDescription.xml": description.encode(),
        "documentation/index.html": documentation_page(model, interface, text).encode(),
        **model_resources(model, in_file=options.coefficients_in_file),
        **licence_files(),
        "model.png": info.picture or default_icon(),
        **{f"sources/{name}": data for name, data in generated_sources(model, guid, options).items()},
    }
    return content, guid
