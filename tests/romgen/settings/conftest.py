"""A small valid study and its shipped relatives."""

import copy
from pathlib import Path
from typing import Any

import pytest

ROOT = Path(__file__).parents[3]

BLOCK = {
    "material": "steel",
    "x": [0.0, 1.0],
    "cells_x": [2],
    "y": [0.0, 0.1],
    "cells_y": [1],
    "z": [0.0, 0.2],
    "cells_z": [1],
}
STUDY: dict[str, Any] = {
    "study": {"name": "small"},
    "materials": {"steel": {"young_modulus": 2.1e11, "poisson_ratio": 0.3, "density": 7850.0}},
    "blocks": {"bar": BLOCK, "base": {**BLOCK, "y": [-0.1, 0.0]}},
    "contacts": {"joint": {"slave": "bar.y_min", "master": "base.y_max", "friction": 0.3}},
    "constraints": [{"surface": "base.y_min", "directions": ["x", "y", "z"]}],
    "loads": [{"name": "bolt", "surface": "bar.y_max", "total_force": 1e3}],
    "sensors": {"tip": {"point": [1.0, 0.05, 0.1], "direction": "y"}},
    "base_acceleration": {"direction": "y"},
    "ringdowns": {
        "time_step": 1e-4,
        "duration": 0.1,
        "training": [{"name": "a", "amplitudes": [1e-3, 0.0]}],
        "validation": [{"name": "b", "amplitudes": [1e-3, 1e-3]}],
    },
    "forced_response": {"levels": [1.0], "sensor": "tip"},
}


@pytest.fixture
def tables() -> dict[str, Any]:
    """Tables of a valid study, free to be edited."""
    return copy.deepcopy(STUDY)
