"""python -m benchmarks.fmu: speed and size of exported units of a four-state model of order 7 with three sensors.

Sensor maps are of order 7 too, then of the degree that learning gives them.
"""

from __future__ import annotations

import shutil
import subprocess
import sys
import tempfile
import time
import zipfile
from pathlib import Path

from benchmarks.fmu_importer import both_from_one_loop, build_loop, simulated, through_fmpy
from romgen.fmu.compilers import host_platform
from romgen.fmu.export import export_fmu
from romgen.fmu.python_export import export_pythonfmu
from romgen.fmu.records import FmuExport
from romgen.learn import FIELD_ORDER
from romgen.reduced_model import ReducedModel
from romgen.settings import FmuSettings
from tests.romgen.fmu.models import random_model

H = 1e-4
N_C = 200_000
REPEATS = 5
TIMING = Path(__file__).with_name("fmu_timing.c")
Row = tuple[str, float, str]


def from_c(native: FmuExport) -> list[Row]:
    """Instantiate, step, and set + step + read from a C program of its own; [] without a host compiler."""
    compiler = shutil.which("cc") or shutil.which("gcc")
    if compiler is None or host_platform() not in native.platforms:
        return []
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
    best = [min(column) for column in zip(*(map(float, run.split()) for run in runs), strict=True)]
    names = ("instantiate + free", "doStep", "set + doStep + get")
    return [(f"C program: native, {name}", value, "us") for name, value in zip(names, best, strict=True)]


def same_loop(native: FmuExport, python: FmuExport, loop: Path) -> list[Row]:
    """Both units called by one C loop inside one process: the like-for-like ratio."""
    ours, theirs = (both_from_one_loop(unit.path, loop, H) for unit in (native, python))
    rows: list[Row] = []
    for what, a, b in zip(("doStep", "set + doStep + get"), ours, theirs, strict=True):
        rows += [(f"one C loop: native, {what}", a, "us"), (f"one C loop: pythonfmu, {what}", b, "us")]
        rows.append((f"one C loop: ratio of {what}", b / a, ""))
    return rows


def importer(native: FmuExport, python: FmuExport, loop: Path) -> list[Row]:
    """Both units driven by fmpy, and fmpy driving functions that return at once."""
    ours, theirs = through_fmpy(native.path, H), through_fmpy(python.path, H)
    nothing = through_fmpy(native.path, H, loop)
    rows: list[Row] = []
    for k, what in enumerate(("doStep", "set + doStep + get")):
        rows += [(f"fmpy: native, {what}", ours[k], "us"), (f"fmpy: pythonfmu, {what}", theirs[k], "us")]
        rows.append((f"fmpy: functions that return at once, {what}", nothing[k], "us"))
        rows.append((f"fmpy: ratio of {what}", theirs[k] / ours[k], ""))
        rows.append((f"fmpy: ratio of a native unit that takes no time, {what}", theirs[k] / nothing[k], ""))
    return rows


def whole_runs(native: FmuExport, python: FmuExport) -> list[Row]:
    """One call of fmpy.simulate_fmu over 1 s from the archive, and its parts before the first step."""
    ours, theirs = simulated(native.path, H), simulated(python.path, H)
    parts = ("unpack", "read the description", "load, instantiate, initialise")
    rows: list[Row] = [(f"simulate_fmu: native, {name}", 1e3 * s, "ms") for name, s in zip(parts, ours, strict=False)]
    rows += [("simulate_fmu: native, 10,000 steps", ours[-1], "s"), ("simulate_fmu: pythonfmu", theirs[-1], "s")]
    return [*rows, ("simulate_fmu: ratio", theirs[-1] / ours[-1], "")]


def measured(model: ReducedModel, platforms: tuple[str, ...], *, whole: bool) -> list[Row]:
    """All rows of one model; those of whole simulations only if wanted."""
    settings = FmuSettings(platforms=platforms)
    with tempfile.TemporaryDirectory() as folder:
        export_fmu(model, Path(folder) / "warm.fmu", settings)
        start = time.perf_counter()
        native = export_fmu(model, Path(folder) / "native.fmu", settings)
        export_s = time.perf_counter() - start
        python = export_pythonfmu(model, Path(folder) / "python.fmu", settings)
        loop = build_loop(Path(folder))
        rows = from_c(native)
        if loop is not None:
            rows += [*same_loop(native, python, loop), *importer(native, python, loop)]
        rows += whole_runs(native, python) if whole else []
    rows.append((f"size with {len(native.platforms)} platform(s) and sources", native.size_bytes / 1e3, "kB"))
    return [*rows, (f"export, compilers warm ({native.compiler})", export_s, "s")]


def main() -> None:
    """Print the tables; give platform names as arguments, default host."""
    platforms = tuple(sys.argv[1:]) or ("host",)
    for degree, model in ((7, random_model(order=7)), (FIELD_ORDER, random_model(order=7, sensor_order=FIELD_ORDER))):
        rows = measured(model, platforms, whole=degree == 7)
        print(f"model: 4 states, order 7, 3 sensors of degree {degree}, steps of {H} s; best of {REPEATS} runs")
        for name, value, unit in rows:
            print(f"{name:<72}{value:>12.3f} {unit}")


if __name__ == "__main__":
    main()
