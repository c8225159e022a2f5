"""The house rules that no linter knows: sizes, number of parameters, names, documented public functions."""

from __future__ import annotations

import ast
from collections.abc import Iterator
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[1]
SOURCES = sorted(path for package in ("romgen", "fem") for path in (ROOT / package).rglob("*.py"))
MAX_FILE_LINES, MAX_BODY_LINES, MAX_PARAMETERS = 300, 40, 6
EXCUSED = {
    "march": "door to the ETDRK4 kernel, takes the flat arrays that the kernel takes",
    "_newton": "one load step: the state and its history are handed on, a record would only be unpacked again",
}
BANNED_NAMES = {"utils", "util", "helpers", "helper", "misc", "manager", "common"}


def functions(path: Path) -> Iterator[ast.FunctionDef]:
    for node in ast.walk(ast.parse(path.read_text(encoding="utf-8"))):
        if isinstance(node, ast.FunctionDef):
            yield node


def body_lines(function: ast.FunctionDef) -> int:
    """Lines from the first statement after the docstring to the end."""
    first = function.body[1 if ast.get_docstring(function) and len(function.body) > 1 else 0]
    return (function.end_lineno or first.lineno) - first.lineno + 1


def is_kernel(function: ast.FunctionDef) -> bool:
    """Compiled kernels take flat arrays instead of records."""
    return bool({"compiled", "compiled_unlocked", "inlined", "threaded"} & marks(function))


def marks(function: ast.FunctionDef) -> set[str]:
    return {ast.unparse(mark) for mark in function.decorator_list}


@pytest.mark.parametrize("path", SOURCES, ids=lambda path: path.relative_to(ROOT).as_posix())
def test_sizes(path: Path) -> None:
    assert len(path.read_text(encoding="utf-8").splitlines()) <= MAX_FILE_LINES
    assert [f.name for f in functions(path) if body_lines(f) > MAX_BODY_LINES] == []


@pytest.mark.parametrize("path", SOURCES, ids=lambda path: path.relative_to(ROOT).as_posix())
def test_parameters(path: Path) -> None:
    def positional(f: ast.FunctionDef) -> int:
        return len([a for a in f.args.posonlyargs + f.args.args if a.arg not in ("self", "cls")])

    many = [f.name for f in functions(path) if positional(f) > MAX_PARAMETERS and not is_kernel(f)]
    assert set(many) - set(EXCUSED) == set()


@pytest.mark.parametrize("path", SOURCES, ids=lambda path: path.relative_to(ROOT).as_posix())
def test_public_functions_and_modules_say_what_they_do(path: Path) -> None:
    tree = ast.parse(path.read_text(encoding="utf-8"))
    assert ast.get_docstring(tree)
    public = [n for n in tree.body if isinstance(n, ast.FunctionDef | ast.ClassDef) and not n.name.startswith("_")]
    silent = [node for node in public if not ast.get_docstring(node)]
    assert [n.name for n in silent if not (isinstance(n, ast.FunctionDef) and "overload" in marks(n))] == []


def test_names() -> None:
    assert [path for path in SOURCES if BANNED_NAMES & set(path.stem.split("_"))] == []
