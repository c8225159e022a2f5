"""Compilers, platforms, and what is said when one is missing."""

from __future__ import annotations

import ctypes
import importlib.util
import struct
import subprocess
import sys
import time
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest

from romgen.errors import InputError, RomgenError
from romgen.fmu import build, compilers
from romgen.fmu.build import build_binaries, universal_binary
from romgen.fmu.compilers import TARGETS, Compiler, compile_library, host_platform, requested_platforms
from romgen.fmu.export import export_fmu, generated_sources
from romgen.polynomial import PolynomialMap
from romgen.reduced_model import ReducedModel
from romgen.settings import FmuSettings
from tests.romgen.fmu.conftest import STRICT
from tests.romgen.fmu.models import random_model


def silent(fraction: float, text: str) -> None:
    """Ignore progress."""


def linear_free_model() -> ReducedModel:
    """No nonlinear terms and no inputs: every size that may be zero is zero."""
    model = random_model(1, n_input=0)
    nothing = PolynomialMap(np.zeros((0, 4), dtype=np.int64), np.zeros((2, 0), dtype=np.complex128))
    return ReducedModel(**{**model.__dict__, "normal_form": nothing})


def write_sources(model: ReducedModel, folder: Path) -> Path:
    for name, content in generated_sources(model, "{guid}").items():
        (folder / name).write_bytes(content)
    return folder


@pytest.mark.parametrize("make", [lambda: random_model(7, 2), linear_free_model])
def test_strict_c99_without_warnings(
    make: Callable[[], ReducedModel], run_cc: Callable[..., None], tmp_path: Path
) -> None:
    folder = write_sources(make(), tmp_path)
    files = sorted(p.name for p in folder.glob("*.c"))
    run_cc(*STRICT, "-O2", "-fPIC", "-shared", "-fvisibility=hidden", "-o", "x.so", *files, "-lm", folder=folder)
    assert ctypes.CDLL(str(folder / "x.so")).fmi2GetVersion


def test_strict_c99_without_warnings_in_zig(tmp_path: Path) -> None:
    if importlib.util.find_spec("ziglang") is None:
        pytest.skip("ziglang is not installed")
    folder = write_sources(linear_free_model(), tmp_path)
    zig = Compiler("zig", (sys.executable, "-m", "ziglang", "cc", *STRICT[1:]), True)
    compile_library(zig, TARGETS["linux64"][0], folder, Path("build") / "x.so")


def test_exactly_the_44_functions_are_exported(run_cc: Callable[..., None], tmp_path: Path) -> None:
    folder = write_sources(random_model(3), tmp_path)
    files = sorted(p.name for p in folder.glob("*.c"))
    run_cc("-std=c99", "-fPIC", "-shared", "-fvisibility=hidden", "-o", "x.so", *files, "-lm", folder=folder)
    table = subprocess.run(
        ["nm", "-D", "--defined-only", "x.so"], cwd=folder, capture_output=True, text=True, check=True
    )
    names = [line.split()[-1] for line in table.stdout.splitlines()]
    assert len(names) == 44
    assert all(name.startswith("fmi2") for name in names)


def test_no_console_output_globals_or_memory_in_steps() -> None:
    """Words that must not occur in the runtime; calloc and files only where instances and snapshots are made."""
    sources = {k: v.decode() for k, v in generated_sources(random_model(2), "").items() if not k.startswith("fmi2T")}
    runtime = {k: v for k, v in sources.items() if k.startswith(("rom_", "fmi2_"))}
    for word in ("printf(", "setlocale", "malloc(", "realloc("):
        assert not [name for name, text in runtime.items() if word in text]
    assert [name for name, text in runtime.items() if "stdio" in text] == ["rom_tables.c"]
    assert {name for name, text in runtime.items() if "calloc(" in text} == {"fmi2_common.c", "rom_state.c"}
    assert max(text.count("\n") for text in runtime.values()) < 450


def test_two_units_link_into_one_program(run_cc: Callable[..., None], tmp_path: Path) -> None:
    """Static linking with FMI2_FUNCTION_PREFIX: internal names must not collide."""
    objects = []
    for name in ("first", "second"):
        folder = tmp_path / name
        folder.mkdir()
        write_sources(random_model(2, name=name), folder)
        files = sorted(p.name for p in folder.glob("*.c"))
        run_cc("-std=c99", "-c", "-fPIC", f"-DFMI2_FUNCTION_PREFIX={name}_", *files, folder=folder)
        objects += [folder / file.replace(".c", ".o") for file in files]
    run_cc("-shared", "-o", "both.so", *objects, "-lm", folder=tmp_path)
    both = ctypes.CDLL(str(tmp_path / "both.so"))
    assert both.first_fmi2DoStep
    assert both.second_fmi2DoStep


