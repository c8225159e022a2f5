"""The rules of FMI 2.0 for types, units of variables, and variables that share a reference."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from xml.etree.ElementTree import Element

DEFAULT_INITIAL = {
    "parameter": "exact",
    "calculatedParameter": "calculated",
    "output": "calculated",
    "local": "calculated",
}
UNTYPED = "none"
INT32 = (-(2.0**31), 2.0**31 - 1.0)


def type_rules(root: Element) -> Iterator[str]:
    """TypeDefinitions, and what variables take from them."""
    simple = list(root.iterfind("TypeDefinitions/SimpleType"))
    types = {t.get("name"): next(iter(t), Element(UNTYPED)) for t in simple}
    names = [t.get("name") for t in simple]
    variables = {v.get("name") for v in root.iter("ScalarVariable")}
    yield from (f"the type '{name}' is declared twice" for name in sorted(repeated(names)))
    yield from (
        f"the type '{name}' has the name of a variable" for name in sorted(n for n in types if n in variables and n)
    )
    for name, value in types.items():
        yield from _ranges(str(name), value)
        items = [(item.get("name"), item.get("value")) for item in value.iter("Item")]
        if any(len(set(column)) < len(items) for column in zip(*items, strict=True)):
            yield f"the type '{name}' gives two items the same name or value"
    for v in root.iter("ScalarVariable"):
        value = value_of(v)
        yield from _ranges(str(v.get("name")), value)
        yield from _within_type(str(v.get("name")), value, types.get(value.get("declaredType")))
    owners = [*types.items(), *((v.get("name"), value_of(v)) for v in root.iter("ScalarVariable"))]
    yield from _units_used(root, types, owners)


def _ranges(name: str, value: Element) -> Iterator[str]:
    if value.tag not in {"Real", "Integer", "Enumeration"}:
        return
    low, high = limits(value)
    if not low <= high:
        yield f"'{name}': min is above max"
    given = [float(value.get(key, "0")) for key in ("min", "max", "start")]
    if value.tag == "Integer" and not all(INT32[0] <= number <= INT32[1] for number in given):
        yield f"'{name}': a number is outside the 32-bit integers"


def _within_type(name: str, value: Element, declared: Element | None) -> Iterator[str]:
    if declared is None:
        return
    low, high = limits(value)
    least, most = limits(declared)
    if (value.get("min") is not None and low < least) or (value.get("max") is not None and high > most):
        yield f"'{name}': min or max exceeds the range of the type '{value.get('declaredType')}'"


def _units_used(
    root: Element, types: dict[str | None, Element], owners: list[tuple[str | None, Element]]
) -> Iterator[str]:
    units = {
        u.get("name"): {d.get("name") for d in u.iter("DisplayUnit")} for u in root.iterfind("UnitDefinitions/Unit")
    }
    for owner, value in owners:
        declared = types.get(value.get("declaredType")) if value.get("declaredType") else None
        if value.get("declaredType") and (declared is None or declared.tag != value.tag):
            yield f"'{owner}': no type '{value.get('declaredType')}' of this kind is declared"
        unit = value.get("unit") or (declared.get("unit") if declared is not None else None)
        if unit is not None and unit not in units:
            yield f"'{owner}': the unit '{unit}' is not declared"
        if value.get("displayUnit") and value.get("displayUnit") not in units.get(unit, set[str | None]()):
            yield f"'{owner}': the display unit '{value.get('displayUnit')}' is not one of '{unit}'"


def alias_rules(root: Element) -> Iterator[str]:
    """Variables of one kind with the same reference show one value."""
    seen: dict[tuple[str, str], list[Element]] = {}
    for v in root.iter("ScalarVariable"):
        seen.setdefault((value_of(v).tag, v.get("valueReference", "")), []).append(v)
    for (kind, reference), group in seen.items():
        if len(group) > 1:
            yield from (f"{kind} variables with the reference {reference}: {text}" for text in _aliases(group))


def _aliases(group: list[Element]) -> Iterator[str]:
    if len({value_of(v).get("unit") for v in group}) > 1:
        yield "different units"
    settable = [v for v in group if _settable(v)]
    if len(settable) > 1:
        yield "more than one can be set"
    if settable and any(v.get("causality") == "independent" for v in group):
        yield "one can be set and one is independent"
    constant = [v for v in group if v.get("variability") == "constant"]
    if len(constant) not in {0, len(group)}:
        yield "some are constant and some are not"
    if len({value_of(v).get("start") for v in constant}) > 1:
        yield "constants with different values"
    started = [v for v in group if v.get("variability") != "constant" and value_of(v).get("start") is not None]
    if len(started) > 1:
        yield "more than one has a start value"


def _settable(v: Element) -> bool:
    free = v.get("variability") != "constant" and initial_of(v) in {"exact", "approx"}
    return free or v.get("causality") == "input"


def initial_of(v: Element) -> str | None:
    """The value of initial, or its default."""
    causality = v.get("causality", "local")
    default = "exact" if v.get("variability") == "constant" else DEFAULT_INITIAL.get(causality)
    return v.get("initial", default)


def value_of(v: Element) -> Element:
    """The element Real, Integer, ... of a variable; an empty one with the tag UNTYPED where there is none."""
    kinds = (e for e in v if e.tag in {"Real", "Integer", "Boolean", "String", "Enumeration"})
    return next(kinds, Element(UNTYPED))


def limits(value: Element) -> tuple[float, float]:
    """Min and max, infinite where they are not given."""
    return float(value.get("min", "-inf")), float(value.get("max", "inf"))


def repeated(names: Sequence[str | None]) -> set[str]:
    """Names that occur more than once."""
    return {name for name in names if name is not None and names.count(name) > 1}
