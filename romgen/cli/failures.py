"""How a command fails: one line per problem on stderr, a stated exit code, no stack trace for what users can mend."""

from __future__ import annotations

import functools
import json
import sys
from collections.abc import Callable, Sequence
from typing import ParamSpec, TypeVar

import typer

from romgen.errors import RomgenError, system_error

INTERRUPTED = 130
NOTE_INTERRUPTED = "interrupted; what was finished is kept, the same command continues"

P = ParamSpec("P")
Result = TypeVar("Result")


def reported(command: Callable[P, Result]) -> Callable[P, Result]:
    """Wrap a command: a RomgenError or what the system refuses is one line and an exit code, Ctrl-C a note and 130."""

    @functools.wraps(command)
    def wrapper(*args: P.args, **kwargs: P.kwargs) -> Result:
        try:
            return command(*args, **kwargs)
        except RomgenError as error:
            raise _told(error, as_json=bool(kwargs.get("json_output"))) from error
        except BrokenPipeError:
            raise  # whoever read the output has gone; click ends quietly
        except OSError as error:
            raise _told(system_error(error), as_json=bool(kwargs.get("json_output"))) from error
        except KeyboardInterrupt:
            raise failure([NOTE_INTERRUPTED], INTERRUPTED) from None

    return wrapper


def _told(error: RomgenError, *, as_json: bool) -> typer.Exit:
    lines = str(error).splitlines()
    if as_json:
        print(json.dumps({"exit_code": error.exit_code, "problems": lines}))
    return failure(lines, error.exit_code)


def failure(lines: Sequence[str], exit_code: int) -> typer.Exit:
    """Print the lines on stderr and return the exit to raise."""
    for line in lines:
        print(f"romgen: {line}", file=sys.stderr)
    return typer.Exit(exit_code)
