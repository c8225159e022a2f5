"""The FMI 3.0 runtime in a C program without Python, for each kind of interface, under the sanitizers and valgrind."""

from __future__ import annotations

import shutil
from collections.abc import Callable
from pathlib import Path

import pytest

from romgen.fmu.export3 import generated_sources3
from romgen.fmu.records import InterfaceOptions
from romgen.reduced_model import ReducedModel
from tests.romgen.fmu.test_harness import C_FLAGS, HERE, SANITIZERS, run

SHARE = (1.0, 0.5, 0.0)
KINDS = {
    "plain": InterfaceOptions(),
    "absolute": InterfaceOptions((), SHARE),
    "start": InterfaceOptions((), None, True),
    "both": InterfaceOptions((), SHARE, True),
}


def build(
    model: ReducedModel,
    kind: str,
    flags: tuple[str, ...],
    run_cc: Callable[..., None],
    folder: Path,
    program: str = "harness3",
) -> Path:
    for name, content in generated_sources3(model, "{g}", KINDS[kind]).items():
        (folder / name).write_bytes(content)
    files = sorted(p.name for p in folder.glob("*.c"))
    run_cc(*C_FLAGS, *flags, "-I.", HERE / f"{program}.c", *files, "-o", program, "-lm", folder=folder)
    return folder / program


@pytest.mark.parametrize("kind", KINDS)
def test_under_sanitizers(kind: str, model: ReducedModel, run_cc: Callable[..., None], tmp_path: Path) -> None:
    run(build(model, kind, SANITIZERS, run_cc, tmp_path))


@pytest.mark.parametrize("kind", KINDS)
def test_under_valgrind(kind: str, model: ReducedModel, run_cc: Callable[..., None], tmp_path: Path) -> None:
    if shutil.which("valgrind") is None:
        pytest.skip("valgrind is not installed")
    program = build(model, kind, (), run_cc, tmp_path)
    run("valgrind", "-q", "--leak-check=full", "--error-exitcode=3", program)


@pytest.mark.parametrize("kind", KINDS)
@pytest.mark.parametrize("n_sequence", [2_500, pytest.param(100_000, marks=pytest.mark.slow)])
def test_random_call_sequences_under_sanitizers(
    n_sequence: int, kind: str, model: ReducedModel, run_cc: Callable[..., None], tmp_path: Path
) -> None:
    run(build(model, kind, SANITIZERS, run_cc, tmp_path, "fuzz3"), n_sequence, 20261127)
