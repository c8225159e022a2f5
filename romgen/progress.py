"""Progress of a run: what long stages report, and the bar that shows it on a terminal."""

from __future__ import annotations

from collections.abc import Callable
from types import TracebackType
from typing import Protocol, Self

from rich.console import Console
from rich.progress import BarColumn, Progress, TaskID, TextColumn, TimeElapsedColumn, TimeRemainingColumn

Report = Callable[[float, str], None]
"""Called by a stage with the finished fraction (0 to 1) and a short text."""


class RunProgress(Protocol):
    """What the pipeline tells about a run."""

    def started(self, stage: str) -> None:
        """A stage begins to compute."""

    def update(self, fraction: float, text: str) -> None:
        """The running stage has finished this fraction."""

    def finished(self, stage: str, wall_s: float, cached: bool) -> None:
        """A stage is done, or its stored result was reused."""


class SilentProgress:
    """Shows nothing."""

    def started(self, stage: str) -> None:
        """Do nothing."""

    def update(self, fraction: float, text: str) -> None:
        """Do nothing."""

    def finished(self, stage: str, wall_s: float, cached: bool) -> None:
        """Do nothing."""


class ConsoleProgress:
    """One line per finished stage, and a bar for the running one where the console is a terminal."""

    def __init__(self, console: Console) -> None:
        self.console = console
        self._bar = Progress(
            TextColumn("{task.description:<16}"),
            BarColumn(),
            TimeElapsedColumn(),
            TimeRemainingColumn(),
            TextColumn("{task.fields[text]}"),
            console=console,
            transient=True,
            disable=not console.is_terminal,
        )
        self._task: TaskID | None = None

    def __enter__(self) -> Self:
        """Show the bar."""
        self._bar.start()
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        """Remove the bar."""
        self._bar.stop()

    def started(self, stage: str) -> None:
        """Start the bar of a stage."""
        self._task = self._bar.add_task(stage, total=1.0, text="")

    def update(self, fraction: float, text: str) -> None:
        """Move the bar."""
        if self._task is not None:
            self._bar.update(self._task, completed=fraction, text=text)

    def finished(self, stage: str, wall_s: float, cached: bool) -> None:
        """Print the stage's line and drop its bar."""
        if self._task is not None:
            self._bar.remove_task(self._task)
            self._task = None
        state = "reused" if cached else f"{wall_s:8.1f} s"
        self.console.print(f"  {stage:<18}{state:>12}", highlight=False)
