"""How to follow an equilibrium path."""

from __future__ import annotations

from dataclasses import dataclass

from fem.bounds import require, require_count


@dataclass(frozen=True)
class PathSettings:
    """First and largest arc length in load factor units (1 is the full load), tolerance, iterations, steps, solver.

    The arc length of a step is sqrt((du/u_s)^2 + dlambda^2). u_s is the length of the linear answer to the full load,
    or of the displacement so far where that is more: a column that buckles moves a thousand times as far as it is
    shortened, and steps counted in the shortening would creep. A step that turns by more than 45 degrees or ends far
    from its prediction is halved, since it may have changed to another path.
    """

    step: float = 0.1
    largest_step: float = 0.3
    smallest_step: float = 1e-6
    tolerance: float = 1e-8
    max_iterations: int = 12
    max_steps: int = 200
    solver: str = "auto"

    def __post_init__(self) -> None:
        require_count("path settings", "max_iterations", self.max_iterations, 1)
        require_count("path settings", "max_steps", self.max_steps, 1)
        for name in ("step", "largest_step", "smallest_step", "tolerance"):
            require("path settings", name, getattr(self, name), 0.0, above=True)
