"""Settings out of range are refused where they are made, before anything runs with them."""

from __future__ import annotations

from collections.abc import Callable

import pytest

import fem
from fem.arc_length import PathSettings


@pytest.mark.parametrize(
    ("make", "name"),
    [
        (lambda: fem.StaticSettings(steps=0), "steps"),
        (lambda: fem.StaticSettings(steps=-1), "steps"),
        (lambda: fem.StaticSettings(max_iterations=0), "max_iterations"),
        (lambda: fem.StaticSettings(cuts=-1), "cuts"),
        (lambda: fem.StaticSettings(tolerance=float("nan")), "tolerance"),
        (lambda: PathSettings(step=0.0), "step"),
        (lambda: PathSettings(max_iterations=0), "max_iterations"),
        (lambda: fem.TransientSettings(1e-4, depth=0), "depth"),
        (lambda: fem.TransientSettings(1e-4, max_iterations=0), "max_iterations"),
        (lambda: fem.TransientSettings(1e-4, max_cutbacks=-1), "max_cutbacks"),
        (lambda: fem.TransientSettings(1e-4, tolerance=float("inf")), "tolerance"),
        (lambda: fem.StaticSettings(steps=2.5), "steps"),
        (lambda: fem.StaticSettings(steps=2.0), "steps"),
        (lambda: fem.StaticSettings(max_iterations=9.5), "max_iterations"),
        (lambda: fem.StaticSettings(cuts=0.5), "cuts"),
        (lambda: PathSettings(max_iterations=2.5), "max_iterations"),
        (lambda: PathSettings(max_steps=2.5), "max_steps"),
        (lambda: fem.TransientSettings(1e-4, depth=2.5), "depth"),
        (lambda: fem.TransientSettings(1e-4, max_doublings=0.5), "max_doublings"),
        (lambda: fem.TransientSettings(1e-4, corrected_modes=1.5), "corrected_modes"),
        (lambda: fem.graded([0.0, 1.0], [2.5]), "a cell count"),
    ],
)
def test_settings_out_of_range_are_refused(make: Callable[[], object], name: str) -> None:
    with pytest.raises(fem.FemInputError, match=f"{name} out of range") as caught:
        make()
    assert "; give a " in str(caught.value)
