"""The maps of a model as the C runtime sums them, in numpy against the polynomials, and the bits of their rows in C."""

from __future__ import annotations

import dataclasses
import subprocess
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest

from romgen.arrays import ComplexArray, FloatArray
from romgen.errors import InputError
from romgen.fmu.export import generated_sources
from romgen.fmu.factored import N_GROUP, N_LANE, HalvedMap, factored_model
from romgen.fmu.programme import MonomialProgramme, fold_conjugates
from romgen.fmu.real_chart import complex_chart, real_chart
from romgen.polynomial import PolynomialMap, evaluate, zeta
from romgen.reduced_model import ReducedModel
from romgen.simulate import sensors
from tests.romgen.fmu.conftest import STRICT
from tests.romgen.fmu.models import duffing_chain, random_model, random_states

EPS = float(np.finfo(float).eps)
HERE = Path(__file__).parent


def sparse_model() -> ReducedModel:
    """Every third term of the chart, every fifth of the sensors, a normal form that is not resonant at all."""
    model = random_model(6)
    rng = np.random.default_rng(4)
    form = rng.standard_normal((2, len(model.chart.exponents))) + 1j * rng.standard_normal((2, 1))
    form[rng.uniform(size=form.shape) < 0.8] = 0.0
    form[:, model.chart.exponents.sum(axis=1) == 1] = 0.0

    def thinned(p: PolynomialMap, step: int) -> PolynomialMap:
        return PolynomialMap(p.exponents[::step], p.coefficients[:, ::step])

    return dataclasses.replace(
        model,
        chart=thinned(model.chart, 3),
        displacement=thinned(model.displacement, 5),
        velocity=thinned(model.velocity, 7),
        normal_form=PolynomialMap(model.chart.exponents, form),
    )


MODELS = [random_model(7), random_model(1, n_input=0), sparse_model(), duffing_chain(1), duffing_chain(3)]


def products(programme: MonomialProgramme, x: ComplexArray | FloatArray, n: int | None = None) -> list[complex]:
    values = [1.0, *x]
    for left, right in programme.products[:n]:
        values.append(values[left] * values[right])
    return values


def with_conjugates(programme: MonomialProgramme, z: ComplexArray) -> list[complex]:
    values = [1.0, 1.0, *np.stack([z, z.conj()], axis=1).ravel()]
    for left, right in programme.products:
        product = values[left] * values[right]
        values += [product, product.conjugate()]
    return values


def halved(half: MonomialProgramme, p: HalvedMap, coefficients: FloatArray, x: FloatArray) -> FloatArray:
    """The sums of rom_rows, but for the order of C."""
    C = np.zeros((len(coefficients), p.n_entry))
    C[:, p.position] = coefficients
    m = half.n_var
    left, right = (np.zeros(half.n_monomial + N_LANE) for _ in range(2))
    for side, part in ((left, x[:m]), (right, x[m:])):
        values = products(half, part, p.n_product)
        side[: len(values)] = values
    total, entry = np.zeros(len(C)), 0
    for block, count in enumerate(p.count):
        for a in range(count):
            total += left[a] * C[:, entry : entry + N_LANE] @ right[N_LANE * block : N_LANE * (block + 1)]
            entry += N_LANE
    assert entry == p.n_entry == C.shape[1]
    return total


@pytest.mark.parametrize("model", MODELS, ids=lambda model: model.name)
def test_normal_form_with_its_pairs_taken_out(model: ReducedModel) -> None:
    factored = factored_model(model)
    form, m = factored.form, len(model.eigenvalues)
    size = np.sum(np.abs(model.normal_form.coefficients.reshape(m, -1)), axis=1)
    for z in random_states(model, 20):
        base = with_conjugates(form.base, z)
        square = products(factored.half, np.abs(z) ** 2, form.n_product)
        rate, first = np.zeros(m, dtype=complex), 0
        for j, row in enumerate(form.rows):
            for position, count in row:
                c = form.coefficients[first : first + count]
                rate[j] += base[position] * np.dot(c, square[:count])
                first += count
        assert first == len(form.coefficients)
        expected = evaluate(model.normal_form, zeta(z[None]))[0] if model.normal_form.exponents.size else np.zeros(m)
        # About 7 products and 30 additions of numbers below the sum of all coefficients.
        assert np.all(np.abs(rate - expected) <= 40 * EPS * size)


@pytest.mark.parametrize("model", MODELS, ids=lambda model: model.name)
def test_bases_hold_no_pair(model: ReducedModel) -> None:
    form, m = factored_model(model).form, len(model.eigenvalues)
    exponent = {position: row for row, position in form.base.index.items()}
    used = {position for row in form.rows for position, _ in row}
    assert not any(exponent[k][j] and exponent[k][m + j] for k in used for j in range(m))


