"""python -m benchmarks.fmu: speed and size of exported units of a four-state model of order 7 with three sensors."""

from __future__ import annotations

import shutil
import subprocess
import sys
import tempfile
import time
import zipfile
from pathlib import Path

from romgen.fmu.compilers import host_platform
from romgen.fmu.driver import Slave, opened_slave
from romgen.fmu.export import export_fmu
from romgen.fmu.python_export import export_pythonfmu
from romgen.fmu.records import FmuExport
from romgen.settings import FmuSettings
from tests.romgen.fmu.models import random_model

H = 1e-4
N_NATIVE, N_PYTHON, N_C = 10_000, 1_000, 200_000
REPEATS = 5
TIMING = Path(__file__).with_name("fmu_timing.c")


def from_c(native: FmuExport) -> tuple[float, float, float] | None:
    """Microseconds of instantiate, step, and set + step + read, from plain C; None without a host compiler."""
    compiler = shutil.which("cc") or shutil.which("gcc")
    if compiler is None or host_platform() not in native.platforms:
        return None
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        with zipfile.ZipFile(native.path) as archive:
            archive.extractall(folder)
        program = folder / "timing"
        flags = ["-std=c99", "-O2", f"-I{folder / 'sources'}"]
        subprocess.run([compiler, *flags, str(TIMING), "-o", str(program), "-ldl"], check=True)
        library = next((folder / "binaries" / host_platform()).iterdir())
        command = [str(program), str(library), str(N_C), (folder / "resources").as_uri()]
        runs = [subprocess.run(command, capture_output=True, text=True, check=True).stdout for _ in range(REPEATS)]
    instantiate, step, whole = (min(column) for column in zip(*(map(float, run.split()) for run in runs), strict=True))
    return instantiate, step, whole


def through_fmpy(path: str, n: int) -> tuple[float, float]:
    """Microseconds of doStep alone and of set + doStep + get, driven by fmpy; the best of several runs."""
    with opened_slave(path) as slave:
        slave.fmu.setupExperiment(startTime=0.0)
        slave.fmu.setReal([slave.references.states[0]], [0.5])
        slave.fmu.enterInitializationMode()
        slave.fmu.exitInitializationMode()
        return min(_step_times(slave, n)[0] for _ in range(REPEATS)), min(
            _step_times(slave, n)[1] for _ in range(REPEATS)
        )


def _step_times(slave: Slave, n: int) -> tuple[float, float]:
    fmu, vr = slave.fmu, slave.references
    start = time.perf_counter()
    for k in range(n):
        fmu.doStep(k * H, H)
    middle = time.perf_counter()
    for k in range(n):
        fmu.setReal(vr.inputs, [1e-3 * (k % 2)])
        fmu.doStep(k * H, H)
        fmu.getReal(vr.displacement)
    return 1e6 * (middle - start) / n, 1e6 * (time.perf_counter() - middle) / n


def main() -> None:
    """Print the table; give platform names as arguments, default host."""
    model = random_model(order=7)
    settings = FmuSettings(platforms=tuple(sys.argv[1:]) or ("host",))
    with tempfile.TemporaryDirectory() as folder:
        export_fmu(model, Path(folder) / "warm.fmu", settings)
        start = time.perf_counter()
        native = export_fmu(model, Path(folder) / "native.fmu", settings)
        export_s = time.perf_counter() - start
        python = export_pythonfmu(model, Path(folder) / "python.fmu", settings)
        native_us, native_pass_us = through_fmpy(native.path, N_NATIVE)
        python_us, python_pass_us = through_fmpy(python.path, N_PYTHON)
        c_times = from_c(native)
    print(f"model: 4 states, order 7, 3 sensors, steps of {H} s; best of {REPEATS} runs")
    rows = [
        ("native, doStep through fmpy", native_us, "us"),
        ("native, set + doStep + get through fmpy", native_pass_us, "us"),
        ("pythonfmu, doStep through fmpy", python_us, "us"),
        ("pythonfmu, set + doStep + get through fmpy", python_pass_us, "us"),
        ("ratio of doStep through fmpy", python_us / native_us, ""),
        ("ratio of the whole pass through fmpy", python_pass_us / native_pass_us, ""),
        (f"size with {len(native.platforms)} platform(s) and sources", native.size_bytes / 1e3, "kB"),
        (f"export, compilers warm ({native.compiler})", export_s, "s"),
    ]
    if c_times is not None:
        names = ("native, instantiate + free from C", "native, doStep from C", "native, set + doStep + get from C")
        rows = [*((name, value, "us") for name, value in zip(names, c_times, strict=True)), *rows]
        rows.append(("ratio pythonfmu doStep through fmpy : native from C", python_us / c_times[1], ""))
    for name, value, unit in rows:
        print(f"{name:<56}{value:>12.3f} {unit}")


if __name__ == "__main__":
    main()
