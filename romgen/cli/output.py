"""What a command prints: text on a terminal, nothing when quiet, or one JSON document."""

from __future__ import annotations

import json
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from typing import Any

from rich.console import Console

from romgen.progress import ConsoleProgress, RunProgress, SilentProgress


class Output:
    """Printer of one command; with ``as_json`` all text is dropped and ``document`` prints.

    NO_COLOR and output that is not a terminal are respected (rich).
    """

    def __init__(self, *, quiet: bool = False, as_json: bool = False) -> None:
        self.as_json = as_json
        self.console = Console(quiet=quiet or as_json, soft_wrap=True, highlight=False)

    def text(self, line: str) -> None:
        """Print one line as it is."""
        self.console.print(line, markup=False)

    def table(self, columns: Sequence[str], rows: Sequence[Sequence[str]], *, numbers: bool = False) -> None:
        """Print a table; with ``numbers`` all columns but the first are right-aligned."""
        lines = [tuple(columns), *map(tuple, rows)]
        widths = [max(len(line[k]) for line in lines) for k in range(len(columns))]
        for line in lines:
            cells = [
                cell.rjust(width) if numbers and k else cell.ljust(width)
                for k, (cell, width) in enumerate(zip(line, widths, strict=True))
            ]
            self.text("  ".join(cells).rstrip())

    def document(self, content: Any) -> None:
        """Print the JSON document of the command, when JSON is asked for."""
        if self.as_json:
            print(json.dumps(content, indent=1, default=str))

    @contextmanager
    def progress(self) -> Iterator[RunProgress]:
        """Show the progress of a run; nothing when quiet."""
        if self.console.quiet:
            yield SilentProgress()
            return
        with ConsoleProgress(self.console) as progress:
            yield progress
