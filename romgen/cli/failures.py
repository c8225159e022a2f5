"""How a command fails: one line per problem on stderr, a stated exit code, no stack trace for what users can mend."""

from __future__ import annotations

import functools
import json
import sys
from collections.abc import Callable
from typing import ParamSpec, TypeVar

import typer

from romgen.errors import RomgenError

INTERRUPTED = 130

P = ParamSpec("P")
Result = TypeVar("Result")


def reported(command: Callable[P, Result]) -> Callable[P, Result]:
    """Wrap a command: a RomgenError becomes its message and exit code, Ctrl-C a note and 130."""

    @functools.wraps(command)
    def wrapper(*args: P.args, **kwargs: P.kwargs) -> Result:
        try:
            return command(*args, **kwargs)
        except RomgenError as error:
            _tell(str(error).splitlines(), error.exit_code, as_json=bool(kwargs.get("json_output")))
            raise typer.Exit(error.exit_code) from error
        except KeyboardInterrupt:
            _tell(["interrupted; what was finished is kept, the same command continues"], INTERRUPTED, as_json=False)
            raise typer.Exit(INTERRUPTED) from None

    return wrapper


def _tell(lines: list[str], exit_code: int, *, as_json: bool) -> None:
    for line in lines:
        print(f"romgen: {line}", file=sys.stderr)
    if as_json:
        print(json.dumps({"exit_code": exit_code, "problems": lines}))
