"""Ring-downs of the shell, kept in a folder for temporary files once computed.

Training starts lie on the manifold of the first two modes to second order, so that the transverse modes, which decay
hardly faster than the master modes (0.71 against 0.60 1/s), start small. The held-out motion is released from a static
load instead, which knows nothing of the manifold.
"""

from __future__ import annotations

import hashlib
import os
import tempfile
from pathlib import Path

import numpy as np
from scipy.sparse.linalg import splu

from romgen.arrays import FloatArray
from romgen.polynomial import zeta
from romgen.store import read_file, write_file
from romgen.trajectory import Trajectory
from tests.verification import radau, shell_normal_form, von_karman_shell
from tests.verification.radau import Radau, accelerated
from tests.verification.shell_normal_form import second_degree
from tests.verification.von_karman_shell import Shell

# Modal displacements at the start, m kg^0.5; 0.01 moves the shell by 2 mm, a fifth of its thickness, and is five times
# the peak of the forced response that is compared. Of the held-out motion those of the linear response to its load.
STARTS = {"first": (0.010, 0.0), "second": (0.002, 0.008), "both": (0.007, -0.005)}
HELD_OUT = {"held_out": (0.006, 0.004)}
# 42 steps per period of mode 1 and 21 of mode 2.
STEP, STEPS = 1e-3, 5000
SNAPSHOT_EVERY = 5
SENSOR_NODES = (60, 115, 170)


def ringdown(shell: Shell, name: str) -> Trajectory:
    """Return a ring-down, computed on first use and read afterwards."""
    modules = (radau.__file__, shell_normal_form.__file__, von_karman_shell.__file__, __file__)
    sources = b"".join(Path(str(module)).read_bytes() for module in modules)
    folder = Path(os.environ.get("ROMGEN_CACHE", tempfile.gettempdir())) / "romgen_verification"
    path = folder / f"shell_{name}_{hashlib.sha256(sources).hexdigest()[:12]}.h5"
    if path.is_file():
        return read_file(path, Trajectory)
    trajectory = computed(shell, name, STEPS)
    folder.mkdir(parents=True, exist_ok=True)
    write_file(path, trajectory)
    return trajectory


def computed(shell: Shell, name: str, steps: int) -> Trajectory:
    """Release the shell on its manifold, or from its static load."""
    q0, v0 = manifold_start(shell, np.array(STARTS[name])) if name in STARTS else static_start(shell, HELD_OUT[name])
    q, v, a = Radau((shell.M, shell.C, shell.K), shell.force, STEP).march(q0, v0, steps)
    left = shell.M @ shell.shapes
    sensors = np.searchsorted(shell.free, [6 * node + 2 for node in SENSOR_NODES])
    index = np.arange(0, steps + 1, SNAPSHOT_EVERY)
    return Trajectory(
        name=name,
        t=STEP * np.arange(steps + 1),
        sensors=tuple(f"z{node}" for node in SENSOR_NODES),
        displacement=q[:, sensors],
        velocity=v[:, sensors],
        eta=q @ left,
        eta_dot=v @ left,
        eta_ddot=a @ left,
        snapshots=q[index].astype(np.float32),
        snapshot_index=index,
    )


def manifold_start(shell: Shell, eta: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Return q and q' of modal displacements eta without modal velocity, on the manifold to second order."""
    eigenvalues, shapes = shell.eigenvalues[: eta.size], shell.shapes[:, : eta.size]
    p = -eigenvalues.conj() * eta / (2j * eigenvalues.imag)
    w = second_degree(shell)[1]
    q, v = (shapes @ eta).astype(np.complex128), np.zeros(len(shapes), dtype=np.complex128)
    for key, value in w.items():
        term = value * np.prod(zeta(p) ** np.array(key))
        q, v = q + term, v + (np.array(key) @ zeta(eigenvalues)) * term
    return q.real, v.real


def static_start(shell: Shell, load: tuple[float, float]) -> tuple[FloatArray, FloatArray]:
    """Return q with K q + g(q) = M Phi omega^2 load, and no velocity."""
    amplitudes = np.array(load)
    omega2 = np.abs(shell.eigenvalues[: amplitudes.size]) ** 2
    f = shell.M @ (shell.shapes[:, : amplitudes.size] @ (omega2 * amplitudes))
    stiffness = splu(shell.K.tocsc())
    q, past = stiffness.solve(f), []
    for _ in range(60):
        change = stiffness.solve(f - shell.K @ q - shell.force(q))
        if np.linalg.norm(change) < 1e-11 * np.linalg.norm(q):
            return q, np.zeros_like(q)
        past = [*past[-5:], (q, change)]
        q = accelerated(past)
    raise RuntimeError(f"static load: change {np.linalg.norm(change):.3g}")
