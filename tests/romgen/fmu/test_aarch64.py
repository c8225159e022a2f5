"""The library for aarch64, executed by QEMU where it and a C library are installed, against the one for x86-64."""

from __future__ import annotations

import importlib.util
import os
import shutil
import subprocess
import sys
import zipfile
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest

from romgen.fmu.compilers import cache_folder
from romgen.fmu.export import export_fmu
from romgen.settings import FmuSettings
from tests.romgen.fmu.models import random_model
from tests.romgen.fmu.test_windows import N_STEP, SOURCE, numbers

C_LIBRARY = Path("/usr/aarch64-linux-gnu")
"""Debian's package libc6-arm64-cross; QEMU comes with qemu-user."""


@pytest.mark.slow
def test_the_library_of_another_processor_computes_the_same_motion(run_cc: Callable[..., None], tmp_path: Path) -> None:
    """Linear input in each step; no multiplication is fused with an addition, so only the C libraries differ."""
    qemu = shutil.which("qemu-aarch64")
    if qemu is None or not C_LIBRARY.is_dir() or importlib.util.find_spec("ziglang") is None:
        pytest.skip("qemu-aarch64, libc6-arm64-cross or ziglang is not installed")
    export_fmu(random_model(7), tmp_path / "x.fmu", FmuSettings(platforms=("linux64", "aarch64-linux")))
    with zipfile.ZipFile(tmp_path / "x.fmu") as archive:
        archive.extractall(tmp_path)
    run_cc("-std=c99", "-O1", "-Isources", SOURCE, "-o", "here", "-ldl", "-lm", folder=tmp_path)
    caches = {"ZIG_GLOBAL_CACHE_DIR": str(cache_folder() / "global"), "ZIG_LOCAL_CACHE_DIR": str(tmp_path / "zig")}
    zig = [sys.executable, "-m", "ziglang", "cc", "-target", "aarch64-linux-gnu.2.17", "-std=c99", "-O1", "-Isources"]
    subprocess.run([*zig, str(SOURCE), "-o", "there", "-ldl", "-lm"], cwd=tmp_path, env=os.environ | caches, check=True)
    commands = (
        ["./here", "./binaries/linux64/random_panel.so", str(N_STEP)],
        [qemu, "-L", str(C_LIBRARY), "./there", "./binaries/aarch64-linux/random_panel.so", str(N_STEP)],
    )
    environment = os.environ | {"FMU_RESOURCES": (tmp_path / "resources").as_uri()}
    here, there = (
        numbers(subprocess.run(c, cwd=tmp_path, env=environment, capture_output=True, text=True, check=True).stdout)
        for c in commands
    )
    assert here.shape == (N_STEP, 4 + 6)
    assert np.max(np.abs(here - there) / np.max(np.abs(here), axis=0)) <= 1e-12
