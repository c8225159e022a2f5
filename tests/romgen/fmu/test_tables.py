"""Units whose coefficients are read from resources/coefficients.bin."""

from __future__ import annotations

import shutil
import subprocess
import zipfile
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest
from fmpy import read_model_description
from fmpy.fmi2 import FMU2Slave, fmi2CallbackFunctions, fmi2CallbackLoggerTYPE

from romgen.errors import InputError
from romgen.fmu.driver import replay
from romgen.fmu.export import export_fmu, generated_sources
from romgen.fmu.factored import factored_model
from romgen.fmu.model_file import model_from_json, model_in_unit, model_resources
from romgen.fmu.records import FmuExport, InterfaceOptions
from romgen.fmu.tables import table_bytes, table_hash
from romgen.reduced_model import ReducedModel
from romgen.settings import FmuSettings
from tests.romgen.fmu.conftest import STRICT
from tests.romgen.fmu.models import random_model, smooth_input
from tests.romgen.fmu.test_harness import HERE, SANITIZERS, build_program

H = 1e-4
IN_FILE = InterfaceOptions(coefficients_in_file=True)


@pytest.fixture(scope="session")
def in_file(model: ReducedModel, tmp_path_factory: pytest.TempPathFactory) -> FmuExport:
    settings = FmuSettings(coefficients="file")
    return export_fmu(model, tmp_path_factory.mktemp("in_file") / "random_panel.fmu", settings)


@pytest.fixture
def unpacked_file(in_file: FmuExport, tmp_path: Path) -> Path:
    """Unpacked where the path holds what URIs and encodings may break."""
    folder = tmp_path / "a b %41 ü #1"
    with zipfile.ZipFile(in_file.path) as archive:
        archive.extractall(folder)
    return folder


def attempt(folder: Path, location: str | None) -> tuple[bool, list[str]]:
    """Whether an instance could be made, and what was logged."""
    messages: list[str] = []

    def log(environment: object, name: bytes, status: int, category: bytes, message: bytes) -> None:
        messages.append(message.decode())

    description = read_model_description(str(folder))
    fmu = FMU2Slave(
        guid=description.guid,
        unzipDirectory=str(folder),
        modelIdentifier=description.coSimulation.modelIdentifier,
        instanceName="x",
    )
    callbacks = fmi2CallbackFunctions()
    callbacks.logger = fmi2CallbackLoggerTYPE(log)
    encoded = None if location is None else location.encode()
    component = fmu.fmi2Instantiate(b"x", 1, description.guid.encode(), encoded, callbacks, 0, 0)
    if component:
        fmu.fmi2FreeInstance(component)
    fmu.freeLibrary()
    return bool(component), messages


def test_the_same_motion_to_the_bit(in_file: FmuExport, native: FmuExport) -> None:
    t = H * np.arange(201)
    u, z0 = smooth_input(len(t), H, 2), np.array([0.4 + 0.1j, -0.2 + 0.3j])
    a, b = replay(in_file.path, t, z0, u), replay(native.path, t, z0, u)
    np.testing.assert_array_equal(a.state, b.state)
    np.testing.assert_array_equal(a.displacement, b.displacement)
    np.testing.assert_array_equal(a.velocity, b.velocity)


def test_the_model_comes_back_from_the_two_files(in_file: FmuExport, native: FmuExport) -> None:
    a, b = model_in_unit(Path(in_file.path)), model_in_unit(Path(native.path))
    assert a is not None
    assert b is not None
    for name in ("normal_form", "inverse_chart", "displacement", "velocity"):
        np.testing.assert_array_equal(getattr(a, name).exponents, getattr(b, name).exponents)
        np.testing.assert_array_equal(getattr(a, name).coefficients, getattr(b, name).coefficients)
    # The chart was made real and complex again: some 20 terms of degree 5, each rounded once.
    limit = 20 * np.finfo(float).eps * np.max(np.abs(b.chart.coefficients))
    np.testing.assert_array_equal(a.chart.exponents, b.chart.exponents)
    np.testing.assert_allclose(a.chart.coefficients, b.chart.coefficients, rtol=0, atol=limit)


def test_a_cut_table_is_no_model(model: ReducedModel) -> None:
    text, table = (data for _, data in sorted(model_resources(model, in_file=True).items(), reverse=True))
    with pytest.raises(InputError, match="not a reduced model"):
        model_from_json(text.decode(), table[:-8])


def test_a_table_of_another_layout_is_no_model(model: ReducedModel) -> None:
    """A unit written before the order of the numbers changed must not be misread."""
    text, table = (data for _, data in sorted(model_resources(model, in_file=True).items(), reverse=True))
    for old in (text.replace(b',"layout":3', b""), text.replace(b'"layout":3', b'"layout":2')):
        with pytest.raises(InputError, match="was written by another version of romgen; export the unit again"):
            model_from_json(old.decode(), table)


def test_every_way_to_write_the_location(unpacked_file: Path) -> None:
    folder = unpacked_file / "resources"
    uri = folder.as_uri()
    assert "%20" in uri
    assert "%25" in uri
    good = (uri, uri + "/", uri.replace("file://", "file:"), uri.replace("file://", "FILE://localhost"), str(folder))
    for location in good:
        assert attempt(unpacked_file, location) == (True, [])


def test_a_location_without_coefficients_is_refused_with_the_path(unpacked_file: Path) -> None:
    for location in (None, "", "file:///x%00y", "file:///" + "x" * 2000):
        made, messages = attempt(unpacked_file, location)
        assert not made
        assert "resource location is missing" in messages[0]
    made, messages = attempt(unpacked_file, "file:///no%20where")
    assert not made
    assert "cannot be opened" in messages[0]
    assert "/no where/coefficients.bin" in messages[0]


