"""The check finds agreement, and disagreement."""

from __future__ import annotations

import dataclasses
from pathlib import Path

import numpy as np
import pytest

from romgen.errors import InputError
from romgen.fmu.check import check_fmu
from romgen.fmu.driver import replay
from romgen.fmu.export import export_fmu
from romgen.fmu.python_export import export_pythonfmu
from romgen.fmu.records import FmuExport
from romgen.polynomial import PolynomialMap
from romgen.reduced_model import ReducedModel
from romgen.settings import FmuSettings
from romgen.simulate import sensors, simulate
from tests.romgen.fmu.models import duffing_chain, random_model


def test_both_units_agree_with_their_model(native: FmuExport, pythonfmu_unit: FmuExport, model: ReducedModel) -> None:
    check = check_fmu(native.path, model, FmuSettings(), pythonfmu=pythonfmu_unit.path, n_step=200)
    assert check.fmpy_problems == check.pythonfmu_problems == ()
    assert 0.0 < check.native_vs_python_rel <= 1e-12
    assert check.pythonfmu_vs_python_rel is not None
    assert check.pythonfmu_vs_python_rel <= 1e-12


def test_a_unit_of_another_model_is_found_out(native: FmuExport, model: ReducedModel) -> None:
    """One sensor off by a relative 1e-8 shows as exactly that, far above round-off."""
    other = model.displacement.coefficients.copy()
    other[1] *= 1.0 + 1e-8
    changed = dataclasses.replace(model, displacement=PolynomialMap(model.displacement.exponents, other))
    check = check_fmu(native.path, changed, FmuSettings(), n_step=200)
    assert check.native_vs_python_rel == pytest.approx(1e-8, rel=1e-5)


def test_a_replay_rebuilds_a_ring_down_at_irregular_times(native: FmuExport, model: ReducedModel) -> None:
    t = np.cumsum(np.random.default_rng(4).uniform(2e-5, 4e-4, 300))
    z0 = 0.5 * model.trained_amplitude.astype(np.complex128)
    run = replay(native.path, t, z0)
    displacement, velocity = sensors(model, simulate(model, t, z0))
    np.testing.assert_allclose(run.displacement, displacement, rtol=0, atol=1e-12 * np.abs(displacement).max())
    np.testing.assert_allclose(run.velocity, velocity, rtol=0, atol=1e-12 * np.abs(velocity).max())
    # 0.7 of abs(z_1) = 0.5 and 0.8 of abs(z_2) = 0.4
    assert run.trust_ratio[0] == pytest.approx(0.67, rel=1e-15)


def test_a_source_only_unit_cannot_be_replayed(model: ReducedModel, tmp_path: Path) -> None:
    export_fmu(model, tmp_path / "x.fmu", FmuSettings(platforms=()))
    with pytest.raises(InputError, match="cannot be instantiated"):
        replay(tmp_path / "x.fmu", np.arange(3.0), np.zeros(2, dtype=complex))


@pytest.mark.parametrize(
    ("change", "message"),
    [
        ({"name": "a panel"}, "identifier"),
        ({"trained_amplitude": np.array([1.0, 0.0])}, "never excited"),
        ({"eigenvalues": np.array([-1.0 + 0j, -1.0 + 3j])}, "oscillate"),
        ({"input_matrix": np.full((2, 1), np.nan + 0j)}, "finite"),
    ],
)
def test_a_model_that_cannot_be_exported_is_refused(change: dict[str, object], message: str, tmp_path: Path) -> None:
    with pytest.raises(InputError, match=message):
        export_fmu(dataclasses.replace(random_model(2), **change), tmp_path / "x.fmu", FmuSettings())


def test_an_unknown_sensor_is_refused(model: ReducedModel, tmp_path: Path) -> None:
    with pytest.raises(InputError, match="nowhere"):
        export_fmu(model, tmp_path / "x.fmu", FmuSettings(sensors=("nowhere",)))


@pytest.mark.parametrize("m", [1, 3])
def test_any_number_of_modes(m: int, tmp_path: Path) -> None:
    model = duffing_chain(m)
    export = export_fmu(model, tmp_path / "native.fmu", FmuSettings())
    python = export_pythonfmu(model, tmp_path / "python.fmu", FmuSettings())
    check = check_fmu(export.path, model, FmuSettings(), pythonfmu=python.path, n_step=200)
    assert check.fmpy_problems == check.pythonfmu_problems == ()
    assert check.native_vs_python_rel <= 1e-12
    assert check.pythonfmu_vs_python_rel is not None
    assert check.pythonfmu_vs_python_rel <= 1e-12


def test_a_small_free_decay_has_the_frequency_and_damping_of_its_eigenvalue(tmp_path: Path) -> None:
    """200 cycles at an amplitude whose cubic term shifts the frequency by 25e-12 / omega."""
    model = duffing_chain(1)
    export = export_fmu(model, tmp_path / "x.fmu", FmuSettings())
    lam = model.eigenvalues[0]
    t = np.arange(0.0, 200 * 2.0 * np.pi / lam.imag, 1e-3)
    run = replay(export.path, t, np.array([1e-6 + 0j]))
    z = run.state[:, 0] + 1j * run.state[:, 1]
    slope = np.log(np.abs(z[-1] / z[0])) / t[-1]
    phase = np.unwrap(np.angle(z))[-1] / t[-1]
    assert slope == pytest.approx(lam.real, rel=1e-8)
    assert phase == pytest.approx(lam.imag, rel=1e-8)
