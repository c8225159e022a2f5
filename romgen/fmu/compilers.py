"""Compilers of the runtime: the ziglang wheel for every platform, or the host's own compiler for this machine."""

from __future__ import annotations

import importlib.util
import os
import platform
import shutil
import struct
import subprocess
import sys
from dataclasses import dataclass
from pathlib import Path

from romgen.errors import InputError, RomgenError

TARGETS: dict[str, tuple[str, ...]] = {
    "linux64": ("x86_64-linux-gnu.2.17",),
    "win64": ("x86_64-windows-gnu",),
    "darwin64": ("x86_64-macos.11.0", "aarch64-macos.11.0"),
    "aarch64-linux": ("aarch64-linux-gnu.2.17",),
    "aarch64-darwin": ("aarch64-macos.11.0",),
}
"""Zig targets of each FMI platform; two targets make one universal file."""

FLAGS = ("-std=c99", "-Os", "-s", "-fPIC", "-shared", "-fvisibility=hidden", "-ffp-contract=off")
"""No contraction to fused multiply-add, so that processors agree to the rounding of the C library."""

FAST_FILES = ("rom_kernel.c", "rom_etdrk4.c")
"""Files in which steps spend their time are compiled for speed, the others for size."""

NO_UNWIND_TABLES = ("-fno-unwind-tables", "-fno-asynchronous-unwind-tables")
"""Nothing is thrown through the runtime; Windows keeps the tables, which its debuggers walk the stack by."""


WINDOWS_IMPORTS = ("_wfopen", "atan2", "calloc", "ceil", "cos", "exp", "fclose", "fread", "free", "memcpy", "memmove",
                   "memset", "sin", "sqrt", "strcmp", "strlen", "strncmp")  # fmt: skip
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

    The output name is written into Windows and macOS libraries, so it must be the final file name; paths are relative
    to the folder, so that the bytes do not depend on where it lies.

    Raises
    ------
    RomgenError : with the compiler's own words when it fails.
    """
    files = sorted(path.name for path in sources.glob("*.c"))
    if target and "windows" in target:
        _compile_for_windows(compiler, target, sources, output, files)
        return
    start = [*compiler.command, *(["-target", target] if target else []), *FLAGS, *NO_UNWIND_TABLES]
    fast = [name for name in files if name in FAST_FILES]
    objects = [f"{Path(name).stem}.o" for name in fast]
    for name, compiled in zip(fast, objects, strict=True):
        flags = [flag for flag in start if flag not in {"-shared", "-s"}]
        _run(compiler, target, [*flags, *_fast(name), "-c", name, "-o", compiled], sources)
    others = [name for name in files if name not in FAST_FILES]
    _run(compiler, target, [*start, "-o", str(output), *others, *objects, "-lm"], sources)
    for name in objects:
        (sources / name).unlink()


def _compile_for_windows(compiler: Compiler, target: str, sources: Path, output: Path, files: list[str]) -> None:
    """Link against msvcrt.dll alone: it is part of every Windows, and no C library has to be built first."""
    (sources / "msvcrt.def").write_text("\n".join(["LIBRARY msvcrt.dll", "EXPORTS", *WINDOWS_IMPORTS, ""]))
    (sources / "dll_entry.c").write_text(WINDOWS_ENTRY)
    compile_flags = ["-target", target, *(flag for flag in FLAGS if flag not in {"-shared", "-s"})]
    objects = [f"{Path(name).stem}.obj" for name in (*files, "dll_entry.c")]
    for name, compiled in zip((*files, "dll_entry.c"), objects, strict=True):
        _run(compiler, target, [*compiler.command, *compile_flags, *_fast(name), "-c", name, "-o", compiled], sources)
    tool = ["dlltool", "-m", "i386:x86-64", "-d", "msvcrt.def", "-l", "msvcrt.lib"]
    _run(compiler, target, [*compiler.command[:-1], *tool], sources)
    link = ["-target", target, "-shared", "-s", "-nostdlib", "-o", str(output), *objects, "msvcrt.lib"]
    _run(compiler, target, [*compiler.command, *link], sources)
    library = sources / output
    library.write_bytes(without_time(library.read_bytes()))
    for name in ("dll_entry.c", "msvcrt.def", "msvcrt.lib", *objects):
        (sources / name).unlink(missing_ok=True)


def _fast(name: str) -> list[str]:
    """The flag that replaces -Os, the last one counts."""
    return ["-O2"] if name in FAST_FILES else []


def without_time(library: bytes) -> bytes:
    """A Windows library whose header says 0 as time of linking, which the linker takes from the clock (PE format)."""
    (header,) = struct.unpack_from("<I", library, 0x3C)
    return library[: header + 8] + bytes(4) + library[header + 12 :]


def _run(compiler: Compiler, target: str | None, command: list[str], folder: Path) -> None:
    result = subprocess.run(command, cwd=folder, env=_environment(), capture_output=True, text=True, check=False)
    if result.returncode != 0:
        raise RomgenError(
            f"{compiler.name} could not compile the runtime",
            where=f"FMU export, target {target or 'host'}",
            value=result.stderr.strip()[-2000:],
            advice="check the compiler, or export with platforms = [] for a source-only unit",
        )


def cache_folder() -> Path:
    """Where zig keeps the C libraries it has built, once per user."""
    if platform.system() == "Windows":
        base = Path(os.environ.get("LOCALAPPDATA", str(Path.home() / "AppData" / "Local")))
    elif platform.system() == "Darwin":
        base = Path.home() / "Library" / "Caches"
    else:
        base = Path(os.environ.get("XDG_CACHE_HOME", str(Path.home() / ".cache")))
    return base / "romgen" / "zig"


def is_first_use(platform_name: str) -> bool:
    """Whether zig has still to build what a platform needs once."""
    return not _mark(platform_name).exists()


def remember_use(platform_name: str) -> None:
    """Note that this is done."""
    _mark(platform_name).parent.mkdir(parents=True, exist_ok=True)
    _mark(platform_name).touch()


def _mark(platform_name: str) -> Path:
    return cache_folder() / f"{platform_name}.ready"


def _environment() -> dict[str, str]:
    """The caller's environment, with zig's caches in the user's cache folder unless set already."""
    folder = cache_folder()
    defaults = {"ZIG_GLOBAL_CACHE_DIR": str(folder / "global"), "ZIG_LOCAL_CACHE_DIR": str(folder / "local")}
    return {**defaults, **os.environ}
