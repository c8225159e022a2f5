"""Named failures of the finite-element package: each says what, where, which value, what to do."""

from __future__ import annotations


class FemError(Exception):
    """Base of the failures that ``fem`` raises on purpose; ``last_good`` is what was computed before, or None."""

    exit_code = 1

    def __init__(self, what: str, *, where: str = "", value: object = None, advice: str = "") -> None:
        self.what, self.where, self.value, self.advice = what, where, value, advice
        self.last_good: object = None
        parts = [f"{where}: {what}" if where else what]
        if value is not None:
            parts.append(f"got {value if isinstance(value, str) else repr(value)}")
        if advice:
            parts.append(advice)
        super().__init__("; ".join(parts))


class FemInputError(FemError):
    """A mesh, name, material or load that cannot be used as given (exit code 2)."""

    exit_code = 2


class FemConvergenceError(FemError):
    """An iteration that did not reach its tolerance, with its residual history (exit code 3)."""

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
        self.last_contact: object = None
