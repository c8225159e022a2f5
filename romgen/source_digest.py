"""The source text that a stage runs: results computed by other code are not taken for results of this one."""

from __future__ import annotations

import ast
import hashlib
from collections.abc import Iterator
from functools import cache
from importlib.util import find_spec
from pathlib import Path

PACKAGES = ("romgen", "fem", "fmu_templates")


def source_digest(module: str) -> str:
    """SHA-256 over the sources of a module and of all modules of this project that it imports, directly or not.

    Imports inside functions count; so do parts that are imported by name, ``f("fe_stages")`` or ``f("fem")``, and the
    data files of a package that is opened by name. Libraries are not followed: they stand in the provenance.
    """
    seen: dict[str, bytes] = {}
    waiting = [module]
    while waiting:
        name = waiting.pop()
        if name in seen or (source := _source(name)) is None:
            continue
        seen[name] = source
        waiting += _imports(name)
    digest = hashlib.sha256()
    for name in sorted(seen):
        digest.update(f"{name}\0{len(seen[name])}\0".encode() + seen[name])
    return digest.hexdigest()


@cache
def _source(name: str) -> bytes | None:
    """Source of a module (all files of a package of templates), None for a name that is no module of this project."""
    package, *inner = name.split(".")
    if package not in PACKAGES:
        return None
    if name == "fmu_templates":
        return b"\0".join(path.encode() + b"\0" + data for path, data in _files(_root(name), name))
    path = _root(package).joinpath(*inner)
    source = path / "__init__.py" if path.is_dir() else path.with_suffix(".py")
    return source.read_bytes() if source.is_file() else None


def _root(package: str) -> Path:
    """Folder of a package, which is not imported: its libraries may be missing."""
    spec = find_spec(package)
    assert spec is not None
    assert spec.submodule_search_locations is not None
    return Path(next(iter(spec.submodule_search_locations)))


@cache
def _imports(name: str) -> tuple[str, ...]:
    """Names that a module may import, its parents included; those that are no modules fall away later."""
    parts = name.split(".")
    found = [".".join(parts[:n]) for n in range(1, len(parts))]
    source = _source(name)
    tree = ast.parse(b"" if source is None or name == "fmu_templates" else source)
    for node in ast.walk(tree):
        if isinstance(node, ast.Import):
            found += [alias.name for alias in node.names]
        elif isinstance(node, ast.ImportFrom) and node.module is not None:
            found += [node.module, *(f"{node.module}.{alias.name}" for alias in node.names)]
        elif isinstance(node, ast.Call) and len(node.args) == 1 and isinstance(node.args[0], ast.Constant):
            text = node.args[0].value
            if isinstance(text, str) and text.isidentifier():
                found += [text, f"romgen.{text}"]
    return tuple(found)


def _files(folder: Path, path: str) -> Iterator[tuple[str, bytes]]:
    for entry in sorted(folder.iterdir(), key=lambda item: item.name):
        if entry.is_dir() and entry.name != "__pycache__":
            yield from _files(entry, f"{path}/{entry.name}")
        elif entry.is_file():
            yield f"{path}/{entry.name}", entry.read_bytes()
