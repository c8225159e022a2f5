"""python -m benchmarks.start_up [RUNS]: what imports and compiled loops cost a process that finds them in the cache.

Each run is an empty process that takes a clamped strip through preload, modes and ten time steps, twice. The wall time
of the process up to the end of the first pass, less the second pass, is start-up. A first process fills the cache and
is not counted.
"""

from __future__ import annotations

import statistics
import subprocess
import sys
import time

TARGET_S = 2.0
RUNS = 5
CHILD = "-child"


def ten_steps() -> None:
    """A strip of 12 x 1 x 2 cells held at one end, its own weight, two modes, ten time steps from 0.1 mm."""
    import numpy as np  # imports are part of what is measured

    import fem

    steel = fem.Material(young_modulus=200e9, poisson_ratio=0.3, density=7800.0)
    mesh = fem.hex_block(np.linspace(0.0, 0.3, 13), np.array([0.0, 0.002]), np.linspace(0.0, 0.02, 3))
    model = fem.build_model(
        [fem.Body("strip", mesh, steel)],
        supports=[fem.Support("strip.x_min", ("x", "y", "z"))],
        loads=[fem.Gravity("weight", (0.0, -9.81, 0.0))],
    )
    state = fem.solve_static(model, model.load, fem.StaticSettings(steps=1))
    modes = fem.solve_modes(model, state, 2)
    march = fem.Transient(model, state, modes, fem.rayleigh(modes, (0, 1), (0.01, 0.01)), fem.TransientSettings(1e-4))
    start = state.u[:, None] + 1e-4 * modes.shapes[:, :1] / np.abs(modes.shapes[:, 0]).max()
    for _ in march.march(march.start(start, np.zeros_like(start)), 10):
        pass


def _child() -> None:
    ten_steps()
    again = time.perf_counter()
    ten_steps()
    print(time.perf_counter() - again)


def start_up() -> float:
    """Seconds that an empty process needs besides the work itself."""
    begin = time.perf_counter()
    done = subprocess.run([sys.executable, "-m", __spec__.name, CHILD], check=True, capture_output=True, text=True)
    return time.perf_counter() - begin - 2.0 * float(done.stdout)


def main() -> None:
    """Print every run and the median beside the target."""
    start_up()
    seconds = [start_up() for _ in range(int(sys.argv[1]) if len(sys.argv) > 1 else RUNS)]
    runs = ", ".join(f"{s:.2f}" for s in seconds)
    print(f"start-up {statistics.median(seconds):.2f} s, target {TARGET_S:.0f} s; runs {runs}")


if __name__ == "__main__":
    _child() if CHILD in sys.argv else main()
