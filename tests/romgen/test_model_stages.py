"""Ring-downs through segments: a march that is killed continues from its last restart state; data needs no mesh."""

from __future__ import annotations

import subprocess
import sys
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import pytest

from romgen import model_stages
from romgen.arrays import FloatArray
from romgen.errors import InputError
from romgen.model_stages import Recorded, RingDowns, read_data, recorded
from romgen.result_store import ResultStore
from romgen.runner import execute
from romgen.settings import Study
from romgen.stage import Context, Stage
from romgen.structure import EnergyLedger, Modes, Preload, RingDown, StepEffort
from romgen.trajectory import Trajectory
from romgen.trajectory_files import write_trajectories
from tests.romgen.settings.conftest import STUDY

ROOT = Path(__file__).parents[2]


@dataclass(frozen=True)
class Segment:
    """A fake segment: the step it ends with, and a restart state."""

    end: int
    state: FloatArray


class FakeElements:
    """Stands for romgen.fe_transients: counts steps instead of solving them."""

    Segment = Segment

    def __init__(self, fail_at: int | None = None) -> None:
        self.fail_at, self.starts = fail_at, []

    def march_ringdowns(
        self, study: Study, preload: Preload, modes: Modes, restart: Segment | None
    ) -> Iterator[Segment]:
        assert study.ringdowns is not None
        end = 0 if restart is None else restart.end
        state = np.zeros(3) if restart is None else restart.state
        self.starts.append(end)
        while end < study.ringdowns.steps:
            end += study.ringdowns.segment_steps
            if self.fail_at is not None and end > self.fail_at:
                raise KeyboardInterrupt
            state = state + 1.0
            yield Segment(end, state)

    def join_ringdowns(self, segments: tuple[Segment, ...], study: Study, modes: Modes) -> tuple[RingDown, ...]:
        assert study.ringdowns is not None
        assert [s.end for s in segments] == [250, 500, 750, 1000]
        assert np.array_equal(segments[-1].state, np.full(3, 4.0))
        t = np.linspace(0.0, 1.0, 3)
        ledger = EnergyLedger(*(np.zeros(3) for _ in range(7)))
        ones = np.ones(3, np.int64)
        return tuple(
            RingDown(Trajectory(start.name, t, ("tip",), t[:, None]), ledger, ones, StepEffort(ones, ones, ones))
            for start in study.ringdowns.starts
        )


def upstream() -> tuple[Stage, ...]:
    none = np.zeros(0)
    preload = Preload(none, (), none, none)
    modes = Modes(none, none, np.zeros((0, 0)), np.zeros((0, 0)), np.zeros((0, 0)), (), (), (), np.zeros((0, 0)), 0, 0)
    return (
        Stage("preload", Preload, (), (), lambda context: preload),
        Stage("modes", Modes, ("preload",), (), lambda context: modes),
        Stage("ringdowns", RingDowns, ("modes",), ("ringdowns",), model_stages.march_ringdowns),
    )


def test_killed_march_continues(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    study = Study.model_validate(STUDY)
    first, second = FakeElements(fail_at=600), FakeElements()
    monkeypatch.setattr(model_stages, "finite_elements", lambda module: first)
    with pytest.raises(KeyboardInterrupt):
        execute(upstream(), study, tmp_path)
    monkeypatch.setattr(model_stages, "finite_elements", lambda module: second)
    result = execute(upstream(), study, tmp_path)
    assert (first.starts, second.starts) == ([0], [500])
    ringdowns = result.context.record("ringdowns", RingDowns)
    assert [item.trajectory.name for item in ringdowns.training] == ["a"]
    assert [item.name for item in recorded(result.context).validation] == ["b"]


def data_context(folder: Path, **data: object) -> Context:
    t = np.linspace(0.0, 1.0, 11)
    motions = [
        Trajectory(name, t, ("p", "q"), np.outer(np.cos(3.0 * t), [1.0, k + 1.0])) for k, name in enumerate("abc")
    ]
    write_trajectories(folder / "motions.h5", motions)
    tables = {"files": [str(folder / "motions.h5")], "sensors": ["p", "q"], "training": [0], **data}
    study = Study.model_validate({"study": {"name": "lab"}, "data": tables})
    return Context(study, folder, ResultStore(folder), {})


def test_data_by_index_and_name(tmp_path: Path) -> None:
    found = read_data(data_context(tmp_path, training=["c", 0], validation=[1]))
    assert [item.name for item in found.training] == ["c", "a"]
    assert [item.name for item in found.validation] == ["b"]


def test_unknown_trajectory(tmp_path: Path) -> None:
    with pytest.raises(InputError, match="no such trajectory in the files; got 7; use 0 to 2 or a, b, c"):
        read_data(data_context(tmp_path, training=["c", 0], validation=[7]))


@pytest.mark.parametrize("suffix", [".h5", ".npz", ".mat", ".csv"])
@pytest.mark.parametrize("content", [b"", b"not one \xff", b"PK\x03\x04half"])
def test_damaged_data_file_is_one_line(tmp_path: Path, suffix: str, content: bytes) -> None:
    (tmp_path / f"a{suffix}").write_bytes(content)
    with pytest.raises(InputError, match=f"a{suffix}"):
        read_data(data_context(tmp_path, files=[str(tmp_path / f"a{suffix}")]))


def test_missing_finite_element_half_is_one_line(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(sys.modules, "romgen.fe_stages", None)
    monkeypatch.delattr("romgen.fe_stages", raising=False)
    with pytest.raises(InputError, match=r"pip install 'romgen\[fem\]'"):
        model_stages.finite_elements("fe_stages")


BLOCKED = """
import sys
class Blocker:
    def find_spec(self, name, path=None, target=None):
        if name.split(".")[0] in ("fem", "skfem", "meshio", "gmsh", "pyvista", "vtk"):
            raise ImportError(f"{name} is blocked")
sys.meta_path.insert(0, Blocker())
import romgen.cli.app, romgen.pipeline
print(sorted(name for name in sys.modules if name.split(".")[0] in ("fem", "skfem", "meshio")))
"""


def test_learning_half_imports_without_finite_elements() -> None:
    done = subprocess.run([sys.executable, "-c", BLOCKED], cwd=ROOT, capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stderr
    assert done.stdout.strip() == "[]"


def test_records_of_data_round_trip(tmp_path: Path) -> None:
    context = data_context(tmp_path)
    result = execute((Stage("data", Recorded, (), ("data",), read_data),), context.study, tmp_path / "run")
    again = ResultStore(result.run_dir).read("data", Recorded)
    assert [item.name for item in again.training] == ["a"]
