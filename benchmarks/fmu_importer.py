"""How long importers take around a unit: one C loop for any unit, fmpy, and fmpy with functions that do nothing."""

from __future__ import annotations

import ctypes
import shutil
import subprocess
import time
from collections.abc import Iterator
from contextlib import contextmanager
from itertools import pairwise
from pathlib import Path
from typing import Any

from fmpy import extract, read_model_description, simulate_fmu
from fmpy.fmi2 import FMU2Slave

from romgen.fmu.driver import Slave, collecting_callbacks, opened_slave

LOOP = Path(__file__).with_name("fmu_loop.c")
REPEATS = 5
N_NATIVE, N_PYTHON = 10_000, 1_000


def build_loop(folder: Path) -> Path | None:
    """The compiled C loop, None without a host compiler."""
    compiler = shutil.which("cc") or shutil.which("gcc")
    if compiler is None:
        return None
    library = folder / "fmu_loop.so"
    subprocess.run([compiler, "-std=c99", "-O2", "-fPIC", "-shared", str(LOOP), "-o", str(library)], check=True)
    return library


@contextmanager
def _started(path: str) -> Iterator[Slave]:
    """A unit that has left initialisation, away from rest."""
    with opened_slave(path) as slave:
        slave.fmu.setupExperiment(startTime=0.0)
        slave.fmu.setReal([slave.references.states[0]], [0.5])
        slave.fmu.enterInitializationMode()
        slave.fmu.exitInitializationMode()
        yield slave


def both_from_one_loop(path: str, loop: Path, h: float) -> tuple[float, float]:
    """Microseconds of doStep and of set + doStep + get, called by the C loop in this process; the best of several."""
    library = ctypes.CDLL(str(loop))
    library.time_steps.restype = library.time_passes.restype = ctypes.c_double
    n = N_PYTHON if "python" in Path(path).name else N_NATIVE
    with _started(path) as slave:
        unit, vr = ctypes.c_void_p(slave.fmu.component), slave.references
        set_real, step, get_real = (
            ctypes.cast(getattr(slave.fmu.dll, name), ctypes.c_void_p)
            for name in ("fmi2SetReal", "fmi2DoStep", "fmi2GetReal")
        )
        size, inputs, outputs = ctypes.c_size_t, _numbers(vr.inputs), _numbers(vr.displacement)
        shown = (inputs, size(len(inputs)), outputs, size(len(outputs)))
        count, length = ctypes.c_int(n), ctypes.c_double(h)
        steps = [library.time_steps(step, unit, count, length) for _ in range(REPEATS)]
        passes = [library.time_passes(set_real, step, get_real, unit, count, length, *shown) for _ in range(REPEATS)]
    if min(*steps, *passes) < 0.0:
        raise RuntimeError(f"{path} failed in a step")
    return min(steps), min(passes)


def _numbers(references: tuple[int, ...]) -> ctypes.Array[ctypes.c_uint]:
    return (ctypes.c_uint * len(references))(*references)


def through_fmpy(path: str, h: float, loop: Path | None = None) -> tuple[float, float]:
    """Microseconds of doStep and of set + doStep + get through fmpy's FMU2Slave; the best of several runs.

    With a loop library its functions, which return at once, take the place of those of the unit.
    """
    n = N_PYTHON if "python" in Path(path).name else N_NATIVE
    with _started(path) as slave:
        if loop is not None:
            _replace_functions(slave.fmu, ctypes.CDLL(str(loop)))
        vr = slave.references
        runs = [_fmpy_loop(slave.fmu, vr.inputs, vr.displacement, n, h) for _ in range(REPEATS)]
    return min(run[0] for run in runs), min(run[1] for run in runs)


def _replace_functions(fmu: Any, library: ctypes.CDLL) -> None:
    for name in ("fmi2SetReal", "fmi2DoStep", "fmi2GetReal"):
        real, empty = fmu._functions[name], getattr(library, name)
        empty.argnames, empty.argtypes, empty.restype = real.argnames, real.argtypes, real.restype
        fmu._functions[name] = empty


def _fmpy_loop(fmu: Any, inputs: tuple[int, ...], outputs: tuple[int, ...], n: int, h: float) -> tuple[float, float]:
    start = time.perf_counter()
    for k in range(n):
        fmu.doStep(k * h, h)
    middle = time.perf_counter()
    for k in range(n):
        fmu.setReal(inputs, [1e-3 * (k % 2)])
        fmu.doStep(k * h, h)
        fmu.getReal(outputs)
    return 1e6 * (middle - start) / n, 1e6 * (time.perf_counter() - middle) / n


def simulated(path: str, h: float) -> tuple[float, float, float, float]:
    """Seconds to unpack, to read the description, to load and initialise, and of fmpy.simulate_fmu over 1 s."""
    ticks = [time.perf_counter()]
    folder = extract(path)
    ticks.append(time.perf_counter())
    description = read_model_description(folder)
    ticks.append(time.perf_counter())
    name = description.coSimulation.modelIdentifier
    fmu = FMU2Slave(guid=description.guid, modelIdentifier=name, unzipDirectory=folder)
    fmu.instantiate(callbacks=collecting_callbacks([]))
    fmu.setupExperiment(startTime=0.0)
    fmu.enterInitializationMode()
    fmu.exitInitializationMode()
    ticks.append(time.perf_counter())
    fmu.freeInstance()
    shutil.rmtree(folder)
    start = time.perf_counter()
    simulate_fmu(path, fmi_type="CoSimulation", stop_time=1.0, output_interval=h, logger=lambda *_: None)
    whole = time.perf_counter() - start
    unpacked, read, initialised = (b - a for a, b in pairwise(ticks))
    return unpacked, read, initialised, whole