def test_platform_names_are_resolved_and_checked() -> None:
    assert requested_platforms(("all",)) == tuple(TARGETS)
    assert requested_platforms(("host",)) == (host_platform(),)
    assert requested_platforms(("win64", "linux64")) == ("linux64", "win64")
    with pytest.raises(InputError, match="win65"):
        requested_platforms(("win65",))


def test_without_zig_the_host_compiler_builds_this_machine_only(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(compilers.importlib.util, "find_spec", lambda name: None)
    compiler = compilers.find_compiler()
    if compiler is None:
        pytest.skip("no host C compiler on the path")
    binaries = build_binaries("m", generated_sources(random_model(2, name="m"), "{g}"), ("all",), silent)
    assert binaries.platforms == (host_platform(),)
    assert binaries.compiler == compiler.name
    assert "no binary for" in binaries.notes[0]
    assert "romgen[cross]" in binaries.notes[0]


def test_without_any_compiler_the_unit_is_source_only_and_says_so(
    monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    monkeypatch.setattr(build, "find_compiler", lambda: None)
    export = export_fmu(random_model(2), tmp_path / "x.fmu", FmuSettings())
    assert (export.platforms, export.compiler) == ((), "none")
    assert "source-only" in export.notes[0]


def test_a_failing_compiler_is_reported_in_its_own_words(tmp_path: Path) -> None:
    (tmp_path / "bad.c").write_text("int x = ;\n")
    compiler = compilers.find_compiler()
    if compiler is None:
        pytest.skip("no C compiler")
    with pytest.raises(RomgenError, match="expected expression"):
        compile_library(compiler, None, tmp_path, Path("build") / "x.so")


def test_universal_file_holds_both_slices_on_page_boundaries() -> None:
    slices = [struct.pack("<III", 0xFEEDFACF, cpu, 3) + bytes([fill]) * size for cpu, fill, size in
              ((0x01000007, 1, 5000), (0x0100000C, 2, 40000))]  # fmt: skip
    fat = universal_binary(slices)
    magic, count = struct.unpack(">II", fat[:8])
    assert (magic, count) == (0xCAFEBABE, 2)
    for k, content in enumerate(slices):
        cpu, _, offset, size, align = struct.unpack(">IIIII", fat[8 + 20 * k : 28 + 20 * k])
        assert cpu == struct.unpack("<I", content[4:8])[0]
        assert offset % 2**align == 0
        assert fat[offset : offset + size] == content


def test_windows_libraries_carry_no_time_of_linking() -> None:
    """Signature PE, machine, sections, then the time, at the offset that 0x3C names."""
    library = bytes(0x3C) + struct.pack("<I", 0x80) + bytes(0x40) + b"PE\0\0" + b"abcd" + b"TIME" + b"rest"
    cleaned = compilers.without_time(library)
    assert cleaned[0x80:] == b"PE\0\0abcd\0\0\0\0rest"
    assert cleaned[:0x80] == library[:0x80]


def test_a_cache_folder_that_cannot_be_made_is_replaced(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    """Homes of services and containers are often not writable."""
    if host_platform() not in {"linux64", "aarch64-linux"}:
        pytest.skip("the variable is that of Linux")
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path))
    assert compilers.cache_folder() == tmp_path / "romgen" / "zig"
    (tmp_path / "file").write_text("")
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path / "file"))
    monkeypatch.setattr(compilers.tempfile, "gettempdir", lambda: str(tmp_path / "temporary"))
    assert compilers.cache_folder() == tmp_path / "temporary" / "romgen" / "zig"
    compilers.remember_use("linux64")
    assert not compilers.is_first_use("linux64")


@pytest.mark.slow
def test_all_platforms_from_one_machine(tmp_path: Path) -> None:
    """Five platforms, twice: the same bytes."""
    if importlib.util.find_spec("ziglang") is None:
        pytest.skip("ziglang is not installed")
    one = export_fmu(random_model(5), tmp_path / "a" / "x.fmu", FmuSettings(platforms=("all",)))
    time.sleep(1.1)  # a linker that writes the clock into its file is found out
    two = export_fmu(random_model(5), tmp_path / "b" / "x.fmu", FmuSettings(platforms=("all",)))
    assert one.platforms == tuple(TARGETS)
    assert one.sha256 == two.sha256
