"""python -m benchmarks.sizes [--one] [5k 20k 60k 188k]: time steps of the clamped panel on finer and finer meshes.

Ring-down from 2 mm with preload, contact and friction in steps of 2e-4 s: seconds of every stage before it,
milliseconds of a step by part, what memory bandwidth allows, and the wall time of 0.8 s that follows from the median
step around the largest amplitude. One case, then five that march together.
"""

from __future__ import annotations

import resource
import statistics
import sys
import time
from collections.abc import Iterator
from contextlib import contextmanager

import numpy as np
from numba import prange

from benchmarks.finite_elements import STUDY, median_ms
from fem.anderson import Anderson
from fem.arrays import FloatArray
from fem.campaign import Starts, modal_coordinates, snap_back_starts
from fem.compiled import threaded
from fem.model import Model
from fem.modes import ModalBasis, rayleigh, solve_modes
from fem.motion import MotionState
from fem.preload import StaticSettings, solve_static
from fem.transient import Transient, TransientSettings
from romgen.fe_stages import build
from romgen.settings import Study, load_study

# Cells along the free and the two clamped parts of the panel, through it, across it, and through each block.
MESHES = {
    "5k": ((10, 2, 2), 1, 8, 1),
    "20k": ((24, 3, 4), 1, 18, 2),
    "60k": ((40, 6, 6), 1, 30, 3),
    "188k": ((64, 8, 8), 2, 40, 4),
}
STEPS = {1: 200, 5: 60}
DURATION = 0.8
# s; frequency within 0.02 %, damping within 0.6 %: tests/verification/test_fem_step_size.py.
STEP = 2e-4
Ready = tuple[Transient, ModalBasis]
TARGET_H = {("20k", 1): 0.05, ("188k", 1): 2.0, ("188k", 5): 6.0}


@contextmanager
def stage(name: str) -> Iterator[None]:
    """Print the wall time of a block."""
    start = time.perf_counter()
    yield
    print(f"  {name:<28}{time.perf_counter() - start:>10.1f} s", flush=True)


def refined(name: str) -> Study:
    """The quick start on a mesh of MESHES."""
    study = load_study(STUDY)
    along, through, across, deep = MESHES[name]
    panel = {"cells_x": along, "cells_y": (through,), "cells_z": (across,)}
    block = {"cells_x": along[1:], "cells_y": (deep,), "cells_z": (across,)}
    blocks = {
        key: settings.model_copy(update=panel if key == "panel" else block) for key, settings in study.blocks.items()
    }
    return study.model_copy(update={"blocks": blocks})


@threaded
def _read(x: FloatArray, out: FloatArray) -> None:
    chunk = len(x) // len(out)
    for k in prange(len(out)):
        s = 0.0
        for i in range(k * chunk, (k + 1) * chunk):
            s += x[i]
        out[k] = s


def bandwidth() -> float:
    """Bytes per second that all threads read from memory together."""
    x, out = np.ones(50_000_000), np.zeros(64)
    return float(x.nbytes / (1e-3 * median_ms(lambda: _read(x, out))))


def prepare(model: Model, study: Study, n_case: int) -> tuple[Ready, Starts]:
    """Preload, modes, factor and static starts of the first ring-downs of the study."""
    assert study.ringdowns is not None
    with stage("preload"):
        state = solve_static(model, model.load, StaticSettings(study.preload.steps, study.preload.tolerance))
    with stage("modes"):
        modes = solve_modes(model, state, study.modes.count)
    etas = [modal_coordinates(modes, start.amplitudes) for start in study.ringdowns.starts[:n_case]]
    scale = max(float(np.linalg.norm(modes.left[:, :2] @ (modes.omega[:2] ** 2 * eta))) for eta in etas)
    settings = TransientSettings(STEP, tolerance=study.ringdowns.tolerance)
    with stage("factor"):
        damping = rayleigh(modes, (0, 1), study.modes.damping_ratio)
        transient = Transient(model, state, modes, damping, settings, force_scale=scale)
    with stage(f"static starts ({n_case})"):
        starts = snap_back_starts(transient, modes, etas)
    return (transient, modes), starts


