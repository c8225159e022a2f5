"""L2: states, instances, threads and misuse of a unit."""

from __future__ import annotations

import sys
from collections.abc import Callable, Iterator
from concurrent.futures import ThreadPoolExecutor
from contextlib import ExitStack
from pathlib import Path

import numpy as np
from fmpy import read_model_description
from fmpy.fmi1 import FMICallException

from romgen.arrays import FloatArray
from romgen.fmu.check import random_input
from romgen.fmu.driver import Slave, collecting_callbacks, new_unit, opened_slave
from romgen.fmu.kernel_checks import START, final_state, interleaved
from romgen.fmu.records import LevelRow
from romgen.reduced_model import ReducedModel

N_STEP = 50
N_THREAD = 8
CYCLES = 2000


def state_rows(path: Path, model: ReducedModel, step: float) -> Iterator[LevelRow]:
    """Restored, serialised and reset states, interleaved and threaded instances, partitions, memory, misuse.

    Parameters
    ----------
    path : the unit.
    model : what it was made from.
    step : s, communication step.
    """
    times: FloatArray = step * np.arange(2 * N_STEP, dtype=np.float64)
    u = random_input(model, times)
    x0 = interleaved(START * model.trained_amplitude.astype(np.complex128)).tolist()

    def begin(slave: Slave) -> None:
        slave.fmu.setupExperiment(startTime=0.0)
        slave.fmu.setReal(slave.references.states, x0)
        slave.fmu.enterInitializationMode()
        slave.fmu.exitInitializationMode()

    def run(slave: Slave, first: int, n: int = N_STEP) -> list[float]:
        vr = slave.references
        for k in range(first, first + n):
            slave.fmu.setReal(vr.inputs, u[k].tolist())
            slave.fmu.doStep(k * step, step)
        return list(slave.fmu.getReal([*vr.states, *vr.displacement, *vr.velocity]))

    yield from _copies(path, begin, run)
    with ExitStack() as stack:
        slaves = [stack.enter_context(opened_slave(path)) for _ in range(N_THREAD + 1)]
        for slave in slaves:
            begin(slave)
        alone = run(slaves[0], 0)
        with ThreadPoolExecutor(N_THREAD) as pool:
            together = list(pool.map(lambda slave: run(slave, 0), slaves[1:]))
    apart = sum(result != alone for result in together)
    yield LevelRow(
        "L2", f"{N_THREAD} instances in {N_THREAD} threads that differ from one alone, to the bit", apart, 0.0, 0.0
    )
    end = N_STEP * step
    a, b = (final_state(path, model, end, 0.1 * step, n) for n in (N_STEP, N_STEP - 17))
    yield LevelRow(
        "L2",
        "another partition of the same time, constant input",
        float(np.max(np.abs(a - b)) / np.max(np.abs(a))),
        0.0,
        1e-9,
    )
    yield from _memory(path)
    yield LevelRow("L2", "kinds of misuse that were taken without an error", _misuse(path, step), 0.0, 0.0)


def _copies(path: Path, begin: Callable[[Slave], None], run: Callable[..., list[float]]) -> Iterator[LevelRow]:
    with opened_slave(path) as slave, opened_slave(path) as other:
        fmu = slave.fmu
        begin(slave)
        fresh = run(slave, 0)
        state = fmu.getFMUstate()
        serialised = fmu.serializeFMUstate(state)
        expected = run(slave, N_STEP)
        fmu.setFMUstate(state)
        yield LevelRow("L2", "values that a restored state changes", _unequal(run(slave, N_STEP), expected), 0.0, 0.0)
        other.fmu.setFMUstate(other.fmu.deSerializeFMUstate(serialised))
        changed = _unequal(run(other, N_STEP), expected)
        yield LevelRow("L2", "values that a state serialised to another instance changes", changed, 0.0, 0.0)
        fmu.freeFMUstate(state)
        fmu.reset()
        begin(slave)
        yield LevelRow(
            "L2", "values that differ after fmi2Reset from a fresh instance", _unequal(run(slave, 0), fresh), 0.0, 0.0
        )
        other.fmu.reset()
        begin(other)
        fmu.reset()
        begin(slave)
        for k in range(N_STEP):
            mixed = run(slave, k, 1)
            run(other, k, 1)
        yield LevelRow("L2", "values that an interleaved second instance changes", _unequal(mixed, fresh), 0.0, 0.0)


def _unequal(a: list[float], b: list[float]) -> int:
    return sum(x != y for x, y in zip(a, b, strict=True))


def _memory(path: Path) -> Iterator[LevelRow]:
    """Growth of the resident memory over many instances, where the system tells it."""
    if not sys.platform.startswith("linux"):
        return
    with opened_slave(path) as slave:
        description = read_model_description(slave.fmu.unzipDirectory, validate=False)
        library = new_unit(description, slave.fmu.unzipDirectory, "CoSimulation")
        callbacks = collecting_callbacks([])
        before = 0
        for k in range(CYCLES + 200):
            if k == 200:
                before = _resident()
            library.instantiate(callbacks=callbacks)
            library.setupExperiment(startTime=0.0)
            library.enterInitializationMode()
            library.exitInitializationMode()
            library.doStep(0.0, 1e-5)
            library.getFMUstate()
            library.fmi2FreeInstance(library.component)
        grown = (_resident() - before) / 1e6
    yield LevelRow("L2", f"resident memory grown over {CYCLES} instances, MB", max(grown, 0.0), 0.0, 1.0)


def _resident() -> int:
    """Bytes in memory now."""
    pages = int(Path("/proc/self/statm").read_text().split()[1])
    return pages * 4096


def _misuse(path: Path, step: float) -> int:
    """How many of the forbidden calls are not answered with an error."""
    with opened_slave(path) as slave:
        fmu, vr = slave.fmu, slave.references
        fmu.setupExperiment(startTime=0.0)
        fmu.enterInitializationMode()
        fmu.exitInitializationMode()
        state = fmu.getFMUstate()
        dead = type(state)(state.value)
        fmu.freeFMUstate(state)
        bad: tuple[Callable[[], object], ...] = (
            lambda: fmu.getReal([999999]),
            lambda: fmu.setReal([999999], [0.0]),
            lambda: fmu.setReal([vr.trust_ratio], [0.0]),
            lambda: fmu.setReal([vr.states[0]], [0.0]),
            lambda: fmu.setReal([vr.max_internal_step], [float("nan")]),
            lambda: fmu.doStep(0.0, 0.0),
            lambda: fmu.doStep(0.0, -step),
            lambda: fmu.doStep(0.0, float("nan")),
            lambda: fmu.freeFMUstate(dead),
            lambda: fmu.setFMUstate(dead),
            lambda: fmu.deSerializeFMUstate(b"\0" * 64),
            lambda: fmu.enterInitializationMode(),
        )
        taken = sum(not _refused(call) for call in bad)
        description = read_model_description(fmu.unzipDirectory, validate=False)
        again = new_unit(description, fmu.unzipDirectory, "CoSimulation", "{wrong}")
        return taken + (not _refused(lambda: again.instantiate(callbacks=collecting_callbacks([]))))


def _refused(call: Callable[[], object]) -> bool:
    try:
        call()
    except FMICallException:
        return True
    except Exception as error:  # fmpy raises plain Exception where fmi2Instantiate returns NULL
        return "nstantiat" in str(error)
    return False
