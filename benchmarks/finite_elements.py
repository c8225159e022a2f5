"""python -m benchmarks.finite_elements: cost of a time step of the quick start by part, alone and five at once."""

from __future__ import annotations

import statistics
import time
from collections.abc import Callable
from pathlib import Path

import numpy as np

from fem.campaign import modal_coordinates, snap_back_starts
from fem.modes import rayleigh, solve_modes
from fem.preload import StaticSettings, solve_static
from fem.transient import Transient, TransientSettings
from romgen.fe_stages import build
from romgen.settings import load_study

STUDY = Path(__file__).parents[1] / "models" / "clamped_panel" / "study.toml"
STEPS, REPEATS = 100, 50


def median_ms(work: Callable[[], object]) -> float:
    """Median time of ``work`` in ms after one call that warms it up."""
    work()
    times = []
    for _ in range(REPEATS):
        start = time.perf_counter()
        work()
        times.append(time.perf_counter() - start)
    return 1e3 * statistics.median(times)


def prepare() -> tuple[Transient, np.ndarray, np.ndarray]:
    """The transient of the quick start, a start displacement (n_dof, 1) and its slip."""
    study = load_study(STUDY)
    assert study.ringdowns is not None
    model = build(study)
    state = solve_static(model, model.load, StaticSettings())
    modes = solve_modes(model, state, study.modes.count)
    damping = rayleigh(modes, (0, 1), study.modes.damping_ratio)
    eta = modal_coordinates(modes, study.ringdowns.training[0].amplitudes)
    scale = float(np.linalg.norm(modes.left[:, : len(eta)] @ (modes.omega[: len(eta)] ** 2 * eta)))
    settings = TransientSettings(study.ringdowns.time_step, tolerance=study.ringdowns.tolerance)
    transient = Transient(model, state, modes, damping, settings, force_scale=scale)
    starts = snap_back_starts(transient, modes, [eta])
    return transient, starts.displacement, starts.slip


def parts(transient: Transient, u: np.ndarray, slip: np.ndarray) -> dict[str, float]:
    """Median ms of the parts of one residual evaluation and one correction."""
    model = transient.model
    relative = model.contact.relative(u)
    contact = model.contact.evaluate(relative, slip)
    residual = np.ones_like(u)
    return {
        "internal force": median_ms(lambda: model.elastic_force(u)),
        "contact law": median_ms(lambda: model.contact.evaluate(relative, slip)),
        "contact geometry": median_ms(lambda: (model.contact.relative(u), model.contact.force(contact.traction))),
        "solve": median_ms(lambda: transient.precondition(residual)),
    }


def main() -> None:
    """Print the table."""
    transient, displacement, slip = prepare()
    print(f"{transient.model.n_dof} DOF, {transient.model.contact.n_point} contact points, medians in ms")
    columns = {}
    for n_case in (1, 5):
        u = np.repeat(transient.equilibrium.u[:, None] + displacement, n_case, axis=1)
        histories = np.repeat(slip, n_case, axis=2)
        columns[n_case] = parts(transient, u, histories)
        state = transient.start(np.repeat(displacement, n_case, axis=1), np.zeros_like(u), histories)
        times, iterations = [], []
        start = time.perf_counter()
        for record in transient.march(state, STEPS):
            times.append(time.perf_counter() - start)
            iterations.append(int(record.iterations.max()))
        columns[n_case] |= {
            "whole step": 1e3 * statistics.median(np.diff(times)),
            "iterations": statistics.mean(iterations),
        }
    print(f"{'part':<20}{'1 case':>10}{'5 cases':>10}{'ratio':>8}")
    for name, single in columns[1].items():
        print(f"{name:<20}{single:>10.3f}{columns[5][name]:>10.3f}{columns[5][name] / single:>8.2f}")


if __name__ == "__main__":
    main()
