"""The FMI 3.0 unit: valid, the numbers of the FMI 2.0 unit, arrays, inputs within the step, derivatives both ways."""

from __future__ import annotations

import ctypes
import re
import subprocess
import zipfile
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path

import fmpy
import numpy as np
import pytest
from fmpy import read_model_description
from fmpy.fmi1 import FMICallException
from fmpy.fmi3 import FMU3Model, FMU3Slave
from lxml import etree
from scipy.integrate import solve_ivp

from romgen.arrays import FloatArray
from romgen.fmu.driver import fmpy_problems, replay
from romgen.fmu.export3 import export_fmi3, generated_sources3
from romgen.fmu.records import FmuExport, InterfaceOptions
from romgen.fmu.templates import runtime_sources3
from romgen.reduced_model import ReducedModel
from romgen.settings import FmuSettings
from tests.romgen.fmu.conftest import STRICT
from tests.romgen.fmu.models import smooth_input

H = 1e-4
Z0 = [0.4, 0.1, -0.2, 0.3]


@pytest.fixture(scope="session")
def unit3(model: ReducedModel, tmp_path_factory: pytest.TempPathFactory) -> FmuExport:
    """The model as an FMI 3.0 unit for this machine."""
    return export_fmi3(model, tmp_path_factory.mktemp("fmi3") / "random_panel_fmi3.fmu", FmuSettings())