@pytest.mark.parametrize("change", [lambda b: b[:-1], lambda b: b + b"\0", lambda b: b"\x01" + b[1:], lambda b: b""])
def test_damaged_coefficients_are_refused(change: Callable[[bytes], bytes], unpacked_file: Path) -> None:
    file = unpacked_file / "resources" / "coefficients.bin"
    file.write_bytes(change(file.read_bytes()))
    made, messages = attempt(unpacked_file, (unpacked_file / "resources").as_uri())
    assert not made
    assert "damaged or belong to another export" in messages[0]


def test_one_copy_for_several_binaries_unless_told_otherwise(tmp_path: Path) -> None:
    """Without a compiler for them the platforms asked for still count."""
    model = random_model(2)
    for platforms, coefficients, expected in (
        ((), "auto", False),
        (("host",), "auto", False),
        (("linux64", "aarch64-linux"), "auto", True),
        (("linux64", "aarch64-linux"), "embedded", False),
    ):
        settings = FmuSettings(platforms=platforms, coefficients=coefficients)
        export_fmu(model, tmp_path / "x.fmu", settings)
        with zipfile.ZipFile(tmp_path / "x.fmu") as archive:
            assert ("resources/coefficients.bin" in archive.namelist()) is expected
            assert ("sources/tables.h" in archive.namelist()) is not expected


def test_strict_c99_and_the_whole_interface_under_sanitizers(
    model: ReducedModel, unpacked_file: Path, run_cc: Callable[..., None], tmp_path: Path
) -> None:
    for name, content in generated_sources(model, "{g}", IN_FILE).items():
        (tmp_path / name).write_bytes(content)
    files = sorted(p.name for p in tmp_path.glob("*.c"))
    run_cc(*STRICT, "-O2", "-fPIC", "-shared", "-o", "strict.so", *files, "-lm", folder=tmp_path)
    sources = sorted((unpacked_file / "sources").glob("*.c"))
    run_cc("-std=c99", "-g", *SANITIZERS, "-fPIC", "-shared", "-o", "lib.so", *sources, "-lm", folder=tmp_path)
    location = {"FMU_RESOURCES": (unpacked_file / "resources").as_uri()}
    for name, arguments in (("harness", ()), ("fuzz", ("2000", "7"))):
        program = build_program(run_cc, name, unpacked_file, tmp_path, SANITIZERS)
        command = [str(program), str(tmp_path / "lib.so"), *arguments]
        result = subprocess.run(command, env=location, capture_output=True, text=True, check=False, timeout=120)
        assert (result.returncode, result.stdout) == (0, "ok\n"), result.stderr


def test_under_valgrind(in_file: FmuExport, unpacked_file: Path, run_cc: Callable[..., None], tmp_path: Path) -> None:
    if shutil.which("valgrind") is None or not in_file.platforms:
        pytest.skip("valgrind or a compiler is missing")
    library = next((unpacked_file / "binaries" / in_file.platforms[0]).iterdir())
    program = build_program(run_cc, "harness", unpacked_file, tmp_path)
    command = ["valgrind", "-q", "--leak-check=full", "--error-exitcode=3", str(program), str(library)]
    location = {"FMU_RESOURCES": (unpacked_file / "resources").as_uri(), "PATH": "/usr/bin:/bin"}
    result = subprocess.run(command, env=location, capture_output=True, text=True, check=False, timeout=120)
    assert (result.returncode, result.stdout) == (0, "ok\n"), result.stderr


def test_paths_of_windows(run_cc: Callable[..., None], tmp_path: Path) -> None:
    """The rules for drives and network shares, which the runtime follows there (RFC 8089, appendix E)."""
    for name, content in generated_sources(random_model(2), "{g}", IN_FILE).items():
        (tmp_path / name).write_bytes(content)
    run_cc("-std=c99", *SANITIZERS, "-I.", HERE / "paths.c", "rom_path.c", "-o", "paths", folder=tmp_path)
    given = {
        "file:///C:/a%20b": "C:/a b/f",
        "file:/C:/a": "C:/a/f",
        "file:C:/a": "C:/a/f",
        "file://C:/a": "C:/a/f",
        "file:///c|/a": "c:/a/f",
        "file://server/share/a": "//server/share/a/f",
        "file:////server/share": "//server/share/f",
        "file://localhost/C:/a": "C:/a/f",
        "C:\\a%20b\\": "C:\\a%20b\\f",
        "file:///C:\\a%20b\\c": "C:\\a b\\c/f",
        "\\\\?\\C:\\a b\\c": "\\\\?\\C:\\a b\\c\\f",
        "\\\\server\\share/": "\\\\server\\share/f",
        "file:///C:/%C3%BC/": "C:/\u00fc/f",
        "file:///C:/50%/x": "C:/50%/x/f",
    }
    result = subprocess.run([tmp_path / "paths", *given], capture_output=True, text=True, check=True)
    assert result.stdout.splitlines() == list(given.values())


def test_the_hash_is_that_of_fowler_noll_and_vo() -> None:
    """One word: (offset xor word) prime mod 2^64, computed by hand for 0; any change of a word changes it."""
    assert table_hash(bytes(8)) == 14695981039346656037 * 1099511628211 % 2**64
    table = table_bytes(factored_model(random_model(2)))
    assert table_hash(table) != table_hash(table[:-1] + bytes([table[-1] ^ 1]))
