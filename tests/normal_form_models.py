"""Reduced models written down from known normal forms: no learning between the formula and the test."""

from __future__ import annotations

import tomllib
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import scipy.io

from romgen.arrays import ComplexArray, FloatArray, IntArray
from romgen.polynomial import PolynomialMap
from romgen.reduced_model import ReducedModel

ROOT = Path(__file__).parents[1]
PUBLISHED_ORDER_5 = ROOT.parent / "shared" / "data" / "trc_published_order5.mat"
PUBLISHED_ORDER_7 = ROOT / "models" / "trc_published" / "normal_form_order7.toml"


def linear_charts(
    eigenvalues: ComplexArray,
    terms: PolynomialMap[np.complex128],
    load: ComplexArray,
    internal_resonance: tuple[int, ...] = (),
    trained: FloatArray | None = None,
) -> ReducedModel:
    """z_j = (x_j + i w_j) / 2, so that x_j = 2 Re z_j = z_j + conj z_j is the sensor of mode j; one load input (m,)."""
    m = eigenvalues.size
    unit: IntArray = np.eye(2 * m, dtype=np.int64)
    half = np.eye(m)
    chart = np.block([[2.0 * half, 0.0 * half], [-2j * half, 0.0 * half]]).astype(np.complex128)
    inverse = np.hstack([0.5 * half, 0.5j * half]).astype(np.complex128)
    first: PolynomialMap[np.float64] = PolynomialMap(unit, np.eye(m, 2 * m))
    return ReducedModel(
        name="known_normal_form",
        eigenvalues=eigenvalues,
        normal_form=terms,
        chart=PolynomialMap(unit, chart),
        inverse_chart=PolynomialMap(unit, inverse),
        scale=np.ones(2 * m),
        displacement=first,
        velocity=first,
        sensors=tuple(f"x{j + 1}" for j in range(m)),
        inputs=("load",),
        input_units=("N",),
        input_matrix=load[:, None],
        internal_resonance=internal_resonance,
        trained_amplitude=np.full(m, 1.0) if trained is None else trained,
    )


def damped_oscillator(damping: float, quadratic: float = 0.0, cubic: float = 0.0) -> ReducedModel:
    """x'' + damping x' + x + quadratic x^2 + cubic x^3 = u, exactly, with x = z + conj z and x' = lambda z + c.c.

    Eliminating x gives z' = lambda z + (u - quadratic x^2 - cubic x^3) / (lambda - conj lambda): all monomials.
    """
    eigenvalue = complex(-0.5 * damping, np.sqrt(1.0 - 0.25 * damping**2))
    share = 1.0 / (eigenvalue - eigenvalue.conjugate())
    E = np.array([[2, 0], [1, 1], [0, 2], [3, 0], [2, 1], [1, 2], [0, 3]])
    force = -np.concatenate([quadratic * np.array([1.0, 2.0, 1.0]), cubic * np.array([1.0, 3.0, 3.0, 1.0])])
    used = force != 0.0
    terms = PolynomialMap(E[used], (share * force[used])[None, :])
    return linear_charts(np.array([eigenvalue]), terms, np.array([share]), trained=np.array([4.0]))


def averaged_oscillator(gamma: complex, damping: float = 0.0) -> ReducedModel:
    """z' = lambda z + gamma z^2 conj z: the cubic normal form of an oscillator of unit frequency."""
    eigenvalue = complex(-0.5 * damping, np.sqrt(1.0 - 0.25 * damping**2))
    terms = PolynomialMap(np.array([[2, 1]]), np.array([[gamma]], dtype=np.complex128))
    return linear_charts(np.array([eigenvalue]), terms, np.array([-0.5j]), trained=np.array([2.0]))


def resonant_pair(a: float, damping_ratio: float, omega: float = 1.0) -> ReducedModel:
    """Averaged q1'' + w^2 q1 + 2 a q1 q2 = 0, q2'' + 4 w^2 q2 + a q1^2 = u with x = z + conj z (Nayfeh, Mook).

    z1' = lambda1 z1 + i (a / w) conj(z1) z2,   z2' = lambda2 z2 + i a / (4 w) z1^2 - i u / (4 w)
    """
    root = complex(-damping_ratio, np.sqrt(1.0 - damping_ratio**2))
    terms = PolynomialMap(
        np.array([[0, 1, 1, 0], [2, 0, 0, 0]]), np.array([[1j * a / omega, 0.0], [0.0, 0.25j * a / omega]])
    )
    load = np.array([0.0, -0.25j / omega])
    return linear_charts(omega * root * np.array([1.0, 2.0]), terms, load, (1, 2))


def published_order7(load: complex = 1.0) -> ReducedModel:
    """The normal form of Morsy et al. 2024, Appendix A1, driven on its first mode."""
    with PUBLISHED_ORDER_7.open("rb") as file:
        data = tomllib.load(file)
    rows: dict[tuple[int, ...], ComplexArray] = {}
    for row in data["row"]:
        for term in row["terms"]:
            column = rows.setdefault(tuple(term["exponents"]), np.zeros(2, dtype=np.complex128))
            column[row["mode"] - 1] = complex(*term["coefficient"])
    E, C = np.array(list(rows)), np.array(list(rows.values())).T
    return _from_table(E, C, load, tuple(data["internal_resonance"]), np.array(data["trained_amplitude"]))


def published_order5(load: complex = 1.0) -> ReducedModel:
    """The order-5 model published with the code of Morsy et al., driven on its first mode."""
    if not PUBLISHED_ORDER_5.exists():
        pytest.skip(f"reference data {PUBLISHED_ORDER_5.name} is not beside the repository")
    info: Any = scipy.io.loadmat(PUBLISHED_ORDER_5, squeeze_me=True, struct_as_record=False)["RDInfo"]
    E = np.asarray(info.conjugateDynamics.exponents, dtype=np.int64)
    C = np.asarray(info.conjugateDynamics.coefficients, dtype=np.complex128)
    return _from_table(E, C, load, (1, 2), np.array([0.33, 0.3]))


def _from_table(
    E: IntArray, C: ComplexArray, load: complex, resonance: tuple[int, ...], trained: FloatArray
) -> ReducedModel:
    linear = E.sum(axis=1) == 1
    eigenvalues = np.array([C[j, linear & (E[:, j] == 1)][0] for j in range(2)])
    terms = PolynomialMap(E[~linear], C[:, ~linear])
    return linear_charts(eigenvalues, terms, np.array([load, 0.0], dtype=np.complex128), resonance, trained)
