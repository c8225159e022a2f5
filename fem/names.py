"""Names of the parts of a model: each its own, and the nearest known ones where one is not known."""

from __future__ import annotations

from collections.abc import Sequence

from fem.errors import FemInputError


def unlike(names: Sequence[str], what: str) -> None:
    """Refuse names that two of ``what`` share: results by name would show one of them only."""
    twice = [name for name in dict.fromkeys(names) if names.count(name) > 1]
    if twice:
        advice = "give each a name of its own"
        raise FemInputError(f"{what} of the same name", where="model", value=", ".join(twice), advice=advice)
