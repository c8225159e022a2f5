"""Stages: what is stored is reused, what changed is computed, a killed stage continues, fallbacks are kept."""

from __future__ import annotations

import logging
import time
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import pytest

from romgen.errors import InputError, NumericalError
from romgen.run_lock import locked
from romgen.runner import RunResult, execute
from romgen.settings import Study
from romgen.stage import Context, Stage, stage_keys, study_key
from tests.romgen.settings.conftest import STUDY


@dataclass(frozen=True)
class Number:
    value: float


def study(**tables: object) -> Study:
    return Study.model_validate({**STUDY, **tables})


class Recorder:
    """Toy stages first -> second -> third that remember their calls."""

    def __init__(self) -> None:
        self.calls: list[str] = []
        self.fail_after = 100
        self.stages = (
            Stage("first", Number, (), ("preload",), self.first),
            Stage("second", Number, ("first",), ("modes.count",), self.second, lambda study: (f"{study.name}.txt",)),
            Stage("third", Number, ("second",), ("learn",), self.third),
        )

    def first(self, context: Context) -> Number:
        self.calls.append("first")
        logging.getLogger("romgen.toy").warning("fell back to the slow solver")
        return Number(float(context.study.preload.steps))

    def second(self, context: Context) -> Number:
        self.calls.append("second")
        (context.run_dir / "small.txt").write_text("x")
        return Number(2 * context.record("first", Number).value)

    def third(self, context: Context) -> Number:
        self.calls.append("third")
        segments = context.segments()
        for k in range(len(segments), 5):
            if k >= self.fail_after:
                raise NumericalError("did not converge", where="third")
            segments.append(Number(float(k)))
            context.report((k + 1) / 5, f"segment {k}")
        return Number(sum(piece.value for piece in segments.load_all(Number)))

    def run(self, run_dir: Path, given: Study | None = None, **options: object) -> RunResult:
        self.calls.clear()
        return execute(self.stages, given or study(), run_dir, **options)  # type: ignore[arg-type]  # forwarded


def test_second_run_recomputes_nothing(tmp_path: Path) -> None:
    toy = Recorder()
    first = toy.run(tmp_path)
    assert first.computed == ("first", "second", "third")
    again = toy.run(tmp_path)
    assert toy.calls == []
    assert again.reused == ("first", "second", "third")
    assert again.infos == first.infos
    assert again.context.record("third", Number) == Number(10.0)


@pytest.mark.parametrize(
    ("tables", "expected"),
    [
        ({"preload": {"steps": 5}}, ["first", "second", "third"]),
        ({"modes": {"count": 7}}, ["second", "third"]),
        ({"modes": {"damping_ratio": [0.1, 0.1]}}, []),
        ({"learn": {"order": 3}}, ["third"]),
        ({"report": {"title": "New"}}, []),
    ],
)
def test_changed_table_recomputes_what_depends_on_it(
    tmp_path: Path, tables: dict[str, object], expected: list[str]
) -> None:
    toy = Recorder()
    toy.run(tmp_path)
    toy.run(tmp_path, study(**tables))
    assert toy.calls == expected


def test_until_force_and_missing_file(tmp_path: Path) -> None:
    toy = Recorder()
    assert toy.run(tmp_path, until="second").computed == ("first", "second")
    assert toy.run(tmp_path).computed == ("third",)
    assert list(toy.run(tmp_path, until="first").infos) == ["first", "second", "third"]
    assert list(toy.run(tmp_path, study(modes={"count": 7}), until="first").infos) == ["first"]
    assert toy.run(tmp_path, force=True).computed == ("first", "second", "third")
    (tmp_path / "small.txt").unlink()
    assert toy.run(tmp_path).computed == ("second",)
    with pytest.raises(InputError, match=r"no such stage; got fourth; stages are first, second, third"):
        toy.run(tmp_path, until="fourth")


def test_failed_stage_continues_after_its_last_segment(tmp_path: Path) -> None:
    toy = Recorder()
    toy.fail_after = 3
    with pytest.raises(NumericalError):
        toy.run(tmp_path)
    assert len(list(tmp_path.glob("segments/third/segment_*.h5"))) == 3
    toy.fail_after = 100
    fractions: list[float] = []

    class Watch:
        def started(self, stage: str) -> None: ...
        def finished(self, stage: str, wall_s: float, cached: bool) -> None: ...
        def update(self, fraction: float, text: str) -> None:
            fractions.append(fraction)

    result = toy.run(tmp_path, progress=Watch())
    assert toy.calls == ["third"]
    assert fractions == [0.8, 1.0]
    assert result.context.record("third", Number) == Number(10.0)
    assert not (tmp_path / "segments" / "third").exists()


def test_warnings_are_kept_with_the_stage_and_in_the_log(tmp_path: Path) -> None:
    toy = Recorder()
    toy.run(tmp_path)
    assert toy.run(tmp_path).infos["first"].messages == ("fell back to the slow solver",)
    log = (tmp_path / "run.log").read_text()
    assert "WARNING romgen.toy: fell back to the slow solver" in log
    assert "third: " in log


def test_damaged_results_are_said_and_computed_again(tmp_path: Path) -> None:
    toy = Recorder()
    assert toy.run(tmp_path).messages == ()
    content = (tmp_path / "result.h5").read_bytes()
    (tmp_path / "result.h5").write_bytes(content[: len(content) // 2])
    again = toy.run(tmp_path)
    assert again.computed == ("first", "second", "third")
    assert len(again.messages) == 1
    assert "moved to result.h5.damaged, its stages are computed again" in again.messages[0]


def test_time_and_memory_are_measured(tmp_path: Path) -> None:
    size, pause = 64 * 2**20, 0.2

    def hungry(context: Context) -> Number:
        block = np.ones(size // 8)
        time.sleep(pause)
        return Number(float(block[0]))

    stages = (Stage("idle", Number, (), (), lambda context: Number(0.0)), Stage("hungry", Number, (), (), hungry))
    infos = execute(stages, study(), tmp_path).infos
    assert pause <= infos["hungry"].wall_s < pause + 2.0
    assert infos["hungry"].peak_memory_bytes > size
    assert infos["idle"].wall_s < infos["hungry"].wall_s


def test_one_run_at_a_time(tmp_path: Path) -> None:
    with locked(tmp_path), pytest.raises(InputError, match="another romgen run works in this folder"):
        Recorder().run(tmp_path)
    assert Recorder().run(tmp_path).computed == ("first", "second", "third")


def test_data_files_count_by_content(tmp_path: Path) -> None:
    file = tmp_path / "a.csv"
    tables = {"study": {"name": "lab"}, "data": {"files": [str(file)], "sensors": ["a"], "training": [0]}}
    stages = (Stage("data", Number, (), ("data",), lambda context: Number(0.0)),)
    lab = Study.model_validate(tables)
    keys = []
    for text in ("1", "2", "1"):
        file.write_text(text)
        keys.append((stage_keys(stages, lab)["data"], study_key(lab)))
    assert keys[0] == keys[2] != keys[1]
    file.unlink()
    with pytest.raises(InputError, match="cannot be read"):
        study_key(lab)
