"""The Windows library, executed by Wine where it is installed, against the Linux one."""

from __future__ import annotations

import importlib.util
import os
import shutil
import subprocess
import sys
import zipfile
from collections.abc import Callable
from pathlib import Path
from urllib.parse import quote

import numpy as np
import pytest

from romgen.fmu.compilers import cache_folder
from romgen.fmu.export import export_fmu
from romgen.settings import FmuSettings
from tests.romgen.fmu.models import random_model

N_STEP = 2000
SOURCE = Path(__file__).with_name("trajectory.c")


def numbers(text: str) -> np.ndarray:
    return np.array([[float.fromhex(word) for word in line.split()] for line in text.splitlines()])


@pytest.mark.slow
def test_the_windows_library_computes_the_same_motion(run_cc: Callable[..., None], tmp_path: Path) -> None:
    """Linear input in each step; only the C libraries differ (exp, sin, cos)."""
    wine = shutil.which("wine")
    if wine is None or importlib.util.find_spec("ziglang") is None:
        pytest.skip("wine or ziglang is not installed")
    export_fmu(random_model(7), tmp_path / "x.fmu", FmuSettings(platforms=("linux64", "win64")))
    folder = tmp_path / "a b ü"
    with zipfile.ZipFile(tmp_path / "x.fmu") as archive:
        archive.extractall(folder)
    run_cc("-std=c99", "-O1", "-Isources", SOURCE, "-o", "trajectory", "-ldl", "-lm", folder=folder)
    caches = {
        "ZIG_GLOBAL_CACHE_DIR": str(cache_folder() / "global"),
        "ZIG_LOCAL_CACHE_DIR": str(tmp_path / "zig"),
    }
    zig = [sys.executable, "-m", "ziglang", "cc", "-target", "x86_64-windows-gnu", "-O1", "-Isources"]
    subprocess.run([*zig, str(SOURCE), "-o", "t.exe"], cwd=folder, env={**os.environ, **caches}, check=True)
    steps = str(N_STEP)
    linux = ["./trajectory", "./binaries/linux64/random_panel.so", steps]
    windows = [wine, "t.exe", "binaries/win64/random_panel.dll", steps]
    quiet = {**os.environ, "WINEPREFIX": str(tmp_path / "wine"), "WINEDEBUG": "-all"}
    places = ((linux, (folder / "resources").as_uri()), (windows, f"file:///Z:{quote(str(folder))}/resources"))
    a, b = (
        numbers(
            subprocess.run(
                c, cwd=folder, env={**quiet, "FMU_RESOURCES": place}, capture_output=True, text=True, check=True
            ).stdout
        )
        for c, place in places
    )
    assert a.shape == (N_STEP, 4 + 6)
    assert np.max(np.abs(a - b) / np.max(np.abs(a), axis=0)) <= 1e-12
