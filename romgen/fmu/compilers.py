"""Compilers of the runtime: the ziglang wheel for every platform, or the host's own compiler for this machine."""

from __future__ import annotations

import importlib.util
import os
import platform
import shutil
import struct
import subprocess
import sys
import tempfile
from dataclasses import dataclass
from pathlib import Path, PurePosixPath

from romgen.errors import InputError, RomgenError

TARGETS: dict[str, tuple[str, ...]] = {
    "linux64": ("x86_64-linux-gnu.2.17",),
    "win64": ("x86_64-windows-gnu",),
    "darwin64": ("x86_64-macos.11.0", "aarch64-macos.11.0"),
    "aarch64-linux": ("aarch64-linux-gnu.2.17",),
    "aarch64-darwin": ("aarch64-macos.11.0",),
}
"""Zig targets of each FMI platform; two targets make one universal file."""

COMPILE = ("-std=c99", "-fPIC", "-fvisibility=hidden", "-ffp-contract=off", "-fomit-frame-pointer")
"""No contraction to fused multiply-add, so that processors agree to the rounding of the C library."""

LINK = ("-s", "-shared")

FAST_FILES = ("rom_etdrk4.c", "rom_kernel.c", "rom_rows.c")
"""Files in which steps spend their time are compiled for speed, the others for size."""

NO_UNWIND_TABLES = ("-fno-unwind-tables", "-fno-asynchronous-unwind-tables")
"""Nothing is thrown through the runtime; Windows keeps the tables, which its debuggers walk the stack by."""


WINDOWS_IMPORTS = ("_wfopen", "atan2", "calloc", "ceil", "cos", "exp", "fclose", "fopen", "fread", "free", "memcpy",
                   "memmove", "memset", "sin", "sqrt", "strcmp", "strlen", "strncmp")  # fmt: skip
"""Functions of the Windows C library that the runtime calls."""

WINDOWS_ENTRY = """int _fltused = 1; /* asked for by compilers where floating-point numbers are used */
int __stdcall DllMainCRTStartup(void *instance, unsigned long reason, void *reserved)
{
    (void)instance, (void)reason, (void)reserved;
    return 1; /* the runtime has nothing to set up */
}
"""


@dataclass(frozen=True)
class Compiler:
    """One way to turn C sources into a shared library.

    Attributes
    ----------
    name : shown in the export record.
    command : program and leading arguments.
    is_zig : whether it takes a target and serves every platform.
    """

    name: str
    command: tuple[str, ...]
    is_zig: bool


def host_platform() -> str:
    """FMI platform of this machine, e.g. "linux64"."""
    arm = platform.machine().lower() in {"aarch64", "arm64"}
    names = {"Linux": "aarch64-linux" if arm else "linux64", "Windows": "win64", "Darwin": "darwin64"}
    if platform.system() not in names:
        raise InputError("no FMI platform is known for this system", where="FMU export", value=platform.system())
    return names[platform.system()]


def requested_platforms(platforms: tuple[str, ...]) -> tuple[str, ...]:
    """Names in the order of TARGETS, with "host" and "all" resolved.

    Raises
    ------
    InputError : for a platform that is not in TARGETS.
    """
    unknown = [p for p in platforms if p not in {*TARGETS, "host", "all"}]
    if unknown:
        raise InputError(
            "unknown platform",
            where="[fmu] platforms",
            value=unknown[0],
            advice=f"use host, all or {', '.join(TARGETS)}",
        )
    wanted = {host_platform() if p == "host" else p for p in platforms}
    return tuple(TARGETS) if "all" in wanted else tuple(p for p in TARGETS if p in wanted)


def find_compiler() -> Compiler | None:
    """The ziglang wheel if installed, else the compiler in CC or on the path, else None."""
    if importlib.util.find_spec("ziglang") is not None:
        return Compiler("zig", (sys.executable, "-m", "ziglang", "cc"), True)
    for name in (os.environ.get("CC", ""), "cc", "gcc", "clang"):
        program = shutil.which(name) if name else None
        if program:
            return Compiler(Path(program).name, (program,), False)
    return None


