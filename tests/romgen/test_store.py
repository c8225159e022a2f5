"""Any record survives a round trip; every kind of damaged or foreign file is a StoreError."""

from __future__ import annotations

from dataclasses import dataclass, field
from pathlib import Path

import h5py
import numpy as np
import pytest

from romgen.arrays import BoolArray, ComplexArray, FloatArray, IntArray
from romgen.errors import StoreError
from romgen.polynomial import PolynomialMap
from romgen.reduced_model import ReducedModel
from romgen.store import CHECKSUM_BYTES, read_file, replace_atomically, write_file, write_record
from romgen.structure import EnergyLedger, RingDown, StepEffort
from romgen.trajectory import Trajectory
from tests.records import example_model, same


@dataclass(frozen=True)
class Part:
    name: str
    mass: float


@dataclass(frozen=True)
class Everything:
    matrix: FloatArray = field(metadata={"unit": "m", "axes": "time,sensor"})
    spectrum: ComplexArray
    counts: IntArray
    closed: BoolArray
    absent: FloatArray | None
    given: FloatArray | None
    empty: FloatArray
    text: str
    flag: bool
    number: int
    factor: float
    eigenvalue: complex
    place: Path
    missing: float
    names: tuple[str, ...]
    pair: tuple[int, float]
    nothing: tuple[str, ...]
    parts: tuple[Part, ...]
    order: int | str
    resonance: tuple[int, ...] | str
    part: Part | None
    errors: dict[str, float]
    nested: dict[str, Part]
    unset: dict[str, str]
    map: PolynomialMap[np.complex128]


def everything() -> Everything:
    rng = np.random.default_rng(3)
    return Everything(
        matrix=rng.normal(size=(400, 3)),
        spectrum=rng.normal(size=4) + 1j * rng.normal(size=4),
        counts=np.arange(5),
        closed=np.array([True, False]),
        absent=None,
        given=np.ones(3),
        empty=np.zeros((0, 3)),
        text="Grüße\nzwei",
        flag=True,
        number=-7,
        factor=0.1,
        eigenvalue=-3.2 + 694.1j,
        place=Path("runs") / "a b",
        missing=float("nan"),
        names=("lower", "mid"),
        pair=(1, 2.5),
        nothing=(),
        parts=(Part("a", 1.0), Part("b", 2.0)),
        order="auto",
        resonance=(1, 2),
        part=Part("c", 3.0),
        errors={"mixed": 1.5, "with/slash": 2.5},
        nested={"d": Part("d", 4.0)},
        unset={},
        map=PolynomialMap(np.array([[1, 0], [0, 1]]), np.array([[1j, 2.0]])),
    )


def test_round_trip(tmp_path: Path) -> None:
    record = everything()
    write_file(tmp_path / "all.h5", record)
    again = read_file(tmp_path / "all.h5", Everything)
    assert same(record, again)
    assert type(again.number) is int
    assert type(again.flag) is bool
    assert not again.matrix.flags.writeable


def test_records_of_the_package(tmp_path: Path) -> None:
    model = example_model()
    write_file(tmp_path / "model.h5", model)
    assert same(model, read_file(tmp_path / "model.h5", ReducedModel))
    t = np.linspace(0.0, 1.0, 5)
    trajectory = Trajectory(
        "a", t, ("mid",), t[:, None], snapshots=np.ones((2, 6), np.float32), snapshot_index=np.array([0, 4])
    )
    effort = StepEffort(*(k * np.arange(5) for k in range(3)))
    ring_down = RingDown(trajectory, EnergyLedger(*(k * t for k in range(7))), np.arange(5), effort)
    write_file(tmp_path / "ring.h5", ring_down)
    assert same(ring_down, read_file(tmp_path / "ring.h5", RingDown))


def test_units_and_axes_are_attributes(tmp_path: Path) -> None:
    write_file(tmp_path / "all.h5", everything())
    with h5py.File(tmp_path / "all.h5") as file:
        assert dict(file["record/matrix"].attrs) == {"unit": "m", "axes": "time,sensor"}


def test_what_has_no_place_is_refused(tmp_path: Path) -> None:
    with h5py.File(tmp_path / "a.h5", "w") as file, pytest.raises(StoreError, match=r"cannot be stored.*object"):
        write_record(file, Part("a", object()))  # type: ignore[arg-type]  # the wrong type is the point


@pytest.mark.parametrize("kept", [0.0, 0.3, 0.6, 0.99])
def test_truncated_file(tmp_path: Path, kept: float) -> None:
    path = tmp_path / "all.h5"
    write_file(path, everything())
    path.write_bytes(path.read_bytes()[: int(kept * path.stat().st_size)])
    with pytest.raises(StoreError, match="truncated, damaged or not HDF5"):
        read_file(path, Everything)


def test_damaged_bytes(tmp_path: Path) -> None:
    path, record = tmp_path / "all.h5", everything()
    assert record.matrix.nbytes > CHECKSUM_BYTES
    write_file(path, record)
    content = path.read_bytes()
    where = content.index(record.matrix.tobytes()[:64]) + 32
    path.write_bytes(content[:where] + bytes([content[where] ^ 1]) + content[where + 1 :])
    with pytest.raises(StoreError, match="damaged"):
        read_file(path, Everything)


def test_foreign_files(tmp_path: Path) -> None:
    with pytest.raises(StoreError, match="no such file"):
        read_file(tmp_path / "gone.h5", Part)
    (tmp_path / "text.h5").write_text("not HDF5")
    with pytest.raises(StoreError, match="not HDF5"):
        read_file(tmp_path / "text.h5", Part)
    with h5py.File(tmp_path / "other.h5", "w") as file:
        file["x"] = 1.0
    with pytest.raises(StoreError, match="not a romgen file"):
        read_file(tmp_path / "other.h5", Part)


def test_other_record_schema_or_field(tmp_path: Path) -> None:
    path = tmp_path / "part.h5"
    write_file(path, Part("a", 1.0))
    with pytest.raises(StoreError, match=r"holds no Everything.*got Part"):
        read_file(path, Everything)
    with h5py.File(path, "a") as file:
        del file["record/mass"]
    with pytest.raises(StoreError, match="field 'mass' of Part is missing"):
        read_file(path, Part)
    with h5py.File(path, "a") as file:
        file["record"].attrs["schema_version"] = 99
    with pytest.raises(StoreError, match="written with schema 99"):
        read_file(path, Part)


def test_failed_write_keeps_the_old_file(tmp_path: Path) -> None:
    path = tmp_path / "part.h5"
    write_file(path, Part("a", 1.0))
    with pytest.raises(StoreError):
        write_file(path, Part("b", object()))  # type: ignore[arg-type]  # the wrong type is the point
    assert read_file(path, Part) == Part("a", 1.0)
    assert [file.name for file in tmp_path.iterdir()] == ["part.h5"]


def test_replacement_is_not_seen_before_it_is_complete(tmp_path: Path) -> None:
    path = tmp_path / "index.json"
    path.write_text("old")

    def write(temporary: Path) -> None:
        temporary.write_text("new")
        assert path.read_text() == "old"

    replace_atomically(path, write)
    assert path.read_text() == "new"


@dataclass(frozen=True)
class Grown:
    name: str
    mass: float
    colour: str | None = None


def test_a_field_with_default_may_be_absent_from_an_older_file(tmp_path: Path) -> None:
    path = tmp_path / "part.h5"
    write_file(path, Grown("a", 1.0, "red"))
    assert read_file(path, Grown).colour == "red"
    with h5py.File(path, "a") as file:
        del file["record/colour"]
    assert read_file(path, Grown) == Grown("a", 1.0, None)
