"""A C program without Python goes through the whole interface, plain and under the sanitizers."""

from __future__ import annotations

import shutil
import subprocess
from collections.abc import Callable
from pathlib import Path

import pytest

from romgen.fmu.compilers import host_platform
from romgen.fmu.records import FmuExport

HERE = Path(__file__).parent
C_FLAGS = ("-std=c99", "-D_GNU_SOURCE", "-g")
SANITIZERS = ("-fsanitize=address,undefined", "-fno-sanitize-recover=all")


def build_program(
    run_cc: Callable[..., None], name: str, unpacked: Path, folder: Path, flags: tuple[str, ...] = ()
) -> Path:
    source = HERE / f"{name}.c"
    run_cc(*C_FLAGS, *flags, f"-I{unpacked / 'sources'}", source, "-o", name, "-ldl", "-lm", folder=folder)
    return folder / name


def library(native: FmuExport, unpacked: Path) -> Path:
    if host_platform() not in native.platforms:
        pytest.skip("no compiler built a binary for this machine")
    return next((unpacked / "binaries" / host_platform()).iterdir())


def run(*command: object) -> None:
    result = subprocess.run([*map(str, command)], capture_output=True, text=True, check=False, timeout=120)
    assert result.returncode == 0, result.stderr
    assert result.stdout == "ok\n"


def test_the_exported_library(native: FmuExport, unpacked: Path, run_cc: Callable[..., None], tmp_path: Path) -> None:
    run(build_program(run_cc, "harness", unpacked, tmp_path), library(native, unpacked))


def test_under_valgrind(native: FmuExport, unpacked: Path, run_cc: Callable[..., None], tmp_path: Path) -> None:
    if shutil.which("valgrind") is None:
        pytest.skip("valgrind is not installed")
    harness = build_program(run_cc, "harness", unpacked, tmp_path)
    run("valgrind", "-q", "--leak-check=full", "--error-exitcode=3", harness, library(native, unpacked))


@pytest.fixture
def sanitized(unpacked: Path, run_cc: Callable[..., None], tmp_path: Path) -> Path:
    """The library from the unit's own sources with address and undefined-behaviour sanitizers, or a skip."""
    (tmp_path / "probe.c").write_text("int main(void) { return 0; }\n")
    try:
        run_cc(*SANITIZERS, "probe.c", "-o", "probe", folder=tmp_path)
    except AssertionError:
        pytest.skip("the host compiler has no sanitizers")
    files = sorted((unpacked / "sources").glob("*.c"))
    run_cc(*C_FLAGS, *SANITIZERS, "-fPIC", "-shared", "-o", "lib.so", *files, "-lm", folder=tmp_path)
    return tmp_path / "lib.so"


def test_the_whole_interface_under_sanitizers(
    sanitized: Path, unpacked: Path, run_cc: Callable[..., None], tmp_path: Path
) -> None:
    run(build_program(run_cc, "harness", unpacked, tmp_path, SANITIZERS), sanitized)


@pytest.mark.parametrize("n_sequence", [10_000, pytest.param(100_000, marks=pytest.mark.slow)])
def test_random_call_sequences_under_sanitizers(
    n_sequence: int, sanitized: Path, unpacked: Path, run_cc: Callable[..., None], tmp_path: Path
) -> None:
    run(build_program(run_cc, "fuzz", unpacked, tmp_path, SANITIZERS), sanitized, n_sequence, 20261122)
