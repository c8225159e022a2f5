"""Named failures of romgen: each says what, where, which value, and what to do."""

from __future__ import annotations

import errno

# Entries of an array that an error shows.
SHOWN_ENTRIES = 12


def _shown(value: object) -> str:
    """Return a value in one line; numbers of numpy as plain ones (by their own method: no import for an error)."""
    if isinstance(value, str):
        return value
    if isinstance(value, tuple | list):
        inside = ", ".join(repr(entry) if isinstance(entry, str) else _shown(entry) for entry in value)
        if isinstance(value, list):
            return f"[{inside}]"
        return f"({inside},)" if len(value) == 1 else f"({inside})"
    if not hasattr(value, "tolist"):
        return " ".join(repr(value).split())
    if getattr(value, "ndim", 0) == 0:
        return repr(value.tolist())
    flat = value.ravel().tolist()  # type: ignore[attr-defined]
    entries = [f"{entry:.5g}" if isinstance(entry, float | complex) else str(entry) for entry in flat[:SHOWN_ENTRIES]]
    return " ".join(entries) + (f" .. ({len(flat)} entries)" if len(flat) > SHOWN_ENTRIES else "")


class RomgenError(Exception):
    """Base of all failures that a user sees as one line, never as a stack trace.

    Parameters
    ----------
    what : the failure in one clause.
    where : file, table, record or stage that it concerns.
    value : the offending value, shown with ``repr`` unless it is a string; arrays with five digits, the first few
        entries, in one line.
    advice : what to do about it.
    """

    exit_code = 1

    def __init__(self, what: str, *, where: str = "", value: object = None, advice: str = "") -> None:
        self.what, self.where, self.value, self.advice = what, where, value, advice
        parts = [f"{where}: {what}" if where else what]
        if value is not None:
            parts.append(f"got {_shown(value)}")
        if advice:
            parts.append(advice)
        super().__init__("; ".join(parts))


class InputError(RomgenError):
    """A study, file or argument that cannot be used as given (exit code 2)."""

    exit_code = 2


class NumericalError(RomgenError):
    """A computation that did not reach its tolerance (exit code 3)."""

    exit_code = 3

    def __init__(
        self,
        what: str,
        *,
        where: str = "",
        value: object = None,
        advice: str = "",
        history: tuple[float, ...] = (),
    ) -> None:
        super().__init__(what, where=where, value=value, advice=advice)
        self.history = history


class AcceptanceError(RomgenError):
    """A finished result that misses a stated acceptance limit (exit code 4)."""

    exit_code = 4


class StoreError(RomgenError):
    """A result file that is truncated, of another schema, or not writable (exit code 2)."""

    exit_code = 2


def system_error(error: OSError) -> StoreError:
    """Say in one line what the system refused: no permission, no such folder, no space left."""
    full = error.errno in (errno.ENOSPC, errno.EDQUOT)
    advice = "make room; what was finished is kept" if full else "check the path and its permissions"
    return StoreError(error.strerror or str(error), where=str(error.filename or ""), advice=advice)
