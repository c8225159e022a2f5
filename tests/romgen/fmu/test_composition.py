"""The unit coupled with a controller: as an SSP in fmpy, and in a Python loop with rollback."""

from __future__ import annotations

import dataclasses
import importlib.util
import sys
import zipfile
from pathlib import Path
from types import ModuleType

import fmpy
import numpy as np
import pytest
from fmpy.ssp.simulation import simulate_ssp
from fmpy.ssp.ssd import read_ssv
from lxml import etree

from romgen.fmu.export import export_fmu
from romgen.fmu.records import FmuExport
from romgen.reduced_model import ReducedModel
from romgen.settings import FmuSettings
from tests.romgen.fmu.models import duffing_chain

EXAMPLE = Path(__file__).parents[3] / "models" / "coupled_feedback"


def load(name: str) -> ModuleType:
    spec = importlib.util.spec_from_file_location(f"coupled_feedback_{name}", EXAMPLE / f"{name}.py")
    module = importlib.util.module_from_spec(spec)
    sys.modules[spec.name] = module
    spec.loader.exec_module(module)
    return module


@pytest.fixture(scope="module")
def oscillator() -> ReducedModel:
    """z' = lambda z + 25 i z^2 conj z - i u, velocity -omega Im z: one mode at 70 Hz with 1 % damping."""
    change = {"inputs": ("base_acceleration",), "input_units": ("m/s2",), "input_matrix": np.array([[-1j]])}
    return dataclasses.replace(duffing_chain(1), **change)


@pytest.fixture(scope="module")
def unit(oscillator: ReducedModel, tmp_path_factory: pytest.TempPathFactory) -> FmuExport:
    """The oscillator as a unit."""
    return export_fmu(oscillator, tmp_path_factory.mktemp("coupled") / "oscillator.fmu", FmuSettings())


def closed_loop_eigenvalue(model: ReducedModel, gain: float) -> complex:
    """Of the motion about rest: z' = lambda z + g k v, v = Re(c z); eigenvalue with positive imaginary part.

    c from the linear chart y = (Re z, Re i z) and the velocity row v = omega y_2.
    """
    lam, g = complex(model.eigenvalues[0]), complex(model.input_matrix[0, 0])
    chart = model.chart.coefficients
    w = model.velocity.coefficients[0]
    c = w[0] * chart[0, 0] + w[1] * chart[1, 0]
    A = np.array([[lam.real, -lam.imag], [lam.imag, lam.real]])
    B = np.array([[g.real], [g.imag]])
    C = np.array([[c.real, -c.imag]])
    return max(np.linalg.eigvals(A + gain * B @ C), key=lambda e: e.imag)


def measured_eigenvalue(z: np.ndarray, step: float) -> complex:
    """Mean growth and frequency over whole periods: least squares of log z against time."""
    t = step * np.arange(len(z))
    return complex(np.polyfit(t, np.log(np.abs(z)), 1)[0], np.polyfit(t, np.unwrap(np.angle(z)), 1)[0])


def test_iterated_feedback_has_the_eigenvalue_of_the_closed_loop(unit: FmuExport, oscillator: ReducedModel) -> None:
    """With rollback the error in the growth rate is of second order in the step, without it of first order."""
    rollback = load("rollback")
    gain = -0.02
    exact = closed_loop_eigenvalue(oscillator, gain)
    z0 = np.array([1e-4 + 0j])

    def end(step: float, iterations: int) -> np.ndarray:
        return rollback.coupled(Path(unit.path), z0, lambda t, v: gain * v, (step, round(0.02 / step)), iterations)[-1]

    assert abs(exact.real - oscillator.eigenvalues[0].real) > 1.0  # the feedback is felt
    steps = np.array([4e-4, 2e-4, 1e-4])
    reference = end(6.25e-6, 20)
    for iterations, order in ((20, 2.0), (0, 1.0)):
        errors = [np.abs(end(float(h), iterations) - reference).max() for h in steps]
        assert np.polyfit(np.log(steps), np.log(errors), 1)[0] == pytest.approx(order, abs=0.25)
    n = 2000
    x = rollback.coupled(Path(unit.path), z0, lambda t, v: gain * v, (5e-5, n))
    measured = measured_eigenvalue(x[:, 0] + 1j * x[:, 1], 5e-5)
    assert measured.real == pytest.approx(exact.real, rel=0.02)
    assert measured.imag == pytest.approx(exact.imag, rel=1e-3)


def test_the_ssp_is_valid_and_its_feedback_damps(unit: FmuExport, oscillator: ReducedModel, tmp_path: Path) -> None:
    """After the burst the closed loop decays at the rate of its eigenvalue, the open loop at that of the structure."""
    gain = -0.05
    values = {"controller.gain": gain, "controller.burst_level": 0.05, "controller.burst_frequency": 70.0,
              "controller.burst_end": 0.02}  # fmt: skip
    ssp = load("make_ssp").make_ssp(Path(unit.path), "mass_1", tmp_path / "x.ssp", values)
    schemas = Path(fmpy.__file__).parent / "ssp" / "schema"
    with zipfile.ZipFile(ssp) as archive:
        for file, schema in (
            ("SystemStructure.ssd", "SystemStructureDescription.xsd"),
            ("closed.ssv", "SystemStructureParameterValues.xsd"),
            ("open.ssv", "SystemStructureParameterValues.xsd"),
        ):
            etree.XMLSchema(file=str(schemas / schema)).assertValid(etree.fromstring(archive.read(file)))
        archive.extractall(tmp_path)
    rates = {}
    for name in ("open", "closed"):
        parameters = read_ssv(str(tmp_path / f"{name}.ssv"))
        result = simulate_ssp(str(ssp), stop_time=0.3, step_size=2e-5, parameter_set=parameters)
        late = result["time"] > 0.05
        x = result["structure.mass_1_displacement"][late]
        envelope = np.hypot(x, result["structure.mass_1_velocity"][late] / oscillator.eigenvalues[0].imag)
        rates[name] = np.polyfit(result["time"][late], np.log(envelope), 1)[0]
    assert rates["open"] == pytest.approx(oscillator.eigenvalues[0].real, rel=0.02)
    # the loop is two steps late: a phase of omega 4e-5 s = 0.018 and little else
    assert rates["closed"] == pytest.approx(closed_loop_eigenvalue(oscillator, gain).real, rel=0.05)
    assert abs(rates["closed"] - rates["open"]) > 1.0
