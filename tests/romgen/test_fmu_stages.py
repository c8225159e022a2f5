"""What the export takes from the study."""

from __future__ import annotations

from pathlib import Path

import pytest

from romgen.fmu.records import FmuLevels, LevelRow
from romgen.fmu_stages import _input_range, _part, with_fmi3
from romgen.settings import Study
from romgen.stage import table_content

LAB = {"files": ["a.csv"], "sensors": ["a"], "training": [0]}


def study(**tables: object) -> Study:
    """A study of recorded data; its file is not read."""
    return Study.model_validate({"study": {"name": "s"}, "data": LAB, **tables})


def test_inputs_range_as_far_as_the_forced_response_unless_the_study_says_more() -> None:
    one = ("base_acceleration",)
    assert _input_range(study(), one) == ()
    forced = {"levels": [2.0, 8.0]}
    assert _input_range(study(forced_response=forced), one) == ((-8.0, 8.0),)
    given = {"input_range": {"base_acceleration": ["-1 g", 30.0]}}
    assert _input_range(study(forced_response=forced, fmu=given), one) == ((-9.80665, 30.0),)
    assert _input_range(study(fmu=given), (*one, "shaker")) == ()
    assert _input_range(study(fmu=given), ()) == ()


def test_another_picture_is_another_export(tmp_path: Path) -> None:
    """Files count by their content, not by their name."""
    (tmp_path / "a.png").write_bytes(b"one")
    (tmp_path / "b.png").write_bytes(b"one")
    a, b = (table_content(study(fmu={"icon": str(tmp_path / name)}), "fmu") for name in ("a.png", "b.png"))
    assert a == b
    (tmp_path / "b.png").write_bytes(b"two")
    assert table_content(study(fmu={"icon": str(tmp_path / "b.png")}), "fmu") != a


def test_an_empty_range_is_no_range() -> None:
    assert _input_range(study(forced_response={"levels": [0.0]}), ("base_acceleration",)) == ()
    with pytest.raises(ValueError, match="unknown unit"):
        study(fmu={"input_range": {"base_acceleration": ["-1 kg", 1.0]}})


def test_progress_of_two_exports_is_one_bar() -> None:
    seen: list[float] = []
    for start, end in ((0.0, 0.5), (0.5, 1.0)):
        told = _part(lambda fraction, text: seen.append(fraction), start, end)
        told(0.0, "")
        told(1.0, "")
    assert seen == [0.0, 0.5, 0.5, 1.0]


def test_the_second_unit_is_judged_with_the_first() -> None:
    good, bad = LevelRow("L0", "a", 0.0, 0.0, 0.0), LevelRow("L1", "b", 1.0, 0.0, 0.1)
    two, three = FmuLevels((good,), (), ("n",)), FmuLevels((bad,), ("p",), ("n", "m"))
    both = with_fmi3(two, three)
    assert [(row.level, row.passed) for row in both.rows] == [("L0", True), ("L1 FMI 3.0", False)]
    assert (both.problems, both.notes, both.passed) == (("FMI 3.0: p",), ("n", "FMI 3.0: m"), False)
