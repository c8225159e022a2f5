"""The normal form in polar coordinates z_j = rho_j e^(i theta_j), printed as text or LaTeX."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from romgen.reduced_model import ReducedModel


@dataclass(frozen=True)
class _Term:
    """c rho^powers e^(i <angles, theta>) of rho_j'/rho_j + i theta_j'; angles all zero means amplitude only."""

    coefficient: complex
    powers: tuple[int, ...]
    angles: tuple[int, ...]


def polar_text(model: ReducedModel) -> str:
    """Return rho_j'/rho_j and theta_j' of all modes as plain text, one equation per line group.

    With z_j'/z_j = rho_j'/rho_j + i theta_j', a term c zeta^E of row j becomes c rho^(a + b) / rho_j times
    e^(i <a - b, theta> - i theta_j), a and b its powers of z and conj z.
    """
    return "\n".join(_equation(model, j, part, latex=False) for part in ("Re", "Im") for j in range(_modes(model)))


def polar_latex(model: ReducedModel) -> str:
    """Return the same equations as ``polar_text`` as one LaTeX align environment."""
    lines = [_equation(model, j, part, latex=True) for part in ("Re", "Im") for j in range(_modes(model))]
    return "\\begin{align}\n" + " \\\\\n".join(lines) + "\n\\end{align}"


def _modes(model: ReducedModel) -> int:
    return len(model.eigenvalues)


def _terms(model: ReducedModel, j: int) -> list[_Term]:
    m = _modes(model)
    terms = [_Term(complex(model.eigenvalues[j]), (0,) * m, (0,) * m)]
    own = np.eye(m, dtype=np.int64)[j]
    nf = model.normal_form
    for row, coefficient in zip(nf.exponents, nf.coefficients[j], strict=True):
        if coefficient != 0:
            powers, angles = row[:m] + row[m:] - own, row[:m] - row[m:] - own
            terms.append(_Term(complex(coefficient), tuple(powers.tolist()), tuple(angles.tolist())))
    return sorted(terms, key=lambda term: any(term.angles))


def _equation(model: ReducedModel, j: int, part: str, latex: bool) -> str:
    number = j + 1
    if part == "Re":
        left = rf"\dot{{\rho}}_{{{number}}}\rho_{{{number}}}^{{-1}}" if latex else f"rho{number}'/rho{number}"
    else:
        left = rf"\dot{{\theta}}_{{{number}}}" if latex else f"theta{number}'"
    pieces = [_piece(term, part, latex) for term in _terms(model, j)]
    return f"{left} {'&' if latex else ''}= " + ("\\\\\n&\\quad " if latex else "\n    ").join(pieces)


def _piece(term: _Term, part: str, latex: bool) -> str:
    factor = _product(term.powers, latex)
    if not any(term.angles):
        value = term.coefficient.real if part == "Re" else term.coefficient.imag
        return f"{value:+.6g}{factor}"
    c = f"({term.coefficient.real:.6g}{term.coefficient.imag:+.6g}i)"
    angle = "".join(_angle(n, k + 1, latex) for k, n in enumerate(term.angles) if n)
    if latex:
        return rf"+\mathrm{{{part}}}\left({c}{factor} e^{{i({angle.strip()})}}\right)"
    return f"+{part}({c}{factor} exp(i({angle.strip()})))"


def _product(powers: tuple[int, ...], latex: bool) -> str:
    factors = []
    for k, power in enumerate(powers, start=1):
        if power:
            base = rf"\rho_{{{k}}}" if latex else f"rho{k}"
            exponent = "" if power == 1 else (f"^{{{power}}}" if latex else f"^{power}")
            factors.append(base + exponent)
    return "".join(f" {factor}" for factor in factors)


def _angle(n: int, k: int, latex: bool) -> str:
    sign = "+" if n > 0 else "-"
    size = "" if abs(n) == 1 else str(abs(n))
    return f" {sign}{size}" + (rf"\theta_{{{k}}}" if latex else f"{' ' if size else ''}theta{k}")
