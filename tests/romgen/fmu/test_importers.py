"""What importers are seen to do: a C program without Python, and what XML promises against what an instance answers."""

from __future__ import annotations

import subprocess
from collections.abc import Callable
from pathlib import Path

import pytest
from fmpy import read_model_description

from romgen.fmu.driver import Slave, opened_slave
from romgen.fmu.export import generated_sources
from romgen.fmu.model_file import model_resources
from romgen.fmu.records import FmuExport, InterfaceOptions
from romgen.reduced_model import ReducedModel
from tests.romgen.fmu.test_harness import C_FLAGS, HERE, SANITIZERS

LIBRARY = ("-fPIC", "-shared", "-o", "lib.so")


@pytest.mark.parametrize("in_file", [False, True])
def test_habits_of_importers_under_sanitizers(
    in_file: bool, model: ReducedModel, run_cc: Callable[..., None], tmp_path: Path
) -> None:
    """The location may be that of the resources or of the whole unit, as URI or path, with or without a slash."""
    options = InterfaceOptions(coefficients_in_file=in_file)
    content = {**generated_sources(model, "{g}", options), **model_resources(model, in_file=in_file)}
    for name, data in content.items():
        (tmp_path / name).parent.mkdir(exist_ok=True)
        (tmp_path / name).write_bytes(data)
    files = sorted(p.name for p in tmp_path.glob("*.c"))
    run_cc(*C_FLAGS, *SANITIZERS, *LIBRARY, *files, "-lm", folder=tmp_path)
    run_cc(*C_FLAGS, *SANITIZERS, "-I.", HERE / "importers.c", "-o", "importers", "-ldl", "-lm", folder=tmp_path)
    resources = tmp_path / "resources"
    for location in (resources.as_uri(), f"{resources}/", tmp_path.as_uri(), f"file:{tmp_path}/"):
        result = subprocess.run(
            [tmp_path / "importers", tmp_path / "lib.so"],
            env={"FMU_RESOURCES": location}, capture_output=True, text=True, check=False, timeout=60,
        )  # fmt: skip
        assert (result.returncode, result.stdout) == (0, "ok\n"), result.stderr


def test_an_instance_answers_with_the_start_values_of_the_description(slave: Slave, unpacked: Path) -> None:
    """Importers show the start values of the description before a run; an instance in initialisation has the same."""
    variables = [v for v in read_model_description(unpacked).modelVariables if v.start is not None and v.type == "Real"]
    assert {v.causality for v in variables} == {"local", "input", "parameter"}
    values = slave.fmu.getReal([v.valueReference for v in variables])
    expected = [float(v.start) for v in variables]
    constants = {"natural_frequency_1", "natural_frequency_2", "damping_ratio_1", "damping_ratio_2"}
    for v, value, start in zip(variables, values, expected, strict=True):
        assert value == (pytest.approx(start, rel=1e-15) if v.name in constants else start), v.name


def test_setting_every_start_value_again_changes_nothing(native: FmuExport) -> None:
    """Some importers set all of them before and in initialisation, each by itself."""
    ends = []
    for again in (False, True):
        with opened_slave(native.path) as slave:
            fmu = slave.fmu
            settable = [
                v
                for v in read_model_description(native.path).modelVariables
                if v.start is not None and v.type == "Real" and v.variability != "constant"
            ]
            fmu.setupExperiment(tolerance=1e-6, startTime=0.0, stopTime=1.0)
            for v in settable if again else ():
                fmu.setReal([v.valueReference], [float(v.start)])
            fmu.enterInitializationMode()
            for v in settable if again else ():
                fmu.setReal([v.valueReference], [float(v.start)])
            fmu.setReal(slave.references.states, [0.2, 0.1, 0.0, 0.1])
            fmu.exitInitializationMode()
            for k in range(10):
                fmu.doStep(k * 1e-4, 1e-4)
            ends.append(fmu.getReal([*slave.references.states, *slave.references.displacement]))
    assert ends[0] == ends[1]
