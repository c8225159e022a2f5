"""A C program without Python goes through the whole interface, plain and under the sanitizers."""

from __future__ import annotations

import shutil
import subprocess
from collections.abc import Callable
from pathlib import Path

import pytest

from romgen.fmu.compilers import host_platform
from romgen.fmu.records import FmuExport

HARNESS = Path(__file__).with_name("harness.c")
C_FLAGS = ("-std=c99", "-D_GNU_SOURCE", "-g")
SANITIZERS = ("-fsanitize=address,undefined", "-fno-sanitize-recover=all")


def build_harness(run_cc: Callable[..., None], unpacked: Path, folder: Path, *flags: str) -> Path:
    run_cc(*C_FLAGS, *flags, f"-I{unpacked / 'sources'}", HARNESS, "-o", "harness", "-ldl", "-lm", folder=folder)
    return folder / "harness"


def library(native: FmuExport, unpacked: Path) -> Path:
    if host_platform() not in native.platforms:
        pytest.skip("no compiler built a binary for this machine")
    return next((unpacked / "binaries" / host_platform()).iterdir())


def run(*command: object) -> None:
    result = subprocess.run([*map(str, command)], capture_output=True, text=True, check=False, timeout=120)
    assert result.returncode == 0, result.stderr
    assert result.stdout == "ok\n"


def test_the_exported_library(native: FmuExport, unpacked: Path, run_cc: Callable[..., None], tmp_path: Path) -> None:
    run(build_harness(run_cc, unpacked, tmp_path), library(native, unpacked))


def test_under_valgrind(native: FmuExport, unpacked: Path, run_cc: Callable[..., None], tmp_path: Path) -> None:
    if shutil.which("valgrind") is None:
        pytest.skip("valgrind is not installed")
    harness = build_harness(run_cc, unpacked, tmp_path)
    run("valgrind", "-q", "--leak-check=full", "--error-exitcode=3", harness, library(native, unpacked))


def test_under_address_and_undefined_behaviour_sanitizers(
    unpacked: Path, run_cc: Callable[..., None], tmp_path: Path
) -> None:
    (tmp_path / "probe.c").write_text("int main(void) { return 0; }\n")
    try:
        run_cc(*SANITIZERS, "probe.c", "-o", "probe", folder=tmp_path)
    except AssertionError:
        pytest.skip("the host compiler has no sanitizers")
    files = sorted((unpacked / "sources").glob("*.c"))
    run_cc(*C_FLAGS, *SANITIZERS, "-fPIC", "-shared", "-o", "lib.so", *files, "-lm", folder=tmp_path)
    run(build_harness(run_cc, unpacked, tmp_path, *SANITIZERS), tmp_path / "lib.so")
