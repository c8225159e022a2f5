"""Work of friction over a load step, of second order in the step."""

from __future__ import annotations

import numpy as np

from fem.arrays import FloatArray
from fem.contact import Contact, ContactState


def friction_work(
    contact: Contact, relative: tuple[FloatArray, FloatArray], states: tuple[ContactState, ContactState]
) -> FloatArray:
    """Work of friction per area between two states of one case, (n_point,) J/m^2.

    w = mu (p_a + p_b)/2 abs(s_b - s_a): a is where slip begins within the step, with gap and displacement linear in it,
    b where the step ends or the point opens. The mean pressure makes the error of second order in the step; at the
    pressure of the end alone (``Contact.dissipated``) the work of four steps of a rising load is a quarter too large.

    ``relative`` (3 n_point, 1) m and the states at the beginning and the end, the slip of the second from the first.
    """
    first, last = (values.reshape(-1, 3) for values in relative)
    change, (kn, kt, mu) = last - first, contact.law.T
    gap, rate = contact.initial_gap + first[:, 0], change[:, 0]
    # The part of the step in which the point is closed; pressures on it are linear.
    crossing = np.clip(-gap / np.where(rate == 0.0, np.inf, rate), 0.0, 1.0)
    was, stays = gap < 0.0, gap + rate < 0.0
    enter, leave = np.where(was, 0.0, crossing), np.where(stays, 1.0, crossing)
    anchor = np.where(was[:, None], states[0].slip[:, :, 0], first[:, 1:] + enter[:, None] * change[:, 1:])
    stretch, pull = kt[:, None] * (first[:, 1:] - anchor), kt[:, None] * change[:, 1:]
    begin = _onset(stretch, pull, -mu * kn * gap, -mu * kn * rate)
    # What comes down in the step slips from there on, or never.
    slides = was | (stays & (np.linalg.norm(pull, axis=1) > np.abs(mu * kn * rate)))
    begin = np.clip(np.where(was, begin, enter), enter, leave)
    end = np.where(stays[:, None], states[1].slip[:, :, 0], first[:, 1:] + leave[:, None] * change[:, 1:])
    path = np.linalg.norm(end - anchor, axis=1)
    mean = -0.5 * kn * (2.0 * gap + (begin + leave) * rate)
    return np.asarray(np.where(slides, mu * mean * path, 0.0))


def _onset(stretch: FloatArray, pull: FloatArray, limit: FloatArray, growth: FloatArray) -> FloatArray:
    """Share t of the step where abs(stretch + t pull) comes to exceed limit + t growth, (n_point, ...) Pa; else inf.

    The root of a t^2 + 2 b t + c = 0 with a rising left side: the traction without slip leaves the cone of friction.
    """
    a = np.einsum("gi,gi->g", pull, pull) - growth**2
    b = np.einsum("gi,gi->g", stretch, pull) - limit * growth
    c = np.einsum("gi,gi->g", stretch, stretch) - limit**2
    square = b * b - a * c
    root = np.sqrt(np.maximum(square, 0.0))
    with np.errstate(divide="ignore", invalid="ignore"):
        t = np.where(b > 0.0, -c / (b + root), np.where(a > 0.0, (root - b) / a, np.inf))
    return np.where(square >= 0.0, t, np.inf)
