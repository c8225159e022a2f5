"""Confidence limits of frequency and damping along a backbone, from the replicates of its coefficients."""

from __future__ import annotations

from dataclasses import dataclass, field, replace

import numpy as np
from scipy.stats import t as student

from romgen.arrays import FloatArray
from romgen.backbone import Backbone, normal_motion
from romgen.jackknife import Replicates, effective_blocks, jackknife_deviation
from romgen.polynomial import PolynomialMap
from romgen.reduced_model import ReducedModel

LEVEL = 0.95


@dataclass(frozen=True)
class ConfidenceBand:
    """Pointwise limits g -+ t s at the amplitudes rho of a backbone, s the jackknife deviation of g.

    t is Student's quantile of the level for the degrees of freedom of ``jackknife.effective_blocks``. Only the spread
    of Lambda and N between blocks of training data counts; the amplitude in sensors is taken as exact. nan where a
    replicate has no such motion.

    Attributes
    ----------
    level : probability that the limits are meant to enclose the truth.
    frequency_hz : (n, 2) lower and upper limit.
    damping_ratio : (n, 2) lower and upper limit.
    """

    level: float
    frequency_hz: FloatArray = field(metadata={"unit": "Hz", "axes": "point,limit"})
    damping_ratio: FloatArray = field(metadata={"unit": "1", "axes": "point,limit"})


def confidence_band(
    model: ReducedModel, curve: Backbone, replicates: Replicates, level: float = LEVEL
) -> ConfidenceBand:
    """Return the limits along a backbone; every replicate is followed at the same amplitudes.

    Parameters
    ----------
    model : of the backbone; replicates : of its Lambda and N.
    """
    rates = np.full((len(replicates.eigenvalues), curve.rho.size), np.nan, dtype=np.complex128)
    for row, eigenvalues, N in zip(rates, replicates.eigenvalues, replicates.normal_form, strict=True):
        other = replace(model, eigenvalues=eigenvalues, normal_form=PolynomialMap(model.normal_form.exponents, N))
        rate = normal_motion(other, curve.mode, curve.slaved, curve.rho)[1]
        row[: rate.size] = rate

    def limits(values: FloatArray, others: FloatArray) -> FloatArray:
        half = student.ppf(0.5 + 0.5 * level, effective_blocks(others)) * jackknife_deviation(others)
        return np.column_stack([values - half, values + half])

    return ConfidenceBand(
        level=level,
        frequency_hz=limits(curve.frequency_hz, rates.imag / (2.0 * np.pi)),
        damping_ratio=limits(curve.damping_ratio, -rates.real / rates.imag),
    )
