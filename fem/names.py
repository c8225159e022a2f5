"""Names of the parts of a model: each its own, and the nearest known ones where one is not known."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from difflib import get_close_matches

from fem.errors import FemInputError

_ALL, _NEAREST = 12, 6
"""How many known names an error lists, and how many where there are more."""


def nearest(name: str, known: Iterable[str], what: str) -> str:
    """What to say about an unknown name: ``what`` the known ones are, or those most like it where they are many."""
    names = sorted(set(known))
    if len(names) <= _ALL:
        return f"{what} {', '.join(names) or 'none'}"
    return f"nearest of {len(names)} names: {', '.join(get_close_matches(name, names, _NEAREST, 0.0))}"


def unlike(names: Sequence[str], what: str) -> None:
    """Refuse names that two of ``what`` share: results by name would show one of them only."""
    twice = [name for name in dict.fromkeys(names) if names.count(name) > 1]
    if twice:
        advice = "give each a name of its own"
        raise FemInputError(f"{what} of the same name", where="model", value=", ".join(twice), advice=advice)
