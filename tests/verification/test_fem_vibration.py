"""Modes against closed forms: bar with its convergence rate, slender beam, V11 beam under axial force."""

from __future__ import annotations

import numpy as np
import pytest

from fem.material import Material
from fem.model import Body, Clamp, Model, Support, build_model
from fem.modes import solve_modes
from fem.preload import StaticSettings, solve_static
from tests.fem.small_models import box

E, RHO = 200e9, 7800.0
SOLVER = "superlu"


def _omega(model: Model, count: int, *, steps: int = 1) -> np.ndarray:
    rest = solve_static(model, model.load, StaticSettings(steps=steps, tolerance=1e-7, solver=SOLVER))
    return solve_modes(model, rest, count, solver=SOLVER).omega


def _bar(element: str, n: int) -> np.ndarray:
    """Relative frequency errors of the first two axial modes of a fixed-free bar of ``n`` cells."""
    L = 1.0
    sides = [Support(f"bar.{axis}_{end}", (axis,)) for axis in "yz" for end in ("min", "max")]
    bar = Body("bar", box((L, 0.1, 0.1), (n, 1, 1), element), Material(E, 0.0, RHO))
    omega = _omega(build_model([bar], supports=[Support("bar.x_min", ("x", "y", "z")), *sides]), 2)
    exact = np.pi / (2.0 * L) * np.sqrt(E / RHO) * np.array([1.0, 3.0])
    return np.asarray(omega / exact - 1.0)


@pytest.mark.parametrize("element", ["hex20", "hex27", "tet10"])
def test_bar_frequencies_converge_with_the_fourth_power_of_h(element: str) -> None:
    """V-bar: omega_k = (2k - 1) pi c / (2L); quadratic elements err by C h^4, from above.

    Rate 4 +/- 0.3: the next term is h^6, which on these meshes adds up to log2(1 + 0.2) to the rate.
    """
    errors = np.array([_bar(element, n) for n in (4, 8)])
    assert np.all(errors > 0.0)
    rates = np.log2(errors[0] / errors[1])
    assert rates == pytest.approx([4.0, 4.0], abs=0.3)
    assert errors[1, 0] < 2e-6


@pytest.mark.parametrize("element", ["hex20", "hex27"])
def test_slender_cantilever_has_the_frequency_of_euler_and_bernoulli(element: str) -> None:
    """V-beam: omega_1 = 1.8751^2 sqrt(EI/(rho A L^4)) at L/h = 50.

    Rotary inertia and shear (E/(kG) = 2.4) lower it by 4.65 (1 + 2.4)/2 (h/L)^2/12 = 2.6e-4; the mesh raises it by as
    much. Tolerance 3e-4.
    """
    L, h = 1.0, 0.02
    beam = Body("beam", box((L, h, 2.0 * h), (20, 1, 1), element), Material(E, 0.0, RHO))
    model = build_model([beam], supports=[Support("beam.x_min", ("x", "y", "z"))])
    exact = 1.8751040687**2 * np.sqrt(E * h**2 / 12.0 / RHO) / L**2
    assert _omega(model, 1)[0] == pytest.approx(exact, rel=3e-4)


@pytest.mark.parametrize(("ratio", "expected"), [(1.0, 1.41421), (-0.5, 0.70711)])
def test_v11_axial_force_shifts_the_frequency(ratio: float, expected: float) -> None:
    """V11: pinned-pinned beam, f/f_0 = sqrt(1 + N/N_cr); 1 % as in the manual (half model, L/h = 50)."""
    half, h = 0.5, 0.02
    critical = np.pi**2 * E * h**4 / 12.0 / (2.0 * half) ** 2
    beam = Body("beam", box((half, h, h), (6, 1, 1)), Material(E, 0.0, RHO))
    # Symmetry at x = 0; the end face cannot move across but turns freely: a pin that slides along the beam.
    supports = [Support("beam.x_min", ("x",)), Support("beam.x_max", ("y",)), Support("beam.z_min", ("z",))]
    omega = [
        _omega(build_model([beam], supports=supports, clamps=[Clamp("pull", "beam.x_max", -N)]), 1)[0]
        for N in (0.0, ratio * critical)
    ]
    assert omega[1] / omega[0] == pytest.approx(expected, rel=0.01)
    assert omega[0] == pytest.approx((np.pi / (2.0 * half)) ** 2 * np.sqrt(E * h**2 / 12.0 / RHO), rel=0.005)