@pytest.fixture(scope="session")
def unpacked3(unit3: FmuExport, tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The unit as a folder."""
    folder = tmp_path_factory.mktemp("unpacked3")
    with zipfile.ZipFile(unit3.path) as archive:
        archive.extractall(folder)
    return folder


@contextmanager
def opened(unit: FmuExport, folder: Path, kind: type = FMU3Slave, **kwargs: object) -> Iterator[tuple]:
    """An instance and the value references by name."""
    description = read_model_description(unit.path)
    reference = {v.name: v.valueReference for v in description.modelVariables}
    fmu = kind(guid=description.guid, modelIdentifier="random_panel", unzipDirectory=str(folder), instanceName="one")
    fmu.instantiate(logMessage=lambda *_: None, **kwargs)
    try:
        yield fmu, reference
    finally:
        fmu.freeInstance()


def begin(fmu: FMU3Slave, reference: dict[str, int]) -> None:
    fmu.setFloat64([reference["z"]], Z0)
    fmu.enterInitializationMode(startTime=0.0)
    fmu.exitInitializationMode()


def test_fmpy_and_the_schemas_find_no_problem(unit3: FmuExport, unpacked3: Path) -> None:
    assert fmpy_problems(unit3.path) == ()
    schemas = Path(fmpy.__file__).parent / "schema" / "fmi3"
    for file, schema in (
        ("modelDescription.xml", "fmi3ModelDescription.xsd"),
        ("sources/buildDescription.xml", "fmi3BuildDescription.xsd"),
    ):
        etree.XMLSchema(file=str(schemas / schema)).assertValid(etree.parse(str(unpacked3 / file)))


def test_the_description_speaks_of_its_own_version(unpacked3: Path) -> None:
    text = (unpacked3 / "modelDescription.xml").read_text(encoding="utf-8")
    assert "intermediateUpdate" in text
    assert "fmi2" not in text


@pytest.mark.parametrize("options", [InterfaceOptions(), InterfaceOptions((), (1.0, 0.5, 0.0), True)])
def test_strict_c99_and_exactly_the_functions_of_the_standard(
    options: InterfaceOptions, model: ReducedModel, run_cc: Callable[..., None], tmp_path: Path
) -> None:
    for name, content in generated_sources3(model, "{g}", options).items():
        (tmp_path / name).write_bytes(content)
    files = sorted(p.name for p in tmp_path.glob("*.c"))
    strict = [flag for flag in STRICT if flag != "-Wstrict-prototypes"]  # which the header of the standard breaks
    run_cc(*strict, "-O2", "-fPIC", "-shared", "-fvisibility=hidden", "-o", "x.so", *files, "-lm", folder=tmp_path)
    table = subprocess.run(
        ["nm", "-D", "--defined-only", "x.so"], cwd=tmp_path, capture_output=True, text=True, check=True
    )
    declared = re.findall(r"FMI3_Export\s+\w+TYPE\s+(\w+);", runtime_sources3()["fmi3Functions.h"].decode())
    assert sorted(line.split()[-1] for line in table.stdout.splitlines()) == sorted(declared)
    assert len(declared) > 70


def test_the_same_motion_as_the_unit_of_fmi_2(
    unit3: FmuExport, unpacked3: Path, native: FmuExport, model: ReducedModel
) -> None:
    """Held input; the same kernel, so equal to the bit."""
    t = H * np.arange(201)
    u = smooth_input(len(t), H, 2)
    run = replay(native.path, t, np.array([0.4 + 0.1j, -0.2 + 0.3j]), u)
    with opened(unit3, unpacked3) as (fmu, reference):
        begin(fmu, reference)
        for k in range(len(t) - 1):
            fmu.setFloat64([reference["base_acceleration"], reference["shaker_force"]], u[k].tolist())
            fmu.doStep(float(t[k]), float(t[k + 1] - t[k]))
        assert fmu.getFloat64([reference["z"]], 4) == run.state[-1].tolist()
        assert fmu.getFloat64([reference["displacement"], reference["velocity"]], 6) == [
            *run.displacement[-1],
            *run.velocity[-1],
        ]
        assert fmu.getFloat64([reference["time"]])[0] == pytest.approx(t[-1], rel=1e-14)
        assert fmu.getBoolean([reference["inside_trust_region"]]) == [True]


def final_state(unit: FmuExport, folder: Path, n: int, end: float) -> FloatArray:
    """State after n steps with sinusoidal inputs given within each step."""

    def update(environment, time, set_requested, get_allowed, finished, can_return, early, early_time) -> None:
        if set_requested:
            give(time)

    with opened(unit, folder, intermediateUpdate=update) as (fmu, reference):
        loads = [reference["base_acceleration"], reference["shaker_force"]]

        def give(time: float) -> None:
            fmu.setFloat64(loads, [20.0 * np.sin(900.0 * time), 15.0 * np.cos(700.0 * time)])

        fmu.setFloat64([reference["max_internal_step"]], [1.0])
        begin(fmu, reference)
        for k in range(n):
            give(k * end / n)
            fmu.doStep(k * end / n, end / n)
        return np.array(fmu.getFloat64([reference["z"]], 4))


def test_inputs_given_within_the_step_are_of_fourth_order(unit3: FmuExport, unpacked3: Path) -> None:
    """One internal step per communication step; 8e-4 to 1e-4 s against 1.25e-5 s."""
    counts = np.array([32, 64, 128, 256])
    exact = final_state(unit3, unpacked3, 2048, 0.0256)
    errors = [np.abs(final_state(unit3, unpacked3, int(n), 0.0256) - exact).max() for n in counts]
    assert -np.polyfit(np.log(counts), np.log(errors), 1)[0] == pytest.approx(4.0, abs=0.25)


def test_model_exchange_equals_co_simulation(unit3: FmuExport, unpacked3: Path) -> None:
    """DOP853 through the Model Exchange functions against ETDRK4 with short internal steps, free motion."""
    end = 0.01
    with opened(unit3, unpacked3) as (fmu, reference):
        fmu.setFloat64([reference["max_internal_step"]], [5e-6])
        begin(fmu, reference)
        fmu.doStep(0.0, end)
        expected = np.array(fmu.getFloat64([reference["z"]], 4))
    with opened(unit3, unpacked3, FMU3Model) as (fmu, reference):
        begin(fmu, reference)
        fmu.updateDiscreteStates()
        fmu.enterContinuousTimeMode()
        x, rate = (ctypes.c_double * 4)(), (ctypes.c_double * 4)()

        def slope(time: float, state: FloatArray) -> list[float]:
            x[:] = state.tolist()
            fmu.setTime(time)
            fmu.setContinuousStates(x, 4)
            fmu.getContinuousStateDerivatives(rate, 4)
            return list(rate)

        z = solve_ivp(slope, (0.0, end), Z0, "DOP853", rtol=1e-12, atol=1e-13).y[:, -1]
    np.testing.assert_allclose(z, expected, atol=1e-9)


def test_adjoint_is_the_transposed_jacobian(unit3: FmuExport, unpacked3: Path) -> None:
    with opened(unit3, unpacked3) as (fmu, reference):
        begin(fmu, reference)
        unknowns = [reference["der_z"], reference["displacement"]]
        knowns = [reference["z"], reference["shaker_force"]]
        columns = [fmu.getDirectionalDerivative(unknowns, knowns, list(row), 7) for row in np.eye(5)]
        seed = np.random.default_rng(3).standard_normal(7)
        adjoint = fmu.getAdjointDerivative(unknowns, knowns, seed.tolist(), 5)
    np.testing.assert_allclose(adjoint, np.array(columns) @ seed, rtol=1e-13, atol=1e-12 * np.abs(columns).max())


def test_a_saved_state_replays_to_the_bit_and_misuse_is_refused(unit3: FmuExport, unpacked3: Path) -> None:
    with opened(unit3, unpacked3) as (fmu, reference):
        begin(fmu, reference)
        state = fmu.getFMUState()
        bytes_ = fmu.serializeFMUState(state)
        fmu.doStep(0.0, 50 * H)
        first = fmu.getFloat64([reference["z"]], 4)
        fmu.setFMUState(fmu.deserializeFMUState(bytes_))
        fmu.doStep(0.0, 50 * H)
        assert fmu.getFloat64([reference["z"]], 4) == first
        fmu.freeFMUState(state)
        for bad in (
            lambda: fmu.getFloat64([reference["z"] + 1], 1),
            lambda: fmu.getFloat64([reference["z"]], 3),
            lambda: fmu.setFloat64([reference["displacement"]], [0.0, 0.0, 0.0]),
            lambda: fmu.setFloat64([reference["shaker_force"]], [np.nan]),
            lambda: fmu.getInt32([0]),
            lambda: fmu.doStep(0.0, -H),
            lambda: fmu.enterEventMode(),
            lambda: fmu.enterStepMode(),
        ):
            with pytest.raises(FMICallException):
                bad()
        assert fmu.getFloat64([reference["z"]], 4) == first


def test_the_same_model_gives_the_same_bytes(unit3: FmuExport, model: ReducedModel, tmp_path: Path) -> None:
    assert export_fmi3(model, tmp_path / "again.fmu", FmuSettings()).sha256 == unit3.sha256
