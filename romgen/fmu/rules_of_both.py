"""What the rules of FMI 2.0 and 3.0 have in common: applying them, identity, files beside the description."""

from __future__ import annotations

import re
from collections.abc import Callable, Iterator, Sequence
from pathlib import Path
from xml.etree.ElementTree import Element

from romgen.fmu.rules_types import repeated

Rule = Callable[[Element], Iterator[str]]
LIBRARIES = {".so", ".dll", ".dylib"}


def applied(rules: Sequence[Rule], root: Element) -> tuple[str, ...]:
    """Every problem that the rules find; what cannot be read at all, as a text where a number belongs, is one too."""
    problems: list[str] = []
    for rule in rules:
        try:
            problems.extend(rule(root))
        except (ValueError, KeyError, IndexError) as error:
            problems.append(f"the description cannot be read ({error}); the rest of {rule.__name__} was not checked")
    return tuple(problems)


def identity_rules(root: Element, interfaces: Sequence[Element]) -> Iterator[str]:
    """Model identifiers, time of generation, log categories."""
    for e in interfaces:
        if not re.fullmatch(r"[A-Za-z_]\w*", e.get("modelIdentifier", ""), re.ASCII):
            yield f"{e.tag}: the model identifier '{e.get('modelIdentifier')}' is no C name"
    date = root.get("generationDateAndTime")
    if date is not None and not re.fullmatch(r"\d{4}-\d\d-\d\dT\d\d:\d\d:\d\d(\.\d+)?Z", date):
        yield f"generationDateAndTime '{date}' is not YYYY-MM-DDThh:mm:ssZ"
    categories = [e.get("name") for e in root.iter("Category")]
    yield from (f"the log category '{name}' occurs twice" for name in sorted(repeated(categories)))


def binary_rules(names: Sequence[str], identifiers: set[str | None], platform: re.Pattern[str]) -> Iterator[str]:
    """Paths of the archive, folders of platforms, names of libraries, and that there is something to run."""
    yield from (f"the path '{name}' holds a backslash" for name in names if "\\" in name)
    for name in names:
        parts = name.split("/")
        if parts[0] == "binaries" and len(parts) > 2 and parts[2]:
            if not platform.fullmatch(parts[1]):
                yield f"'{parts[1]}' is no platform of binaries/"
            if Path(name).suffix in LIBRARIES and Path(name).stem not in identifiers:
                yield f"the library '{name}' is not named after the model identifier"
    if not any(name.startswith(("binaries/", "sources/")) and not name.endswith("/") for name in names):
        yield "there is neither a binary nor a source file"