def compile_library(compiler: Compiler, target: str | None, sources: Path, output: Path) -> None:
    """Compile all C files of a folder into the shared library ``output``.

    They are compiled as two translation units, which include the files, one for speed and one for size: starting a
    compiler for every file would take most of the time. The output name is written into Windows and macOS libraries,
    so it must be the final file name; paths are relative to the folder, so that the bytes do not depend on where it
    lies. Several targets may be compiled at once, each in the folder of its output.

    Parameters
    ----------
    compiler, target : of ``find_compiler`` and TARGETS; None for this machine.
    sources : the folder.
    output : path in that folder, in a folder of its own below it.

    Raises
    ------
    RomgenError : with the compiler's own words when it fails.
    """
    build = output.parent
    (sources / build).mkdir(parents=True, exist_ok=True)
    files = sorted(path.name for path in sources.glob("*.c"))
    fast = _unit(sources, build / "fast.c", [name for name in files if name in FAST_FILES])
    rest = _unit(sources, build / "rest.c", [name for name in files if name not in FAST_FILES])
    windows = target is not None and "windows" in target
    compile_flags = (*(("-target", target) if target else ()), *COMPILE, *(() if windows else NO_UNWIND_TABLES))

    def compiled(unit: str, level: str) -> str:
        made = str(PurePosixPath(unit).with_suffix(".o"))
        _run(compiler, target, [*compiler.command, *compile_flags, level, "-c", unit, "-o", made], sources)
        return made

    parts = [compiled(fast, "-O2"), *(_windows_parts(compiler, target, sources, build) if windows else ("-lm",))]
    # zig hides the C library's headers where -nostdlib is given, so that on Windows all is compiled before it is linked
    parts.insert(0, compiled(rest, "-Os") if windows else rest)
    link = [*compiler.command, *compile_flags, "-Os", *LINK, "-o", output.as_posix(), *parts]
    _run(compiler, target, link, sources)
    if windows:
        (sources / output).write_bytes(without_time((sources / output).read_bytes()))


def _unit(sources: Path, unit: Path, files: list[str]) -> str:
    """Write one C file that includes others of the folder above its own; its path as the compiler is given it."""
    up = "/".join(".." for _ in unit.parent.parts)
    (sources / unit).write_text("".join(f'#include "{up}/{name}"\n' for name in files), encoding="ascii")
    return unit.as_posix()


def _windows_parts(compiler: Compiler, target: str | None, sources: Path, build: Path) -> list[str]:
    """Arguments of the linker for msvcrt.dll alone: it is part of every Windows, no C library has to be built."""
    definition, imports, entry = ((build / name).as_posix() for name in ("msvcrt.def", "msvcrt.lib", "dll_entry.c"))
    (sources / definition).write_text("\n".join(["LIBRARY msvcrt.dll", "EXPORTS", *WINDOWS_IMPORTS, ""]))
    (sources / entry).write_text(WINDOWS_ENTRY)
    tool = ["dlltool", "-m", "i386:x86-64", "-d", definition, "-l", imports]
    _run(compiler, target, [*compiler.command[:-1], *tool], sources)
    return ["-nostdlib", entry, imports]


def without_time(library: bytes) -> bytes:
    """A Windows library whose header says 0 as time of linking, which the linker takes from the clock (PE format)."""
    (header,) = struct.unpack_from("<I", library, 0x3C)
    return library[: header + 8] + bytes(4) + library[header + 12 :]


def _run(compiler: Compiler, target: str | None, command: list[str], folder: Path) -> None:
    result = subprocess.run(command, cwd=folder, env=_environment(folder), capture_output=True, text=True, check=False)
    if result.returncode != 0:
        raise RomgenError(
            f"{compiler.name} could not compile the runtime",
            where=f"FMU export, target {target or 'host'}",
            value=result.stderr.strip()[-2000:],
            advice="check the compiler, or export with platforms = [] for a source-only unit",
        )


def cache_folder() -> Path:
    """Where zig keeps the C libraries it has built, once per user; a temporary folder where that is not writable."""
    if platform.system() == "Windows":
        base = Path(os.environ.get("LOCALAPPDATA", str(Path.home() / "AppData" / "Local")))
    elif platform.system() == "Darwin":
        base = Path.home() / "Library" / "Caches"
    else:
        base = Path(os.environ.get("XDG_CACHE_HOME", str(Path.home() / ".cache")))
    folder = base / "romgen" / "zig"
    try:
        folder.mkdir(parents=True, exist_ok=True)
        writable = os.access(folder, os.W_OK)
    except OSError:
        writable = False
    return folder if writable else Path(tempfile.gettempdir()) / "romgen" / "zig"


def is_first_use(platform_name: str) -> bool:
    """Whether zig has still to build what a platform needs once."""
    return not _mark(platform_name).exists()


def remember_use(platform_name: str) -> None:
    """Note that this is done."""
    _mark(platform_name).parent.mkdir(parents=True, exist_ok=True)
    _mark(platform_name).touch()


def _mark(platform_name: str) -> Path:
    return cache_folder() / f"{platform_name}.ready"


def _environment(folder: Path) -> dict[str, str]:
    """The caller's environment, with zig's caches set unless they are: C libraries are kept, objects are not."""
    defaults = {"ZIG_GLOBAL_CACHE_DIR": str(cache_folder() / "global"), "ZIG_LOCAL_CACHE_DIR": str(folder / "zig")}
    return {**defaults, **os.environ}
