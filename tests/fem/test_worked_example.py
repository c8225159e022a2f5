"""The example of docs/finite_elements.md runs and gives what beam theory gives."""

from __future__ import annotations

import re
from pathlib import Path

import numpy as np
import pytest

PAGE = Path(__file__).parents[2] / "docs" / "finite_elements.md"


def test_example_of_the_manual() -> None:
    """Euler-Bernoulli: P L^3/(3 EI) + q L^4/(8 EI), 1.8751^2 and 4.7300^2 sqrt(EI/(rho A L^4))/(2 pi).

    2 %: a clamp that hinders lateral strain and a strip four times as wide as high stiffen by up to nu^2 times the
    share of the root; Timoshenko's correction and the mesh are below 0.3 %.
    """
    code = re.findall(r"```python\n(.*?)```", PAGE.read_text(encoding="utf-8"), flags=re.DOTALL)[0]
    assert len([line for line in code.splitlines() if line.strip()]) <= 40
    names: dict[str, object] = {}
    exec(compile(code, str(PAGE), "exec"), names)
    E, rho, L, b, h = 210e9, 7850.0, 0.2, 0.02, 0.005
    inertia, weight = b * h**3 / 12.0, 9.81 * rho * b * h
    tip = -20.0 * L**3 / (3.0 * E * inertia) - weight * L**4 / (8.0 * E * inertia)
    assert names["tip"] == pytest.approx(tip, rel=0.02)
    base = np.sqrt(E * inertia / (rho * b * h)) / L**2 / (2.0 * np.pi)
    modes = names["modes"]
    assert modes.omega[0] / (2.0 * np.pi) == pytest.approx(1.8751**2 * base, rel=0.02)  # type: ignore[attr-defined]
    assert names["elastic"] == pytest.approx(4.7300**2 * base, rel=0.02)
    assert names["share"][0, 2] == pytest.approx(0.613, rel=0.02)  # type: ignore[index]
    assert names["root"] == pytest.approx((20.0 * L + weight * L**2 / 2.0) * h / 2.0 / inertia, rel=0.25)