def parts(transient: Transient, modes: ModalBasis, u: FloatArray, slip: FloatArray) -> dict[str, float]:
    """Median ms of the parts of one iteration."""
    dynamics = transient.dynamics
    residual, live = np.ones_like(u), np.arange(u.shape[1])
    anderson = Anderson(len(u), u.shape[1], transient.settings.depth)
    for _ in range(transient.settings.depth):
        anderson.remember(live, u, residual)
    return {
        "bodies, nonlinear": median_ms(lambda: dynamics.model.cell_forces(u, u, dynamics.beta)),
        "mass and linear bodies": median_ms(lambda: dynamics.linear(u)),
        "contact": median_ms(lambda: dynamics.contact_force(dynamics.contact(u, slip))),
        "solve": median_ms(lambda: transient.precondition(residual)),
        "acceleration": median_ms(lambda: anderson.step(live, residual)),
        "output": median_ms(lambda: (modes.left.T @ u, modes.shapes.T @ u, u.astype(np.float32))),
    }


def settling(transient: Transient, old: MotionState, new: MotionState) -> float:
    """Median ms in which the loose points come into equilibrium, from one state to the next."""
    loose = transient.loose(new)
    if loose is None:
        return 0.0
    slip = np.ascontiguousarray(old.slip[loose.index])
    v, applied = loose.gap(new.u), loose.remainder(loose.gap(old.u), slip)
    return median_ms(lambda: loose.settled(v, applied, slip))


def march(name: str, ready: Ready, starts: Starts, speed: float) -> None:
    """Print parts and steps of the cases of ``starts``; ``speed`` of memory in bytes per second."""
    transient, modes = ready
    n_case = starts.displacement.shape[1]
    state = transient.start(starts.displacement, np.zeros_like(starts.displacement), starts.slip, settled=True)
    for part, ms in parts(transient, modes, state.u, state.slip).items():
        print(f"  {part + f' ({n_case})':<28}{ms:>10.2f} ms", flush=True)
    times, iterations, begin = [], [], time.perf_counter()
    states = [state, state]
    for record in transient.march(state, STEPS[n_case]):
        times.append(time.perf_counter())
        iterations.append(float(record.iterations.max()))
        states = [states[1], record.state]
    print(f"  {f'{len(states[1].pace.loose)} loose points ({n_case})':<28}{settling(transient, *states):>10.2f} ms")
    steps = np.diff([begin, *times])
    median, mean = statistics.median(steps), statistics.mean(iterations)
    factor = 8.0 * transient.statistics.factor_entries  # two sweeps in single precision
    floor = (mean * factor) / speed
    hours = median * DURATION / transient.settings.time_step / 3600.0
    print(f"  {f'step ({n_case}), median of {len(steps)}':<28}{1e3 * median:>10.1f} ms, {mean:.2f} iterations")
    print(
        f"  {'  reading the factor':<28}{1e3 * floor:>10.1f} ms at {speed / 1e9:.1f} GB/s: {median / floor:.1f} times"
    )
    target = TARGET_H.get((name, n_case))
    print(
        f"  {f'{DURATION} s of ring-down ({n_case})':<28}{hours:>10.2f} h" + (f", target {target} h" if target else "")
    )


def main() -> None:
    """Print one table per mesh."""
    speed = bandwidth()
    counts = [n for n in STEPS if n == 1 or "--one" not in sys.argv]
    for name in [name for name in sys.argv[1:] if name != "--one"] or MESHES:
        study = refined(name)
        begin = time.perf_counter()
        model = build(study)
        print(f"{name}: {model.n_dof} DOF, {model.contact.n_point} contact points", flush=True)
        print(f"  {'mesh and assembly':<28}{time.perf_counter() - begin:>10.1f} s", flush=True)
        ready, starts = prepare(model, study, max(counts))
        for n_case in counts:
            chosen = Starts(
                np.ascontiguousarray(starts.displacement[:, :n_case]), np.ascontiguousarray(starts.slip[..., :n_case])
            )
            march(name, ready, chosen, speed)
        print(f"  {'peak memory so far':<28}{resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1e6:>10.2f} GB")


if __name__ == "__main__":
    main()
