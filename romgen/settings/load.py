"""From a TOML file to a checked Study: every problem of the file in one line each."""

from __future__ import annotations

import copy
import difflib
import tomllib
import types
from collections.abc import Sequence
from pathlib import Path
from typing import Any, Union, get_args, get_origin

from pydantic import BaseModel, ValidationError

from romgen.errors import InputError
from romgen.settings.checks import study_problems
from romgen.settings.study import Study


class StudyError(InputError):
    """A study file with problems, one line each in ``problems`` (exit code 2)."""

    def __init__(self, problems: Sequence[str]) -> None:
        super().__init__("\n".join(problems))
        self.problems = tuple(problems)


def load_study(path: Path | str) -> Study:
    """Read, validate and cross-check a study file.

    Parameters
    ----------
    path : study.toml; data files are taken relative to its folder.

    Raises
    ------
    InputError : the file is missing or not TOML.
    StudyError : it has unknown keys, wrong values, or names things that do not exist; lists all of them.
    """
    path = Path(path)
    study, problems = _validated(_extended(_read_toml(path), path), path)
    if study is not None:
        problems += [f"{path.name}: {problem}" for problem in study_problems(study)]
    if problems or study is None:
        raise StudyError(problems)
    return study


def _read_toml(path: Path) -> dict[str, Any]:
    if not path.is_file():
        raise InputError("no such study file", where=str(path), advice="give the path of a study.toml")
    try:
        return tomllib.loads(path.read_text(encoding="utf-8"))
    except (tomllib.TOMLDecodeError, UnicodeDecodeError) as error:
        raise InputError(f"not valid TOML: {error}", where=str(path)) from error


def _extended(tables: dict[str, Any], path: Path, seen: tuple[Path, ...] = ()) -> dict[str, Any]:
    """Lay the tables over those of the study that [study] extends names, if it names one."""
    head = tables.get("study")
    base = head.get("extends") if isinstance(head, dict) else None
    if not isinstance(base, str):
        return tables
    if path.resolve() in seen:
        raise InputError("[study] extends goes round in a circle", where=path.name, value=base)
    below = path.parent / base
    return _overlay(_extended(_read_toml(below), below, (*seen, path.resolve())), tables)


def _overlay(below: dict[str, Any], above: dict[str, Any]) -> dict[str, Any]:
    """Merge tables key by key; everything else, arrays too, is replaced."""
    merged = dict(below)
    for key, value in above.items():
        both = isinstance(value, dict) and isinstance(below.get(key), dict)
        merged[key] = _overlay(below[key], value) if both else value
    return merged


def _validated(tables: dict[str, Any], path: Path) -> tuple[Study | None, list[str]]:
    """Validate; unknown keys are reported and removed so that the other checks still run."""
    tables = copy.deepcopy(tables)
    problems: list[str] = []
    while True:
        try:
            return Study.model_validate(tables, context={"folder": str(path.parent)}), problems
        except ValidationError as error:
            details = error.errors(include_url=False)
        problems += [f"{path.name}: {_line(detail['loc'], detail)}" for detail in details]
        if any(detail["type"] != "extra_forbidden" for detail in details):
            return None, problems
        for detail in details:
            _remove(tables, detail["loc"])


def _remove(tables: dict[str, Any], loc: tuple[int | str, ...]) -> None:
    table: Any = tables
    for key in loc[:-1]:
        table = table[key]
    del table[loc[-1]]


def _line(loc: tuple[int | str, ...], detail: Any) -> str:
    """Return "[table] key: what is wrong; got value; advice" for one pydantic problem."""
    loc = tuple(key for key in loc if key in _table_path(loc))
    if detail["type"] == "extra_forbidden":
        return f"{_table(loc[:-1])}unknown key '{loc[-1]}'; {_suggestion(str(loc[-1]), known_keys(loc[:-1]))}"
    if detail["type"] == "missing":
        return f"{_table(loc[:-1])}missing key '{loc[-1]}'"
    message = str(detail["msg"]).removeprefix("Value error, ")
    if not loc or isinstance(detail["input"], dict | BaseModel):
        return f"{_table(loc)}{message}"
    return f"{_table(loc[:-1])}{loc[-1]}: {message}; got {detail['input']!r}"


def _table_path(loc: tuple[int | str, ...]) -> tuple[int | str, ...]:
    """Drop the names of union members, such as "tuple[int, ...]", that pydantic puts into a location."""
    return tuple(key for key in loc if isinstance(key, int) or not any(mark in key for mark in "[]()"))


def _table(loc: tuple[int | str, ...]) -> str:
    parts = [f"[{key}]" if isinstance(key, int) else f".{key}" for key in loc]
    return f"[{''.join(parts).removeprefix('.')}] " if parts else ""


def _suggestion(key: str, known: Sequence[str]) -> str:
    close = difflib.get_close_matches(key, known, n=1, cutoff=0.6)
    return f"did you mean '{close[0]}'?" if close else f"known keys are {', '.join(known)}"


def known_keys(loc: tuple[int | str, ...]) -> tuple[str, ...]:
    """Return the keys that the table at ``loc`` of study.toml accepts; () where it is free."""
    annotation: Any = Study
    for key in loc:
        annotation = _step(_without_none(annotation), key)
    annotation = _without_none(annotation)
    is_table = isinstance(annotation, type) and issubclass(annotation, BaseModel)
    return tuple(annotation.model_fields) if is_table else ()


def _step(annotation: Any, key: int | str) -> Any:
    """Return the annotation of one entry of a table, a dict of tables or an array of tables."""
    if isinstance(annotation, type) and issubclass(annotation, BaseModel):
        return annotation.model_fields[str(key)].annotation
    if get_origin(annotation) is dict:
        return get_args(annotation)[1]
    return get_args(annotation)[0] if get_args(annotation) else None


def _without_none(annotation: Any) -> Any:
    if get_origin(annotation) in (Union, types.UnionType):
        return next(member for member in get_args(annotation) if member is not type(None))
    return annotation
