"""Numbers, vectors and arrays that must be finite and have one shape: checked where a model or a run takes them."""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

from fem.arrays import FloatArray
from fem.errors import FemInputError


def finite_number(value: npt.ArrayLike, what: str, *, where: str) -> float:
    """One finite number; anything else raises ``FemInputError``."""
    return float(finite_array(value, (), what, where=where, advice="give one number"))


def finite_vector(value: npt.ArrayLike, what: str, *, where: str) -> FloatArray:
    """A vector (3,) of three finite numbers; anything else raises ``FemInputError``."""
    return finite_array(value, (3,), what, where=where, advice="give three numbers (x, y, z)")


def finite_array(
    value: npt.ArrayLike, shape: tuple[int, ...], what: str, *, where: str, advice: str = ""
) -> FloatArray:
    """Finite numbers of that shape, -1 in it for any length above 0; anything else raises ``FemInputError``."""
    array = as_numbers(value, what, where=where)
    fits = array.ndim == len(shape) and all(
        n == wanted or (wanted == -1 and n > 0) for n, wanted in zip(array.shape, shape, strict=True)
    )
    if not fits:
        seen: object = array.shape if array.size > 3 else value
        advice = advice or f"give an array of shape {str(shape).replace('-1', 'n')}"
        raise FemInputError(f"{what} has the wrong shape", where=where, value=seen, advice=advice)
    if not np.isfinite(array).all():
        shown = None if array.size > 3 else value
        raise FemInputError(f"{what} is not finite", where=where, value=shown, advice="check its numbers")
    return array


def as_numbers(value: npt.ArrayLike, what: str, *, where: str) -> FloatArray:
    """An array of floats of any shape; text and rows of unequal length raise ``FemInputError``."""
    try:
        return np.asarray(value, dtype=np.float64)
    except (TypeError, ValueError) as error:
        raise FemInputError(f"{what} is not made of numbers", where=where, value=repr(value)[:60]) from error


def check_rows(rows: npt.ArrayLike, n_dof: int, *, where: str) -> FloatArray:
    """Rows (n, n_dof) such as those of ``sensor_rows``, none allowed; anything else raises ``FemInputError``."""
    array = as_numbers(rows, "the table of sensors", where=where)
    if array.ndim != 2 or array.shape[1] != n_dof:
        advice = f"give rows of {n_dof} numbers, as sensor_rows does"
        raise FemInputError("the table of sensors has the wrong shape", where=where, value=array.shape, advice=advice)
    return array
