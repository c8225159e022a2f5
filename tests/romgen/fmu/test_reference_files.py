"""Reference results beside a unit: the unit reproduces them, and the files keep the rules they name."""

from __future__ import annotations

import csv
from pathlib import Path
from xml.etree import ElementTree

import fmpy
import numpy as np
import pytest
from lxml import etree

from romgen.errors import InputError
from romgen.fmu.driver import Hold, replay
from romgen.fmu.records import FmuExport
from romgen.fmu.reference_files import LS_REF, write_reference_files
from romgen.reduced_model import ReducedModel


def table(path: Path) -> tuple[list[str], np.ndarray]:
    with path.open() as file:
        rows = list(csv.reader(file))
    return rows[0], np.array(rows[1:], dtype=float)


@pytest.mark.parametrize("hold", ["linear", "constant"])
def test_the_unit_reproduces_its_references(native: FmuExport, model: ReducedModel, tmp_path: Path, hold: Hold) -> None:
    """The unit steps by 1e-5 s, the reference by 5e-6 s; 12 digits are printed."""
    write_reference_files(Path(native.path), tmp_path)
    folder = tmp_path / LS_REF
    _, inputs = table(folder / "input.csv")
    header, expected = table(folder / ("linear.csv" if hold == "linear" else "held.csv"))
    z0 = 0.3 * model.trained_amplitude.astype(complex)
    run = replay(native.path, inputs[:, 0], z0, inputs[:, 1:], hold=hold)
    every = len(inputs) // 1000
    columns = np.stack([run.displacement, run.velocity], axis=-1).reshape(len(inputs), -1)[::every]
    assert header[1:3] == ["lower_displacement", "lower_velocity"]
    np.testing.assert_allclose(columns, expected[:, 1:7], atol=1e-9 * np.abs(expected[:, 2]).max(), rtol=1e-9)


def test_the_cross_check_files_keep_the_rules(native: FmuExport, tmp_path: Path) -> None:
    files = write_reference_files(Path(native.path), tmp_path)
    assert {file.parts[-6] for file in files if "fmus" in file.parts} == {"cs", "me"}
    for file in files:
        if file.suffix == ".csv":
            assert file.stat().st_size < 1e6
            header, rows = table(file)
            assert header[0] == "time"
            assert len(header) <= 11
            assert np.all(np.diff(rows[:, 0]) >= 0.0)
            assert rows[-1, 0] == pytest.approx(0.02, rel=1e-9)
    (options,) = {file.read_text() for file in files if file.suffix == ".opt"}
    assert {line.split(",")[0] for line in options.split()} == {"StartTime", "StopTime", "StepSize", "RelTol"}


def test_the_layered_standard_names_files_that_exist(native: FmuExport, tmp_path: Path) -> None:
    write_reference_files(Path(native.path), tmp_path)
    folder = tmp_path / LS_REF
    named = [e.get("source") for f in ("fmi-ls-manifest.xml", "experiments.xml")
             for e in ElementTree.parse(folder / f).getroot().iter() if e.get("source")]  # fmt: skip
    assert len(named) == 10
    assert all((folder / name).is_file() for name in named)
    schema = Path(fmpy.__file__).parent / "ssp" / "schema" / "SystemStructureParameterValues.xsd"
    etree.XMLSchema(file=str(schema)).assertValid(etree.parse(str(folder / "start.ssv")))


def test_another_file_is_refused(tmp_path: Path, pythonfmu_unit: FmuExport) -> None:
    from romgen.fmu.archive import write_archive

    write_archive(tmp_path / "x.fmu", {"modelDescription.xml": b""})
    with pytest.raises(InputError, match="no reduced model"):
        write_reference_files(tmp_path / "x.fmu", tmp_path)
