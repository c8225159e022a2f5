"""The pythonfmu unit of the same model."""

from __future__ import annotations

import sys
from pathlib import Path

import numpy as np

from romgen.fmu.check import difference
from romgen.fmu.driver import fmpy_problems, opened_slave
from romgen.fmu.interface import build_interface
from romgen.fmu.python_export import export_pythonfmu
from romgen.fmu.records import FmuExport
from romgen.reduced_model import ReducedModel
from romgen.settings import FmuSettings
from tests.romgen.fmu.models import smooth_input

H = 1e-4


def test_fmpy_finds_no_problem(pythonfmu_unit: FmuExport) -> None:
    assert fmpy_problems(pythonfmu_unit.path) == ()


def test_it_follows_the_python_model(pythonfmu_unit: FmuExport, model: ReducedModel) -> None:
    t = H * np.arange(301)
    z0 = 0.6 * model.trained_amplitude.astype(np.complex128)
    assert difference(pythonfmu_unit.path, model, t, z0, smooth_input(len(t), H, 2)) <= 1e-12


def test_it_shows_the_same_values_as_the_native_unit(
    pythonfmu_unit: FmuExport, native: FmuExport, model: ReducedModel
) -> None:
    reals = [v.reference for v in build_interface(model).variables if v.unit]
    values = []
    for export in (native, pythonfmu_unit):
        with opened_slave(export.path) as slave:
            fmu, vr = slave.fmu, slave.references
            fmu.setupExperiment(startTime=0.0)
            fmu.setReal(vr.states, [0.3, 0.2, -0.1, 0.4])
            fmu.enterInitializationMode()
            fmu.setReal(vr.inputs, [3.0, -4.0])
            values.append(fmu.getReal(reals))
    np.testing.assert_allclose(values[1], values[0], rtol=1e-13, atol=1e-13)


def test_export_is_repeatable_and_leaves_no_import_state(
    pythonfmu_unit: FmuExport, model: ReducedModel, tmp_path: Path
) -> None:
    path, modules = list(sys.path), set(sys.modules)
    again = export_pythonfmu(model, tmp_path / "again.fmu", FmuSettings())
    assert again.sha256 == pythonfmu_unit.sha256
    assert sys.path == path
    assert not [name for name in set(sys.modules) - modules if name.endswith("_slave")]
