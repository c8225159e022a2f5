"""From the tightening torque of a bolt to the force in its shank."""

from __future__ import annotations

from fem.errors import FemInputError


def bolt_force(torque: float, pitch: float, diameters: tuple[float, float], friction: tuple[float, float]) -> float:
    """F = T / (0.159 P + 0.578 d_2 mu_T + 0.5 D_f mu_H) in N.

    Parameters
    ----------
    torque : T, N m; pitch : P of the thread, m.
    diameters : d_2 of the thread flanks and D_f, mean of the ring under the head, m.
    friction : mu_T in the thread and mu_H under the head.

    0.159 = 1/(2 pi), 0.578 = 1/(2 cos 30 deg) of a 60 degree thread (VDI 2230-1; Morsy, Xu, Tiso, Haller 2024). Torque
    control scatters by 25 % or more: for a benchmark give the force itself.
    """
    values = (torque, pitch, *diameters)
    if not (min(values) > 0.0 and min(friction) >= 0.0):
        advice = "torque, pitch and diameters must be positive, friction not negative"
        raise FemInputError("not a bolt", where="torque formula", value=(*values, *friction), advice=advice)
    d_thread, d_head = diameters
    mu_thread, mu_head = friction
    return torque / (0.159 * pitch + 0.578 * d_thread * mu_thread + 0.5 * d_head * mu_head)
