"""Periodic orbits at the sensors and their amplitudes by name: ``max`` and ``sqrt2_rms``."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Literal

import numpy as np

from romgen.arrays import ComplexArray, FloatArray
from romgen.polynomial import evaluate, zeta
from romgen.reduced_model import ReducedModel

Measure = Literal["max", "sqrt2_rms"]
# 128 samples per period integrate harmonics up to 63 exactly; a parabola through the highest three refines the maximum.
SAMPLES = 128
ORBITS_AT_ONCE = 64


@dataclass(frozen=True)
class OrbitAmplitudes:
    """Amplitudes of periodic orbits at every sensor, over one period.

    Nothing is subtracted: the even terms of a softening structure shift the mean, and it counts in both measures.
    About the mean the second one is sqrt(sqrt2_rms^2 - 2 mean^2).

    Attributes
    ----------
    max : (n_orbit, n_sensor) max abs(x), m.
    sqrt2_rms : (n_orbit, n_sensor) sqrt(2) times the root mean square about zero, m.
    mean : (n_orbit, n_sensor) mean of x, m.
    """

    max: FloatArray = field(metadata={"unit": "m", "axes": "orbit,sensor"})
    sqrt2_rms: FloatArray = field(metadata={"unit": "m", "axes": "orbit,sensor"})
    mean: FloatArray = field(metadata={"unit": "m", "axes": "orbit,sensor"})


def orbit_amplitudes(model: ReducedModel, z: ComplexArray) -> OrbitAmplitudes:
    """Return the amplitudes of orbits z (n_orbit, n_phase, m), equispaced over one period each.

    x = W(Re T(z)); max abs(x) by the parabola through its three highest samples; sqrt2_rms = sqrt(2 mean x^2).

    Source: Morsy et al. 2024 compare sqrt(2) RMS over a period; max is the usual amplitude of a forced response.
    """
    blocks = [_amplitudes(sensor_orbits(model, block)) for block in _blocks(z)]
    return OrbitAmplitudes(*(np.concatenate(parts) for parts in zip(*blocks, strict=True)))


def sensor_orbits(model: ReducedModel, z: ComplexArray) -> FloatArray:
    """Return the sensor displacement (n_orbit, n_phase, n_sensor) in m of z (n_orbit, n_phase, m)."""
    coordinates = evaluate(model.chart, zeta(z.reshape(-1, z.shape[-1]))).real
    x = evaluate(model.displacement, coordinates)
    return x.reshape(*z.shape[:2], x.shape[1])


def _blocks(z: ComplexArray) -> list[ComplexArray]:
    """Return z in blocks of orbits, so that memory stays bounded on long branches."""
    return [z[i : i + ORBITS_AT_ONCE] for i in range(0, max(len(z), 1), ORBITS_AT_ONCE)]


def _amplitudes(x: FloatArray) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Return max, sqrt2_rms and mean, (n_orbit, n_sensor) each, of x (n_orbit, n_phase, n_sensor)."""
    size = np.abs(x)
    top = np.argmax(size, axis=1)[:, None, :]
    left, peak, right = (np.take_along_axis(size, (top + shift) % x.shape[1], axis=1)[:, 0, :] for shift in (-1, 0, 1))
    curvature = 2.0 * peak - left - right
    rise = np.divide((right - left) ** 2, 8.0 * curvature, out=np.zeros_like(peak), where=curvature > 0.0)
    return peak + rise, np.sqrt(2.0 * np.mean(x**2, axis=1)), np.mean(x, axis=1)
