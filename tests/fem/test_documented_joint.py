"""The worked example of docs/finite_elements.md runs and gives what the text around it promises."""

from __future__ import annotations

import re
from pathlib import Path
from typing import Any

import pytest

PAGE = Path(__file__).parents[2] / "docs" / "finite_elements.md"


def test_bolted_joint_of_the_manual(capsys: pytest.CaptureFixture[str]) -> None:
    """Bolt and both interfaces at 9.1 kN after tightening; a pull along the joint changes the bolt force little."""
    block = re.search(r"## A bolted joint\n.*?```python\n(.*?)```", PAGE.read_text(encoding="utf-8"), re.DOTALL)
    assert block is not None
    names: dict[str, Any] = {}
    exec(block.group(1), names)
    assert len(block.group(1).splitlines()) <= 45
    model, state, loaded = names["locked"], names["state"], names["loaded"]
    assert model.bolts.forces(state.u)[0] == pytest.approx(9.1e3, rel=1e-6)
    assert names["joint"].normal_force == pytest.approx(9.1e3, rel=1e-4)
    assert names["under_head"].normal_force == pytest.approx(9.1e3, rel=1e-4)
    assert model.bolts.forces(loaded.u)[0] == pytest.approx(9.1e3, rel=0.1)
    assert capsys.readouterr().out.count("PenaltyReport") == 2
