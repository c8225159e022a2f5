"""Equal bodies pressed together and pushed sideways: V16 stick zone of Cattaneo and Mindlin, V17 energy per cycle."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
import pytest

from fem.material import Material
from fem.mesh import Mesh
from fem.model import Body, Model, Pair, Support, build_model
from fem.preload import StaticSettings, StaticState, solve_static
from tests.verification.hertz_models import cap, graded_line, polar_cap

RADIUS, YOUNG, NU, MU = 10e-3, 200e9, 0.3, 0.5
A = 0.150554e-3
STRIP = 0.25 * A
PLANE_MODULUS = YOUNG / (2.0 * (1.0 - NU**2))
SHEAR = YOUNG / (2.0 * (1.0 + NU))


@dataclass(frozen=True)
class Bench:
    """Two equal bodies of radius 10 mm, the far face of the lower one fixed, that of the upper one moved."""

    model: Model
    spheres: bool

    def moved(self, sideways: float, down: float, start: StaticState | None = None, steps: int = 1) -> StaticState:
        """The state with the far face of the upper body at (sideways, -down) m."""
        top = np.unique(self.model.facets("upper.y_max"))
        prescribed = np.zeros((len(self.model.points), 3))
        prescribed[top, :2] = sideways, -down
        driven = replace(self.model, prescribed=prescribed.ravel())
        return solve_static(driven, driven.load, StaticSettings(steps=steps), start=start)

    def forces(self, state: StaticState) -> tuple[float, float]:
        """Normal force P and tangential force Q of the whole contact; N for spheres, N/m for cylinders."""
        contact = self.model.contact
        traction = state.contact.traction[:, 0].reshape(-1, 3)
        total = np.einsum("g,gi,gij->j", contact.area, traction, contact.frame)
        scale = 2.0 if self.spheres else 1.0 / STRIP
        return scale * abs(float(total[1])), scale * abs(float(total[0]))

    def radii(self, state: StaticState) -> tuple[float, float]:
        """Radii (half widths) of the contact and of its stuck part from their areas, m."""
        status, area = state.contact.status[:, 0], self.model.contact.area
        sums = np.array([area[status > 0].sum(), area[status == 1].sum()])
        values = np.sqrt(2.0 * sums / np.pi) if self.spheres else 0.5 * sums / STRIP
        return float(values[0]), float(values[1])


def _bench(*, spheres: bool, cells: int, size: float, coarse: int) -> Bench:
    """Halves z >= 0 of spheres, or plane-strain strips of cylinders; ``cells`` along 1.3 a, equal meshes."""

    def body(*, upward: bool) -> Mesh:
        line = graded_line(1.3 * A, cells, size, coarse)
        depth = graded_line(A, cells // 2, size, coarse)
        across = line if spheres else np.array([0.0, STRIP])
        return cap((np.concatenate([-line[:0:-1], line]), depth, across), RADIUS, across=spheres, upward=upward)

    steel = Material(YOUNG, NU, 7800.0)
    bodies = [
        Body("upper", body(upward=False), steel, "linear"),
        Body("lower", body(upward=True), steel, "linear"),
    ]
    # Ten times the modulus over the facet size: elastic slip of 0.5 % of the real one at r = 0.5.
    penalty = 10.0 * YOUNG * cells / (1.3 * A)
    faces = ("z_min",) if spheres else ("z_min", "z_max")
    supports = [Support(f"{name}.{face}", ("z",)) for name in ("upper", "lower") for face in faces]
    supports += [Support("lower.y_min", ("x", "y")), Support("upper.y_max", ("x", "y"))]
    pair = Pair("contact", "upper.y_min", "lower.y_max", MU, penalty, penalty)
    return Bench(build_model(bodies, pairs=[pair], supports=supports), spheres)


def test_v16_stick_width_of_cylinders() -> None:
    """V16, plane: c/a = sqrt(1 - Q/(mu P)) at about r = 0.25, 0.5, 0.75; 5 % (manual) of the Hertz half width.

    The facet is 0.11 a, so a Gauss point is 0.04 a: both widths come in such steps.
    """
    bench = _bench(spheres=False, cells=12, size=2e-3, coarse=6)
    state = bench.moved(0.0, 9.1e-6)
    seen = []
    for sideways in (2e-6, 3.8e-6, 5.6e-6):
        state = bench.moved(sideways, 9.1e-6, state)
        normal, shear = bench.forces(state)
        hertz = np.sqrt(4.0 * normal * 0.5 * RADIUS / (np.pi * PLANE_MODULUS))
        a, c = bench.radii(state)
        ratio = shear / (MU * normal)
        seen.append(ratio)
        assert a == pytest.approx(hertz, rel=0.05)
        assert c / hertz == pytest.approx(np.sqrt(1.0 - ratio), abs=0.05)
    assert seen == pytest.approx([0.25, 0.5, 0.75], abs=0.1)


def _energy(normal: float, ratio: float) -> float:
    """Work per cycle of +-Q at constant P, J: Johnson, Contact Mechanics, sec. 7.4 (9 mu^2 P^2 / 10 a ...)."""
    a = (3.0 * normal * 0.5 * RADIUS / (4.0 * PLANE_MODULUS)) ** (1.0 / 3.0)
    shape = 1.0 - (1.0 - ratio) ** (5 / 3) - 5.0 / 6.0 * ratio * (1.0 + (1.0 - ratio) ** (2 / 3))
    return 9.0 * (MU * normal) ** 2 / (10.0 * a) * 2.0 * (2.0 - NU) / SHEAR * shape


@pytest.mark.parametrize(("ratio", "energy"), [(0.25, 3.8308e-7), (0.5, 3.8772e-6), (0.75, 1.83346e-5)])
def test_v17_energy_is_that_of_masing_on_mindlins_curve(ratio: float, energy: float) -> None:
    """V17, semi-analytical: area of the Masing loop over Mindlin's virgin curve = closed form, 1e-10 (manual).

    delta(Q) = 3 mu P (2 - nu) / (8 G a) (1 - (1 - Q/mu P)^(2/3)) for both bodies together; Gauss quadrature after the
    substitution that makes the integrand a polynomial.
    """
    normal = 100.0
    a = (3.0 * normal * 0.5 * RADIUS / (4.0 * PLANE_MODULUS)) ** (1.0 / 3.0)
    limit = MU * normal
    unit = 3.0 * limit * (2.0 - NU) / (8.0 * SHEAR * a)
    # W = 4 Q delta(Q) - 8 int_0^Q delta dQ'; with 1 - Q'/limit = s^3 the integrand is a polynomial of degree 4 in s.
    s, w = np.polynomial.legendre.leggauss(6)
    low = (1.0 - ratio) ** (1 / 3)
    s = 0.5 * (1.0 + low) + 0.5 * (1.0 - low) * s
    area = 0.5 * (1.0 - low) * float(w @ (unit * (1.0 - s**2) * 3.0 * limit * s**2))
    force, shift = ratio * limit, unit * (1.0 - low**2)
    loop = 4.0 * force * shift - 8.0 * area
    assert loop == pytest.approx(_energy(normal, ratio), rel=1e-10)
    assert _energy(normal, ratio) == pytest.approx(energy, rel=2e-5)


DEPTH = (0.0, 0.12, 0.26, 0.45, 0.8, 1.4, 2.5, 4.6, 8.0, 13.3)
"""Layers below the contact in a. Thinner ones make the iterations of the thin rings cycle between stick and slip."""


def _polar_bench(fine: tuple[float, float], cells: int) -> Bench:
    """Spheres on polar meshes with ``cells`` rings between the radii ``fine`` (in a), 0.8 a deep; the rest grows."""
    low, high = fine[0] * A, fine[1] * A
    first = np.array([0.45, 0.55, 0.7] if fine[0] > 0.7 else [0.42, 0.48]) * A
    width = (high - low) / cells
    steps = 1.6 * width * 1.9 ** np.arange(6)
    outer = high + (2e-3 - high) * np.cumsum(steps) / steps.sum()
    radii = np.concatenate([first, np.linspace(low, high, cells + 1), outer])
    depth = np.array(DEPTH) * A
    core = (0.33 if fine[0] > 0.7 else 0.29) * A
    steel = Material(YOUNG, NU, 7800.0)
    bodies = [
        Body(name, polar_cap(core, radii, depth, RADIUS, upward=name == "lower"), steel, "linear")
        for name in ("upper", "lower")
    ]
    supports = [Support(f"{name}.plane", ("z",)) for name in ("upper", "lower")]
    supports += [Support("lower.y_min", ("x", "y")), Support("upper.y_max", ("x", "y"))]
    # Ten times the modulus over the width of a fine ring, as in ``_bench``.
    penalty = 10.0 * YOUNG / width
    pair = Pair("contact", "upper.y_min", "lower.y_max", MU, penalty, penalty, reach=5e-6)
    return Bench(build_model(bodies, pairs=[pair], supports=supports), spheres=True)


@pytest.mark.slow
@pytest.mark.parametrize(
    ("fine", "cells", "sideways", "aim"),
    [((0.86, 1.04), 5, 0.55e-6, 0.25), ((0.55, 1.04), 6, 1.1e-6, 0.5), ((0.55, 1.04), 6, 1.64e-6, 0.75)],
)
def test_v16_v17_spheres(fine: tuple[float, float], cells: int, sideways: float, aim: float) -> None:
    """V16 and V17 on spheres, P = 100 N: c/a = (1 - r)^(1/3) to 5 %, work per cycle of +-Q to 10 % (manual).

    Rings are fine where the sliding zone lies, 0.036 a or 0.08 a. The second half of the cycle mirrors the first.
    """
    bench, down = _polar_bench(fine, cells), 4.39e-6
    state = bench.moved(sideways, down, bench.moved(0.0, down))
    normal, shear = bench.forces(state)
    hertz = (3.0 * normal * 0.5 * RADIUS / (4.0 * PLANE_MODULUS)) ** (1.0 / 3.0)
    ratio = shear / (MU * normal)
    assert normal == pytest.approx(100.0, rel=0.02)
    assert ratio == pytest.approx(aim, abs=0.05)
    contact, stuck = bench.radii(state)
    assert contact == pytest.approx(hertz, rel=0.05)
    assert stuck / hertz == pytest.approx((1.0 - ratio) ** (1 / 3), rel=0.05)
    state = bench.moved(-sideways, down, state, steps=2)
    assert state.dissipated is not None
    # Half of the spheres and half of the cycle.
    work = 4.0 * float(state.dissipated @ bench.model.contact.area)
    normal, shear = bench.forces(state)
    assert shear / (MU * normal) == pytest.approx(ratio, rel=0.02)
    assert work == pytest.approx(_energy(normal, shear / (MU * normal)), rel=0.10)
