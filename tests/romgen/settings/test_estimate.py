"""Size estimate: node counts are exact, cost grows as stated."""

from __future__ import annotations

from typing import Any

import pytest

from romgen.settings import Study, estimate
from romgen.settings.estimate import BASE_MEMORY_BYTES, block_nodes
from romgen.settings.finite_elements import BlockSettings


def block(n: tuple[int, int, int]) -> BlockSettings:
    axes = {axis: [0.0, 1.0] for axis in "xyz"} | {f"cells_{axis}": [k] for axis, k in zip("xyz", n, strict=True)}
    return BlockSettings.model_validate({"material": "steel", **axes})


def test_nodes_of_hex20_blocks() -> None:
    assert block_nodes(block((1, 1, 1))) == 20
    assert block_nodes(block((2, 1, 1))) == 20 + 12  # one shared face of 8 nodes
    assert block_nodes(block((3, 2, 2))) == 4 * 3 * 3 + 3 * 9 + 4 * 2 * 3 + 4 * 3 * 2


def test_cost_grows_with_size_and_steps(tables: dict[str, Any]) -> None:
    small = estimate(Study.model_validate(tables))
    tables["ringdowns"]["duration"] *= 2
    longer = estimate(Study.model_validate(tables))
    tables["blocks"]["bar"]["cells_x"] = [200]
    larger = estimate(Study.model_validate(tables))
    assert small is not None
    assert longer is not None
    assert larger is not None
    assert longer.wall_s == pytest.approx(2 * small.wall_s)
    assert BASE_MEMORY_BYTES < small.memory_bytes < longer.memory_bytes < larger.memory_bytes
    assert larger.wall_s / longer.wall_s == pytest.approx((larger.dofs / small.dofs) ** (4 / 3))


def test_data_needs_no_estimate() -> None:
    data = {"files": ["a"], "sensors": ["a"], "training": [0]}
    assert estimate(Study.model_validate({"study": {"name": "lab"}, "data": data})) is None
