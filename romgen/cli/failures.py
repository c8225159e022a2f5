"""How a command fails: one line per problem on stderr, a stated exit code, no stack trace for what users can mend."""

from __future__ import annotations

import functools
import json
import sys
from collections.abc import Callable, Sequence
from typing import ParamSpec, TypeVar

import typer

from romgen.errors import RomgenError

INTERRUPTED = 130
NOTE_INTERRUPTED = "interrupted; what was finished is kept, the same command continues"

P = ParamSpec("P")
Result = TypeVar("Result")


def reported(command: Callable[P, Result]) -> Callable[P, Result]:
    """Wrap a command: a RomgenError becomes its message and exit code, Ctrl-C a note and 130."""

    @functools.wraps(command)
    def wrapper(*args: P.args, **kwargs: P.kwargs) -> Result:
        try:
            return command(*args, **kwargs)
        except RomgenError as error:
            lines = str(error).splitlines()
            if kwargs.get("json_output"):
                print(json.dumps({"exit_code": error.exit_code, "problems": lines}))
            raise failure(lines, error.exit_code) from error
        except KeyboardInterrupt:
            raise failure([NOTE_INTERRUPTED], INTERRUPTED) from None

    return wrapper


def failure(lines: Sequence[str], exit_code: int) -> typer.Exit:
    """Print the lines on stderr and return the exit to raise."""
    for line in lines:
        print(f"romgen: {line}", file=sys.stderr)
    return typer.Exit(exit_code)
