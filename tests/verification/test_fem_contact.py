"""Contact and friction: V13 patch test, preload resultant, V18 Jenkins loop, V19 Coulomb oscillator."""

from __future__ import annotations

import numpy as np
import pytest

from fem.equilibrium import InterfaceState, interface_states
from fem.friction import return_map
from fem.generalized_alpha import Scheme
from fem.material import Material
from fem.model import Body, Clamp, Model, Pair, Support, build_model
from fem.preload import StaticSettings, solve_static
from tests.fem.small_models import box, clamped_strip

E, STRETCH = 2e6, 0.95
PRESSURE = E * STRETCH * (1.0 - STRETCH**2) / 2.0


def _press(
    cells: tuple[int, int], element: str, *, kinematics: str = "green_lagrange", pressure: float = PRESSURE
) -> tuple[Model, np.ndarray, InterfaceState]:
    """Two unit cubes under the pressure that compresses both by 5 %; upper (slave) and lower cells per edge."""
    material = Material(E, 0.0, 1000.0)
    n, m = cells
    bodies = [
        Body("lower", box((1.0, 1.0, 1.0), (m, 1, m), element), material, kinematics),
        Body("upper", box((1.0, 1.0, 1.0), (n, 1, n), element, shift=1.0), material, kinematics),
    ]
    sides = [Support(f"{body}.{axis}_min", (axis,)) for body in ("lower", "upper") for axis in "xz"]
    model = build_model(
        bodies,
        pairs=[Pair("joint", "upper.y_min", "lower.y_max", 0.3)],
        supports=[Support("lower.y_min", ("y",)), *sides],
        clamps=[Clamp("press", "upper.y_max", pressure)],
    )
    state = solve_static(model, model.load, StaticSettings(steps=2, tolerance=1e-10, solver="superlu"))
    return model, state.u, interface_states(model, state.u, state.contact)[0]


@pytest.mark.parametrize("element", ["hex20", "hex27", "tet10"])
def test_v13_contact_patch_test_on_matching_meshes_is_exact(element: str) -> None:
    """V13: p = E lambda (1 - lambda^2)/2 = 92.6 kPa uniform, both cubes 5 % shorter; 1e-8 (solution)."""
    model, u, joint = _press((2, 2), element)
    assert pytest.approx(92.625e3) == PRESSURE
    np.testing.assert_allclose(joint.pressure, PRESSURE, rtol=1e-8)
    np.testing.assert_allclose(joint.traction, 0.0, atol=1e-8 * PRESSURE)
    moved = u.reshape(-1, 3)[:, 1]
    penetration = PRESSURE / model.contact.law[0, 0]
    for surface, expected in (("lower.y_max", -0.05), ("upper.y_min", -0.05 - penetration)):
        np.testing.assert_allclose(moved[np.unique(model.facets(surface))], expected, rtol=1e-8)


@pytest.mark.parametrize("cells", [(2, 3), (3, 2), (1, 4)])
@pytest.mark.parametrize("element", ["hex20", "hex27", "tet10"])
def test_v13_contact_patch_test_on_other_meshes_is_exact(element: str, cells: tuple[int, int]) -> None:
    """V13 on non-matching meshes: uniform pressure at every point and flat interfaces; 1e-8 (manual, mortar)."""
    model, u, joint = _press(cells, element)
    assert joint.normal_force == pytest.approx(PRESSURE, rel=1e-9)
    np.testing.assert_allclose(joint.pressure, PRESSURE, rtol=1e-8)
    moved = u.reshape(-1, 3)[:, 1]
    np.testing.assert_allclose(moved[np.unique(model.facets("lower.y_max"))], -0.05, rtol=1e-8)


def test_v13_with_linear_strain_on_other_meshes() -> None:
    """V13 with linear kinematics: p = 1.0e5 Pa for 5 % compression, uniform; 1e-8 (manual, mortar)."""
    model, u, joint = _press((2, 3), "hex20", kinematics="linear", pressure=1.0e5)
    np.testing.assert_allclose(joint.pressure, 1.0e5, rtol=1e-8)
    moved = u.reshape(-1, 3)[:, 1]
    np.testing.assert_allclose(moved[np.unique(model.facets("lower.y_max"))], -0.05, rtol=1e-8)