@pytest.mark.parametrize("model", MODELS, ids=lambda model: model.name)
def test_chart_and_sensors_from_halves(model: ReducedModel) -> None:
    """The chart's terms are larger apart than together: |x| + |y| <= sqrt(2) |z|, 2^(7/2) = 11 for degree 7."""
    factored = factored_model(model)
    T, W = factored.chart_map.coefficients, factored.sensor_map.coefficients
    for z in random_states(model, 20):
        y = halved(factored.half, factored.chart, T, np.concatenate([z.real, z.imag]))
        expected = evaluate(model.chart, zeta(z[None]))[0].real
        limit = 11 * 40 * EPS * np.sum(np.abs(model.chart.coefficients), axis=1)
        assert np.all(np.abs(y - expected) <= limit)
        x = halved(factored.half, factored.sensor, W, expected)
        exact = np.concatenate([part[0] for part in sensors(model, z[None])])
        scale = np.max(np.abs(expected)) ** 7 if np.max(np.abs(expected)) > 1.0 else 1.0
        assert np.all(np.abs(x - exact) <= 40 * EPS * scale * np.sum(np.abs(W), axis=1))


@pytest.mark.parametrize("model", MODELS, ids=lambda model: model.name)
def test_the_chart_becomes_real_and_complex_again(model: ReducedModel) -> None:
    folded = fold_conjugates(model.chart)
    again = complex_chart(real_chart(model.chart), folded.exponents)
    np.testing.assert_array_equal(again.exponents, folded.exponents)
    scale = np.max(np.abs(folded.coefficients))
    # Binomial weights of degree 7 sum to 2^7 one way and 2^-7 back; each of some 20 terms rounds once.
    np.testing.assert_allclose(again.coefficients, folded.coefficients, rtol=0, atol=20 * EPS * scale)


@pytest.mark.parametrize("n_row", [1, 3, 4, 6, 8, 9])
def test_coefficients_come_in_the_order_of_use(n_row: int) -> None:
    """Four rows at a time, of each N_LANE entries in turn; what was packed can be unpacked."""
    p = factored_model(random_model(3)).chart
    coefficients = np.random.default_rng(0).standard_normal((n_row, len(p.position)))
    C = np.zeros((n_row, p.n_entry))
    C[:, p.position] = coefficients
    packed = p.packed(coefficients)
    expected = [
        C[i, k : k + N_LANE]
        for first in range(0, n_row, N_GROUP)
        for k in range(0, p.n_entry, N_LANE)
        for i in range(first, min(first + N_GROUP, n_row))
    ]
    np.testing.assert_array_equal(packed, np.concatenate(expected))
    np.testing.assert_array_equal(p.unpacked(packed, n_row), coefficients)


def test_a_full_table_is_four_fifths_full() -> None:
    """Blocks of order 7 and two modes: 36, 21, 15, 10, 6, 6, 3, 1 and 1 left monomials, made even, for 329 terms."""
    factored = factored_model(random_model(7))
    assert factored.half.n_monomial == 36
    assert factored.chart.count.tolist() == factored.sensor.count.tolist() == [36, 22, 16, 10, 6, 6, 4, 2, 2]
    assert len(factored.chart_map.exponents) == 329


def test_a_constant_term_is_refused() -> None:
    model = random_model(2)
    shifted = PolynomialMap(np.array([[0, 0, 0, 0], [1, 0, 0, 0]]), np.ones((3, 2)))
    with pytest.raises(InputError, match="constant term"):
        factored_model(dataclasses.replace(model, displacement=shifted))


@pytest.mark.parametrize("model", [random_model(2), duffing_chain(1)], ids=lambda model: model.name)
def test_rows_have_the_same_bits_with_and_without_avx(
    model: ReducedModel, run_cc: Callable[..., None], tmp_path: Path
) -> None:
    """4, 8, 3 and 7 rows of the one model, 2, 6, 1 and 5 of the other: all that groups may leave."""
    for name, content in generated_sources(model, "{g}").items():
        (tmp_path / name).write_bytes(content)
    for level in ("-O0", "-O2", "-O3"):
        run_cc(*STRICT, level, "-I.", HERE / "rows.c", "-o", "rows", folder=tmp_path)
        result = subprocess.run([tmp_path / "rows"], capture_output=True, text=True, check=False)
        if result.stdout == "no AVX\n":
            pytest.skip("this processor has no AVX")
        assert (result.returncode, result.stdout) == (0, "ok\n")
