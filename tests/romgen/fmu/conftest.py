"""One native and one pythonfmu unit of the same random model for all tests of this folder."""

from __future__ import annotations

import shutil
import subprocess
import zipfile
from collections.abc import Callable, Iterator
from pathlib import Path

import pytest

from romgen.fmu.driver import Slave, opened_slave
from romgen.fmu.export import export_fmu
from romgen.fmu.python_export import export_pythonfmu
from romgen.fmu.records import FmuExport
from romgen.reduced_model import ReducedModel
from romgen.settings import FmuSettings
from tests.romgen.fmu.models import random_model

STRICT = ("-std=c99", "-Wall", "-Wextra", "-Wpedantic", "-Wconversion", "-Wshadow", "-Wstrict-prototypes", "-Werror")


@pytest.fixture(scope="session")
def model() -> ReducedModel:
    """Order 5, three sensors, two inputs."""
    return random_model(order=5, n_input=2)


@pytest.fixture(scope="session")
def native(model: ReducedModel, tmp_path_factory: pytest.TempPathFactory) -> FmuExport:
    """The model as a native unit for this machine."""
    return export_fmu(model, tmp_path_factory.mktemp("native") / "random_panel.fmu", FmuSettings())


@pytest.fixture(scope="session")
def pythonfmu_unit(model: ReducedModel, tmp_path_factory: pytest.TempPathFactory) -> FmuExport:
    """The model as a pythonfmu unit."""
    return export_pythonfmu(model, tmp_path_factory.mktemp("python") / "random_panel_python.fmu", FmuSettings())


@pytest.fixture(scope="session")
def unpacked(native: FmuExport, tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The native unit as a folder."""
    folder = tmp_path_factory.mktemp("unpacked")
    with zipfile.ZipFile(native.path) as archive:
        archive.extractall(folder)
    return folder


@pytest.fixture
def slave(native: FmuExport) -> Iterator[Slave]:
    """A fresh instance, in initialisation mode."""
    with opened_slave(native.path) as opened:
        opened.fmu.setupExperiment(startTime=0.0)
        opened.fmu.enterInitializationMode()
        yield opened


@pytest.fixture(scope="session")
def run_cc() -> Callable[..., None]:
    """Runs the host's C compiler, or skips the test where there is none."""
    program = next((p for p in (shutil.which("gcc"), shutil.which("cc"), shutil.which("clang")) if p), None)
    if program is None:
        pytest.skip("no host C compiler on the path")

    def run(*arguments: object, folder: Path) -> None:
        command = [program, *map(str, arguments)]
        result = subprocess.run(command, cwd=folder, capture_output=True, text=True, check=False)
        assert result.returncode == 0, result.stderr

    return run
