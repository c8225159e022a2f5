"""Runs stages in their order: reuses what is stored, stores what is computed, measures both."""

from __future__ import annotations

import logging
from collections.abc import Iterator, Sequence
from contextlib import contextmanager, suppress
from dataclasses import dataclass, replace
from pathlib import Path

from romgen.errors import InputError
from romgen.progress import RunProgress, SilentProgress
from romgen.resources import measured
from romgen.result_store import ResultStore, StageInfo
from romgen.run_lock import locked
from romgen.settings import Study
from romgen.stage import Context, Stage, stage_keys

log = logging.getLogger(__name__)


@dataclass(frozen=True)
class RunResult:
    """A finished run.

    Attributes
    ----------
    run_dir : folder with everything it left behind.
    computed, reused : names of the stages, in order.
    infos : time, memory and messages of every stage that is stored and up to date, reused and later ones too.
    context : gives the record of each stage: ``result.context.record("learn", Learned)``.
    messages : what was wrong with the stored results: damaged files that were moved aside.
    """

    run_dir: Path
    computed: tuple[str, ...]
    reused: tuple[str, ...]
    infos: dict[str, StageInfo]
    context: Context
    messages: tuple[str, ...] = ()


def execute(
    stages: Sequence[Stage],
    study: Study,
    run_dir: Path,
    *,
    until: str | None = None,
    force: bool = False,
    progress: RunProgress | None = None,
) -> RunResult:
    """Bring all stages up to ``until`` (default: all) up to date in ``run_dir``.

    Parameters
    ----------
    stages : in their order.
    until : name of the last stage to run.
    force : compute also what is stored.
    progress : told about stages and their fractions.

    Raises
    ------
    InputError : ``until`` names no stage, or another process runs in ``run_dir``.
    """
    names = [stage.name for stage in stages]
    if until is not None and until not in names:
        raise InputError("this study has no such stage", value=until, advice=f"stages are {', '.join(names)}")
    wanted = stages if until is None else stages[: names.index(until) + 1]
    keys = stage_keys(stages, study)
    with locked(run_dir), _log_file(run_dir / "run.log"):
        with _messages() as messages:
            store = ResultStore(run_dir)
        try:
            context = Context(study, run_dir, store, keys)
            result = _run(wanted, context, store, keys, (force, progress or SilentProgress()))
            return replace(result, messages=tuple(messages))
        finally:
            store.consolidate(keys)
            with suppress(OSError):  # not there, or a stage that failed keeps its segments in it
                (run_dir / "segments").rmdir()


def _run(
    stages: Sequence[Stage],
    context: Context,
    store: ResultStore,
    keys: dict[str, str],
    options: tuple[bool, RunProgress],
) -> RunResult:
    force, progress = options
    computed, reused = [], []
    for stage in stages:
        files = [context.run_dir / name for name in stage.files(context.study)]
        if not force and store.has(stage.name, keys[stage.name]) and all(file.is_file() for file in files):
            reused.append(stage.name)
        else:
            progress.started(stage.name)
            context.stage, context.key, context.report = stage.name, keys[stage.name], progress.update
            _compute(stage, context, store)
            computed.append(stage.name)
        progress.finished(stage.name, store.infos[stage.name].wall_s, stage.name in reused)
    return RunResult(context.run_dir, tuple(computed), tuple(reused), context.infos(), context)


def _compute(stage: Stage, context: Context, store: ResultStore) -> None:
    with _messages() as messages, measured() as usage:
        record = stage.compute(context)
    info = StageInfo(context.key, usage.wall_s, usage.peak_memory_bytes, tuple(messages))
    store.write(stage.name, record, info)
    context.remember(stage.name, record)
    log.info("%s: %.2f s, %.0f MB", stage.name, usage.wall_s, usage.peak_memory_bytes / 1e6)
    context.segments().clear()


class _Collector(logging.Handler):
    def __init__(self) -> None:
        super().__init__(logging.WARNING)
        self.lines: list[str] = []

    def emit(self, record: logging.LogRecord) -> None:
        self.lines.append(record.getMessage())


@contextmanager
def _handler(handler: logging.Handler) -> Iterator[None]:
    loggers = [logging.getLogger(name) for name in ("romgen", "fem")]
    levels = [logger.level for logger in loggers]
    for logger in loggers:
        logger.addHandler(handler)
        logger.setLevel(logging.INFO)
    try:
        yield
    finally:
        for logger, level in zip(loggers, levels, strict=True):
            logger.removeHandler(handler)
            logger.setLevel(level)
        handler.close()


@contextmanager
def _messages() -> Iterator[list[str]]:
    """Collect warnings and fallbacks that are logged in the block."""
    collector = _Collector()
    with _handler(collector):
        yield collector.lines


@contextmanager
def _log_file(path: Path) -> Iterator[None]:
    """Append everything that is logged in the block to the log file of the run folder."""
    handler = logging.FileHandler(path, encoding="utf-8")
    handler.setFormatter(logging.Formatter("%(asctime)s %(levelname)s %(name)s: %(message)s"))
    with _handler(handler):
        yield
