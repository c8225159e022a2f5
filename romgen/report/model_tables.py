"""The reduced model in tables: spectrum, range and coefficients."""

from __future__ import annotations

import numpy as np

from romgen.arrays import FloatArray, IntArray
from romgen.reduced_model import ReducedModel
from romgen.report.blocks import TableBlock
from romgen.report.inputs import OrderTrial
from romgen.stability import Stability

_SUPERSCRIPT = str.maketrans("0123456789", "⁰¹²³⁴⁵⁶⁷⁸⁹")
_SUBSCRIPT = str.maketrans("0123456789", "₀₁₂₃₄₅₆₇₈₉")


def spectrum_table(model: ReducedModel) -> TableBlock:
    """Eigenvalues, frequencies, damping ratios and trained amplitudes of the master modes."""
    rows = tuple(
        (
            f"{k + 1}",
            f"{eigenvalue.real:.5g}",
            f"{eigenvalue.imag:.6g}",
            f"{eigenvalue.imag / (2 * np.pi):.4f}",
            f"{-100 * eigenvalue.real / abs(eigenvalue):.4f}",
            f"{model.trained_amplitude[k]:.4g}",
        )
        for k, eigenvalue in enumerate(model.eigenvalues)
    )
    header = ("mode", "Re λ [1/s]", "Im λ [1/s]", "frequency [Hz]", "damping ratio [%]", "trained |z| [1]")
    caption = (
        "Linear part and range of the reduced model. The trained |z| is the largest amplitude in the training motions; "
        "several modes are trained together up to the straight connections of what the motions reached."
    )
    return TableBlock(caption, header, rows)


def stability_table(tried: Stability) -> TableBlock:
    """Free motions from scaled boundaries of the trained range."""
    rows = tuple(
        (f"{factor:g}", f"{100 * share:.1f}", f"{rate:.3g}" if np.isfinite(rate) else "diverges")
        for factor, share, rate in zip(tried.factor, tried.share, tried.slowest_rate, strict=True)
    )
    caption = (
        f"Do free motions decay? {tried.starts} starts each on the boundary of the trained range (1) and beyond it, "
        f"run over two time constants of the slowest mode, whose linear rate is {tried.linear_rate:.3g} 1/s. Beyond 1 "
        "the model extrapolates: a share below 100 % there says how far it may be pushed."
    )
    return TableBlock(caption, ("distance of the start", "decaying [%]", "slowest mean decay rate [1/s]"), rows)


def monomial_text(exponents: IntArray) -> str:
    """The monomial z_1^a z_2^b conj(z_1)^c ... of one row of exponents, e.g. ``z₁² z̄₂``."""
    m = len(exponents) // 2
    names = [f"z{f'{j + 1}'.translate(_SUBSCRIPT)}" for j in range(m)]
    names += [f"z\u0304{f'{j + 1}'.translate(_SUBSCRIPT)}" for j in range(m)]
    powers = ["" if power == 1 else f"{power}".translate(_SUPERSCRIPT) for power in exponents]
    return " ".join(name + power for name, power, n in zip(names, powers, exponents, strict=True) if n)


def detuning(model: ReducedModel, j: int, exponents: IntArray) -> complex:
    """lambda_j - <k, lambda> in 1/s, small for a near-resonant monomial of row j (counted from 0)."""
    spectrum = np.concatenate([model.eigenvalues, model.eigenvalues.conj()])
    return complex(model.eigenvalues[j] - exponents @ spectrum)


def coefficient_table(model: ReducedModel, deviation: FloatArray | None) -> TableBlock:
    """Nonlinear terms of the normal form: coefficient, its standard error, and how near the term is to resonance.

    Parameters
    ----------
    model : the reduced model.
    deviation : (m, n_term) standard deviation of abs(coefficient) in 1/s, or None where it was not estimated.
    """
    values, rows = model.normal_form.coefficients, []
    for j, k in zip(*np.nonzero(values), strict=True):
        exponents = model.normal_form.exponents[k]
        coefficient = f"{values[j, k]:.5g}".strip("()")
        error = () if deviation is None else (f"{deviation[j, k]:.2g}",)
        delta = abs(detuning(model, int(j), exponents))
        share = 100.0 * delta / abs(model.eigenvalues[j])
        rows.append(
            (
                f"{j + 1}",
                monomial_text(exponents),
                coefficient,
                *error,
                f"{delta:.4g}",
                f"{share:.2f}",
            )
        )
    errors = () if deviation is None else ("standard error [1/s]",)
    header = ("row", "term", "coefficient [1/s]", *errors, "detuning [1/s]", "of |λ| [%]")
    caption = (
        "Nonlinear terms kept in the normal form. Detuning is |λⱼ - ⟨k, λ⟩|: terms near resonance cannot be "
        "transformed away and carry the nonlinear frequency, damping and energy exchange."
    )
    return TableBlock(caption, header, tuple(rows))


def order_table(orders: tuple[OrderTrial, ...]) -> TableBlock:
    """Error against polynomial order, and which one was taken."""
    rows = tuple(
        (
            f"{trial.order}",
            f"{trial.error_percent:.3f}" if np.isfinite(trial.error_percent) else "no stable model",
            ", ".join(("chosen",) * trial.chosen + ("not stable in its range",) * (not trial.stable)),
        )
        for trial in orders
    )
    caption = "Orders that were tried, judged by cross-validation inside the training motions alone."
    return TableBlock(caption, ("order", "mean NMTE of held-out blocks [%]", "verdict"), rows)
