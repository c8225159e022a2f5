"""The model equations in C against numpy, and their directional derivatives against the analytic Jacobian."""

from __future__ import annotations

import numpy as np

from romgen.arrays import ComplexArray, FloatArray
from romgen.fmu.driver import Slave
from romgen.fmu.interface import build_interface
from romgen.polynomial import evaluate, jacobian, zeta
from romgen.reduced_model import ReducedModel
from romgen.simulate import sensors
from tests.romgen.fmu.models import random_states

N_STATE = 4
KERNEL_LIMIT = 1e-13
DERIVATIVE_LIMIT = 1e-10


def references(model: ReducedModel, *starts: str) -> list[int]:
    """References of the Real variables whose name starts or ends with one of the words."""
    variables = build_interface(model).variables
    return [v.reference for v in variables if (v.unit and v.name.startswith(starts)) or v.name.endswith(starts)]


def set_point(slave: Slave, z: ComplexArray, u: FloatArray) -> None:
    slave.fmu.setReal(range(N_STATE), np.stack([z.real, z.imag], axis=-1).ravel().tolist())
    slave.fmu.setReal(slave.references.inputs, u.tolist())


def rate(model: ReducedModel, z: ComplexArray, u: FloatArray) -> FloatArray:
    """(2m,) re and im of z'."""
    total = model.eigenvalues * z + evaluate(model.normal_form, zeta(z[None]))[0] + model.input_matrix @ u
    return np.stack([total.real, total.imag], axis=-1).ravel()


def test_state_derivatives_and_outputs(slave: Slave, model: ReducedModel) -> None:
    rng = np.random.default_rng(5)
    rates = range(N_STATE, 2 * N_STATE)
    measured, expected = [], []
    for z in random_states(model, 1000):
        u = 30.0 * rng.standard_normal(2)
        set_point(slave, z, u)
        measured.append(slave.fmu.getReal([*rates, *slave.references.displacement, *slave.references.velocity]))
        displacement, velocity = sensors(model, z[None])
        expected.append([*rate(model, z, u), *displacement[0], *velocity[0]])
    error = np.max(np.abs(np.array(measured) - np.array(expected)), axis=0)
    assert np.all(error <= KERNEL_LIMIT * np.max(np.abs(expected), axis=0))


def test_input_gain_scales_every_input(slave: Slave, model: ReducedModel) -> None:
    z, u = random_states(model, 1)[0], np.array([3.0, -2.0])
    set_point(slave, z, u)
    (gain,) = references(model, "input_gain")
    slave.fmu.setReal([gain], [2.5])
    expected = rate(model, z, 2.5 * u)
    actual = slave.fmu.getReal(range(N_STATE, 2 * N_STATE))
    np.testing.assert_allclose(actual, expected, rtol=0, atol=KERNEL_LIMIT * np.abs(expected).max())


def test_directional_derivatives_of_rates(slave: Slave, model: ReducedModel) -> None:
    z, u = random_states(model, 1, seed=8)[0], np.array([4.0, 7.0])
    set_point(slave, z, u)
    J = jacobian(model.normal_form, zeta(z[None]))[0]
    by_re = np.diag(model.eigenvalues) + J[:, :2] + J[:, 2:]
    by_im = 1j * (np.diag(model.eigenvalues) + J[:, :2] - J[:, 2:])
    columns = [column for j in range(2) for column in (by_re[:, j], by_im[:, j])]
    columns += [*model.input_matrix.T, model.input_matrix @ u]
    knowns = [*range(N_STATE), *slave.references.inputs, *references(model, "input_gain")]
    for known, column in zip(knowns, columns, strict=True):
        actual = slave.fmu.getDirectionalDerivative(list(range(N_STATE, 2 * N_STATE)), [known], [1.0])
        expected = np.stack([column.real, column.imag], axis=-1).ravel()
        np.testing.assert_allclose(actual, expected, rtol=0, atol=DERIVATIVE_LIMIT * np.abs(expected).max())


def test_directional_derivatives_of_outputs(slave: Slave, model: ReducedModel) -> None:
    """Chain rule through chart and sensors; amplitudes and trust ratio against central differences."""
    z, dz = random_states(model, 2, seed=9)
    set_point(slave, z, np.zeros(2))
    y = evaluate(model.chart, zeta(z[None])).real
    dy = (jacobian(model.chart, zeta(z[None]))[0] @ zeta(dz)).real
    expected = np.concatenate([jacobian(p, y)[0] @ dy for p in (model.displacement, model.velocity)])
    seed = np.stack([dz.real, dz.imag], axis=-1).ravel().tolist()
    unknowns = [*slave.references.displacement, *slave.references.velocity]
    actual = slave.fmu.getDirectionalDerivative(unknowns, list(range(N_STATE)), seed)
    np.testing.assert_allclose(actual, expected, rtol=0, atol=DERIVATIVE_LIMIT * np.abs(expected).max())

    sizes = references(model, "modal_amplitude", "trust_ratio")
    actual = slave.fmu.getDirectionalDerivative(sizes, list(range(N_STATE)), seed)
    h = 1e-6
    difference = (np.abs(z + h * dz) - np.abs(z - h * dz)) / (2.0 * h)
    facets = model.trained_range.facets
    leading = np.argmax(facets @ np.abs(z))
    expected = np.array([*difference, facets[leading] @ difference])
    # Central differences: h^2 |z'''| / 6 below 1e-11, rounding eps / h = 2e-10.
    np.testing.assert_allclose(actual, expected, rtol=0, atol=1e-9)


def test_amplitudes_have_no_slope_at_rest(slave: Slave, model: ReducedModel) -> None:
    sizes = references(model, "modal_amplitude", "trust_ratio")
    assert slave.fmu.getDirectionalDerivative(sizes, [0], [1.0]) == [0.0] * len(sizes)


def test_constants_show_the_eigenvalues(slave: Slave, model: ReducedModel) -> None:
    frequency, damping = (slave.fmu.getReal(references(model, w)) for w in ("natural_frequency", "damping_ratio"))
    np.testing.assert_allclose(frequency, np.abs(model.eigenvalues) / (2.0 * np.pi), rtol=1e-15)
    np.testing.assert_allclose(damping, -model.eigenvalues.real / np.abs(model.eigenvalues), rtol=1e-15)
