"""One line per stage; a bar only where the console is a terminal."""

from __future__ import annotations

import io
import time

from rich.console import Console

from romgen.progress import ConsoleProgress


def shown(terminal: bool) -> str:
    stream = io.StringIO()
    console = Console(file=stream, force_terminal=terminal, width=100, color_system=None)
    with ConsoleProgress(console) as progress:
        progress.finished("mesh", 0.5, cached=True)
        progress.started("ringdowns")
        progress.update(0.5, "0.3 of 0.6 s")
        if terminal:
            time.sleep(0.3)  # the bar is drawn ten times a second
        progress.finished("ringdowns", 123.4, cached=False)
    return stream.getvalue()


def test_plain_output_has_one_line_per_stage() -> None:
    assert [line.split() for line in shown(terminal=False).splitlines()] == [
        ["mesh", "reused"],
        ["ringdowns", "123.4", "s"],
    ]


def test_terminal_shows_the_bar() -> None:
    assert "0.3 of 0.6 s" in shown(terminal=True)
    assert "\x1b" not in shown(terminal=False)
