"""The files of fmu_templates: C sources, headers, licences and text templates."""

from __future__ import annotations

from importlib.resources import files

import jinja2


def runtime_sources() -> dict[str, bytes]:
    """The hand-written C runtime and the FMI 2.0 headers by file name."""
    return _c_files("sources", "fmi2")


def runtime_sources3() -> dict[str, bytes]:
    """What FMI 3.0 needs besides: its functions on top of the runtime, and its headers."""
    return _c_files("sources3", "fmi3")


def _c_files(*folders: str) -> dict[str, bytes]:
    return {
        entry.name: entry.read_bytes()
        for folder in folders
        for entry in sorted((files("fmu_templates") / folder).iterdir(), key=lambda e: e.name)
        if entry.name.endswith((".c", ".h"))
    }


def licence_files() -> dict[str, bytes]:
    """Licence texts by their path in the archive."""
    root = files("fmu_templates")
    return {
        "documentation/licenses/license.txt": (root / "license.txt").read_bytes(),
        "documentation/licenses/fmi_headers.txt": (root / "fmi2" / "LICENSE.txt").read_bytes(),
    }


def licence_files3() -> dict[str, bytes]:
    """The licence of the FMI 3.0 headers by its path in the archive."""
    return {"documentation/licenses/fmi3_headers.txt": (files("fmu_templates") / "fmi3" / "LICENSE.txt").read_bytes()}


def default_icon() -> bytes:
    """The picture of a unit that is given none: a motion spiralling down on a bowl, PNG."""
    return (files("fmu_templates") / "icon.png").read_bytes()


def template_text(name: str) -> str:
    """The text of one template file."""
    return (files("fmu_templates") / name).read_text(encoding="utf-8")


def render(template: str, **values: object) -> str:
    """Fill a jinja2 template, with XML and HTML characters escaped; an unknown name is an error."""
    environment = jinja2.Environment(
        autoescape=True, undefined=jinja2.StrictUndefined, keep_trailing_newline=True, lstrip_blocks=True
    )
    return environment.from_string(template_text(template)).render(values)
