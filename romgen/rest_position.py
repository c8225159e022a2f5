"""Motions counted from where they come to rest instead of from the zero of the record.

Sensors have offsets, and friction leaves a joint in another state than it started from. A reduced model has one
equilibrium, so a record that ends elsewhere is missed by that much at every late sample.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from romgen.arrays import FloatArray
from romgen.errors import InputError
from romgen.trajectory import Trajectory

# Share of the record that shows where it rests.
TAIL = 0.1
# RMS of what still moves there, relative to the largest motion: a curved part shifts its mean with the square of that.
STILL = 0.05


def rest_position(trajectory: Trajectory) -> FloatArray:
    """Return the mean displacement (n_sensor,) m of the last tenth of a record under a Hann window.

        rest = sum_k w_k x(t_k) / sum_k w_k,   w = sin^2(pi (t - t_a) / (t_b - t_a)) dt

    The window keeps what still oscillates out of the mean (Harris, Proc. IEEE 66 (1978) 51-83).

    Raises
    ------
    InputError : the motion is still larger than 5 % of its largest there.
    """
    t, x = trajectory.t, trajectory.displacement
    late = t >= t[-1] - TAIL * (t[-1] - t[0])
    if late.sum() < 3:
        raise InputError("too few samples to see where it rests", where=f"trajectory '{trajectory.name}'", value=len(t))
    window = np.sin(np.pi * (t[late] - t[late][0]) / (t[-1] - t[late][0])) ** 2 * np.gradient(t[late])
    rest: FloatArray = window @ x[late] / window.sum()
    moving = float(np.sqrt(np.mean(np.sum((x[late] - rest) ** 2, axis=1))))
    largest = float(np.linalg.norm(x - rest, axis=1).max())
    if moving > STILL * largest:
        raise InputError(
            "the motion has not come to rest",
            where=f"trajectory '{trajectory.name}'",
            value=f"{100 * moving / largest:.2g} % of its largest motion in its last tenth",
            advice='record longer, or count from the zero of the record ([data] zero = "recorded")',
        )
    return rest


def counted_from(trajectory: Trajectory, rest: FloatArray) -> Trajectory:
    """Return a trajectory of sensors with ``rest`` (n_sensor,) m as its zero."""
    return replace(trajectory, displacement=trajectory.displacement - rest)


def offset_percent(trajectory: Trajectory, rest: FloatArray) -> float:
    """Return the norm of the rest position relative to the largest motion about it, in percent."""
    largest = float(np.linalg.norm(trajectory.displacement - rest, axis=1).max())
    return 100.0 * float(np.linalg.norm(rest)) / max(largest, np.finfo(float).tiny)