def test_preload_resultant_is_the_clamping_force() -> None:
    """V12 (interface resultant at zero load): both joints of the clamped strip carry the bolt force, 0.1 %."""
    model = clamped_strip(clamp=9.1e3)
    state = solve_static(model, model.load, StaticSettings(solver="superlu"))
    for joint in interface_states(model, state.u, state.contact):
        assert joint.normal_force == pytest.approx(9.1e3, rel=1e-3)
        assert joint.applied_force == pytest.approx(9.1e3, rel=1e-9)


def test_v18_jenkins_loop_dissipates_eight() -> None:
    """V18: k_t = 1, limit 1, stroke +-3: energy per cycle 4 * 1 * (3 - 1) = 8, stiffness 1 after reversal; 1e-12."""
    n = 60
    leg = np.linspace(3.0, -3.0, n + 1)
    path = np.concatenate([np.linspace(0.0, 3.0, n), leg, leg[::-1][1:]])
    slip, previous, energy, traction = 0.0, 0.0, 0.0, []
    for i, s in enumerate(path):
        _, t, _, slip, _, _ = return_map(-1.0, float(s), 0.0, previous, 0.0, 1.0, 1.0, 1.0)
        traction.append(t)
        if i >= n:
            energy += t * (slip - previous)
        previous = slip
    assert energy == pytest.approx(8.0, abs=1e-12)
    assert (traction[n + 1] - traction[n]) / (leg[1] - leg[0]) == pytest.approx(1.0, abs=1e-12)


def _coulomb_oscillator(h: float, n: int) -> np.ndarray:
    """x'' + x + friction = 0 from x = 1.05 at rest, limit 0.1, stick stiffness 1e4, by generalised-alpha."""
    scheme, kt = Scheme.from_radius(0.9), 1e4
    am, af, b, g = scheme.alpha_m, scheme.alpha_f, scheme.beta, scheme.gamma
    # Released at the limit of friction, as after being pulled there.
    u, v, slip = 1.05, 0.0, 1.05 + 0.1 / kt
    friction = -0.1
    a = -u - friction
    motion = [u]
    for _ in range(n):
        u0, new, old_f = u + h * v + h * h * (0.5 - b) * a, a, u + friction
        for _ in range(50):
            x = u0 + h * h * b * new
            _, t, _, moved, _, state = return_map(-1.0, x, 0.0, slip, 0.0, 1.0, kt, 0.1)
            residual = (1.0 - am) * new + am * a + (1.0 - af) * (x + t) + af * old_f
            if abs(residual) < 1e-12:
                break
            k = 1.0 + (kt if state == 1 else 0.0)
            new -= residual / ((1.0 - am) + (1.0 - af) * h * h * b * k)
        else:
            raise AssertionError("a step of the oscillator did not converge")
        u, v, a, slip, friction = x, v + h * ((1.0 - g) * a + g * new), new, moved, t
        motion.append(u)
    return np.array(motion)


def test_v19_coulomb_oscillator_turns_where_it_should() -> None:
    """V19: m = k = 1, F_f = 0.1, x_0 = 1.05: turns at -0.85, 0.65, -0.45, 0.25, -0.05, every pi, then sticks; 1e-3.

    The manual's tolerance; the stick spring adds F_f/k_t = 1e-5 per turn and the step errs by h^2/12.
    """
    h = 2e-3
    x = _coulomb_oscillator(h, round(6.0 * np.pi / h))
    for turn, expected in enumerate((1.05, -0.85, 0.65, -0.45, 0.25, -0.05)):
        assert x[round(turn * np.pi / h)] == pytest.approx(expected, abs=1e-3)
    np.testing.assert_allclose(x[round(5.1 * np.pi / h) :], -0.05, atol=1e-3)
