"""The example of motion in time in docs/finite_elements.md runs and gives what modal superposition gives."""

from __future__ import annotations

import re
from pathlib import Path
from typing import Any

import numpy as np
from scipy.integrate import solve_ivp

from fem.modes import damping_ratios

PAGE = Path(__file__).parents[2] / "docs" / "finite_elements.md"


def test_motion_in_time_of_the_manual() -> None:
    """Tip less base = sum of the modes under the pulse and -M b u_0''(t); 2 %: four modes, steps of 0.1 ms.

    What the shaker and the hammer give is found in the ledger.
    """
    block = re.search(r"## Motion in time\n.*?```python\n(.*?)```", PAGE.read_text(encoding="utf-8"), re.DOTALL)
    assert block is not None
    assert len(block.group(1).splitlines()) <= 30
    names: dict[str, Any] = {}
    exec(block.group(1), names)
    model, modes, rows, seen = (names[key] for key in ("model", "modes", "rows", "seen"))
    loads = modes.shapes.T @ np.column_stack([names["hammer"].pattern, -(model.mass @ model.direction("y"))])
    zeta = damping_ratios(modes, names["damping"])

    def rate(t: float, y: np.ndarray) -> np.ndarray:
        force = loads @ [names["pulse"](t), 1e-4 * 300.0**2 * np.cos(300.0 * t)]
        return np.concatenate([y[4:], force - 2.0 * zeta * modes.omega * y[4:] - modes.omega**2 * y[:4]])

    exact = solve_ivp(rate, (0.0, seen.t[-1]), np.zeros(8), t_eval=seen.t, rtol=1e-8, atol=1e-12, max_step=1e-4)
    relative = seen.displacement[:, 0, 0] - 1e-4 * (1.0 - np.cos(300.0 * seen.t))
    tip = (rows @ modes.shapes @ exact.y[:4])[0]
    assert np.abs(relative - tip).max() < 0.02 * np.abs(tip).max()
    assert np.abs(seen.imbalance).max() < 0.02 * np.abs(seen.external).max()
