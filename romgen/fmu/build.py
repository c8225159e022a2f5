"""Binaries of one unit for the platforms that were asked for."""

from __future__ import annotations

import os
import struct
import tempfile
from collections.abc import Mapping
from concurrent.futures import ThreadPoolExecutor, as_completed
from dataclasses import dataclass
from pathlib import Path

from romgen.fmu.compilers import (
    TARGETS,
    Compiler,
    compile_library,
    find_compiler,
    host_platform,
    is_first_use,
    remember_use,
    requested_platforms,
)
from romgen.progress import Report

EXTENSIONS = {"win64": ".dll", "darwin64": ".dylib", "aarch64-darwin": ".dylib"}

FAT_MAGIC = 0xCAFEBABE
FAT_ALIGNMENT = 14
"""Slices of a universal macOS file start at multiples of 2^14 bytes, the page size of Apple's processors."""


@dataclass(frozen=True)
class Binaries:
    """Compiled libraries by archive path, and what could not be compiled.

    Attributes
    ----------
    files : content by path in the archive, e.g. binaries/linux64/model.so.
    platforms : platforms that have one.
    compiler : its name, or "none".
    notes : one sentence for each wish that was not met.
    """

    files: dict[str, bytes]
    platforms: tuple[str, ...]
    compiler: str
    notes: tuple[str, ...]


def build_binaries(
    identifier: str, sources: Mapping[str, bytes], platforms: tuple[str, ...], report: Report
) -> Binaries:
    """Compile the sources of one unit for each platform.

    With the ziglang wheel every platform is built from any machine; with the host compiler only this machine's own;
    without any compiler none, and the unit holds sources only. What is left out is said in ``notes``.

    Parameters
    ----------
    identifier : model identifier, the stem of each library.
    sources : content by file name.
    platforms : names of TARGETS, "host" or "all"; () for a source-only unit.
    report : told the finished fraction and the platform in work.
    """
    wanted = requested_platforms(platforms)
    compiler = find_compiler()
    if compiler is None or not wanted:
        reason = "no compiler was found" if wanted else "no platform was asked for"
        advice = "; install romgen[cross] or a C compiler" if wanted else ""
        return Binaries({}, (), "none", (f"source-only unit: {reason}{advice}",))
    possible = wanted if compiler.is_zig else tuple(p for p in wanted if p == host_platform())
    left_out = tuple(p for p in wanted if p not in possible)
    notes = (f"no binary for {', '.join(left_out)}: {compiler.name} serves only this machine; install romgen[cross]",)
    files = {}
    with tempfile.TemporaryDirectory(prefix="romgen_fmu_") as folder:
        for name, content in sources.items():
            (Path(folder) / name).write_bytes(content)
        slices = _slices(compiler, identifier, possible, Path(folder), report)
    for name in possible:
        parts = [slices[target] for target in _targets(compiler, name)]
        library = parts[0] if len(parts) == 1 else universal_binary(parts)
        files[f"binaries/{name}/{_library(identifier, name)}"] = library
    report(1.0, "binaries built")
    return Binaries(files, possible, compiler.name if files else "none", notes if left_out else ())


def _targets(compiler: Compiler, name: str) -> tuple[str | None, ...]:
    return TARGETS[name] if compiler.is_zig else (None,)


def _library(identifier: str, name: str) -> str:
    return f"{identifier}{EXTENSIONS.get(name, '.so')}"


def _slices(
    compiler: Compiler, identifier: str, platforms: tuple[str, ...], folder: Path, report: Report
) -> dict[str | None, bytes]:
    """The library of every target, each compiled once, as many at a time as there are processors."""
    outputs = {
        target: Path(target or "host") / _library(identifier, name)
        for name in platforms
        for target in _targets(compiler, name)
    }
    first = [name for name in platforms if compiler.is_zig and is_first_use(name)]
    text = f"compiling {', '.join(platforms)}"
    text += f"; zig prepares {', '.join(first)} once, some seconds" if first else ""
    report(0.0, text)
    with ThreadPoolExecutor(os.cpu_count()) as pool:
        jobs = {
            pool.submit(compile_library, compiler, target, folder, output): output for target, output in outputs.items()
        }
        for k, job in enumerate(as_completed(jobs), 1):
            job.result()
            report(k / len(jobs), text)
    for name in platforms if compiler.is_zig else ():
        remember_use(name)
    return {target: (folder / output).read_bytes() for target, output in outputs.items()}


def universal_binary(slices: list[bytes]) -> bytes:
    """Join 64-bit Mach-O libraries into one file (fat header, big-endian; Apple, mach-o/fat.h)."""
    header = struct.pack(">II", FAT_MAGIC, len(slices))
    offset, body = 0, b""
    step = 1 << FAT_ALIGNMENT
    table_end = len(header) + 20 * len(slices)
    for content in slices:
        cpu_type, cpu_subtype = struct.unpack("<II", content[4:12])
        offset = -(-(table_end + len(body)) // step) * step
        header += struct.pack(">IIIII", cpu_type, cpu_subtype, offset, len(content), FAT_ALIGNMENT)
        body += b"\0" * (offset - table_end - len(body)) + content
    return header + body
