"""Stresses at nodes against a closed form and NAFEMS: Lame's cylinder, LE10."""

from __future__ import annotations

import numpy as np
import pytest

import fem

SETTINGS = fem.StaticSettings(1, 1e-9, 10, "superlu")


def _ring(
    inner: tuple[float, float], outer: tuple[float, float], height: float, cells: tuple[int, int, int], element: str
) -> fem.Mesh:
    """A quarter of a plate between two ellipses with the given semi-axes along x and y."""

    def bend(p: np.ndarray) -> np.ndarray:
        r, angle = p[:, 0], 0.5 * np.pi * p[:, 1]
        a, b = ((1.0 - r) * inner[k] + r * outer[k] for k in (0, 1))
        return np.column_stack([a * np.cos(angle), b * np.sin(angle), p[:, 2]])

    r = (np.linspace(0.0, 1.0, cells[0] + 1)) ** 1.5
    lines = [r, fem.graded([0.0, 1.0], [cells[1]]), fem.graded([0.0, height], [cells[2]])]
    return fem.hex_block(*lines, element=element, mapping=bend)


@pytest.mark.parametrize("element", ["hex20", "hex27", "tet10"])
def test_lame_cylinder_under_internal_pressure(element: str) -> None:
    """sigma_t = p a^2/(b^2 - a^2)(1 + b^2/r^2), sigma_r with the minus sign; plane strain, nodes at both radii.

    Stresses of quadratic elements extrapolated to the boundary err by O(h^2): 2 % of sigma_t at the bore here.
    """
    a, b, p = 0.1, 0.2, 1e6
    mesh = _ring((a, a), (b, b), 0.02, (8, 12, 1), element)
    supports = [fem.Support(f"tube.{side}", ("normal",)) for side in ("y_min", "y_max", "z_min", "z_max")]
    tube = fem.Body("tube", mesh, fem.Material(200e9, 0.3, 7800.0), "linear")
    model = fem.build_model([tube], supports=supports, loads=[fem.Pressure("oil", "tube.x_min", p)])
    stress = fem.nodal_stress(model, fem.solve_static(model, model.load, SETTINGS).u).cauchy
    peak = p * (b**2 + a**2) / (b**2 - a**2)
    for face, radius in (("x_min", a), ("x_max", b)):
        nodes = mesh.nodes(f"{face}&y_min")
        hoop = p * a**2 / (b**2 - a**2) * (1.0 + b**2 / radius**2)
        radial = p * a**2 / (b**2 - a**2) * (1.0 - b**2 / radius**2)
        np.testing.assert_allclose(stress[nodes, 1, 1], hoop, atol=0.02 * peak)
        np.testing.assert_allclose(stress[nodes, 0, 0], radial, atol=0.02 * peak)


@pytest.mark.parametrize(("element", "cells"), [("hex20", (6, 14, 6)), ("hex27", (6, 14, 4)), ("tet10", (8, 12, 4))])
def test_le10_thick_elliptic_plate(element: str, cells: tuple[int, int, int]) -> None:
    """NAFEMS LE10 (R0013, 1990): sigma_yy = -5.38 MPa at D, the upper inner corner on the x axis; 3 %.

    Pressure 1 MPa from above; the outer face is held in x and y, and in z along its middle line. The extrapolation to
    the corner is linear through the thickness where the stress is cubic: two layers of HEX20 give -5.87, four -5.58,
    six -5.47, eight -5.42 MPa.
    """
    mesh = _ring((2.0, 1.0), (3.25, 2.75), 0.6, cells, element)
    outer = set(mesh.nodes("x_max").tolist())
    on_line = np.array([k in outer for k in range(len(mesh.points))]) & (np.abs(mesh.points[:, 2] - 0.3) < 1e-9)
    mesh = mesh.with_region("line", lambda points: on_line)
    supports = [
        fem.Support("plate.y_min", ("y",)),
        fem.Support("plate.y_max", ("x",)),
        fem.Support("plate.x_max", ("x", "y")),
        fem.Support("plate.line", ("z",)),
    ]
    plate = fem.Body("plate", mesh, fem.Material(210e9, 0.3, 7800.0), "linear")
    model = fem.build_model([plate], supports=supports, loads=[fem.Pressure("top", "plate.z_max", 1e6)])
    stress = fem.nodal_stress(model, fem.solve_static(model, model.load, SETTINGS).u)
    (corner,) = mesh.nodes("x_min&y_min&z_max")
    assert mesh.points[corner] == pytest.approx([2.0, 0.0, 0.6], abs=1e-12)
    assert stress.cauchy[corner, 1, 1] == pytest.approx(-5.38e6, rel=0.03)
