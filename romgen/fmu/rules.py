"""The rules of FMI 2.0 for modelDescription.xml and the archive that its schema cannot state.

Written from the text of FMI 2.0.5, sections 2.2 and 2.3; each message names the variable or element and the rule.
"""

from __future__ import annotations

import re
import zipfile
from collections.abc import Callable, Iterator, Sequence
from pathlib import Path
from xml.etree import ElementTree
from xml.etree.ElementTree import Element

from romgen.errors import InputError
from romgen.fmu.rules_structure import structure_rules

LEGAL: dict[tuple[str, str], set[str | None]] = {
    ("parameter", "fixed"): {"exact"},
    ("parameter", "tunable"): {"exact"},
    ("calculatedParameter", "fixed"): {"calculated", "approx"},
    ("calculatedParameter", "tunable"): {"calculated", "approx"},
    ("input", "discrete"): {None},
    ("input", "continuous"): {None},
    ("output", "constant"): {"exact"},
    ("output", "discrete"): {"calculated", "exact", "approx"},
    ("output", "continuous"): {"calculated", "exact", "approx"},
    ("local", "constant"): {"exact"},
    ("local", "fixed"): {"calculated", "approx"},
    ("local", "tunable"): {"calculated", "approx"},
    ("local", "discrete"): {"calculated", "exact", "approx"},
    ("local", "continuous"): {"calculated", "exact", "approx"},
    ("independent", "continuous"): {None},
}
"""Values of initial by causality and variability (FMI 2.0.5, table of section 2.2.7)."""

DEFAULT_INITIAL = {
    "parameter": "exact",
    "calculatedParameter": "calculated",
    "output": "calculated",
    "local": "calculated",
}
BASE_UNITS = {"kg", "m", "s", "A", "K", "mol", "cd", "rad", "factor", "offset"}
PLATFORMS = re.compile(r"(win|linux|darwin)(32|64)|(aarch64|aarch32|x86|x86_64|riscv64)-(linux|darwin|windows)")


def rule_problems(path: Path | str) -> tuple[str, ...]:
    """What a unit breaks of the rules of FMI 2.0, one sentence each; empty for one that keeps them all.

    Raises
    ------
    InputError : the file is no archive with a readable model description.
    """
    try:
        with zipfile.ZipFile(path) as archive:
            root = ElementTree.fromstring(archive.read("modelDescription.xml"))
            names = archive.namelist()
    except (OSError, KeyError, zipfile.BadZipFile, ElementTree.ParseError) as error:
        raise InputError(f"is not an FMU ({error})", where=str(path)) from error
    return (*description_problems(root), *archive_problems(root, names))


def description_problems(root: Element) -> tuple[str, ...]:
    """The rules that concern modelDescription.xml alone."""
    rules: tuple[Callable[[Element], Iterator[str]], ...] = (
        _head, _units, _types, _names, _kinds, _values, _aliases, structure_rules,
    )  # fmt: skip
    return tuple(problem for rule in rules for problem in rule(root))


def archive_problems(root: Element, names: list[str]) -> tuple[str, ...]:
    """The rules that concern the files beside it."""
    problems = [f"the path '{name}' holds a backslash" for name in names if "\\" in name]
    identifiers = {e.get("modelIdentifier") for e in root if e.tag in {"ModelExchange", "CoSimulation"}}
    for name in names:
        parts = name.split("/")
        if parts[0] == "binaries" and len(parts) > 2 and parts[2]:
            if not PLATFORMS.fullmatch(parts[1]):
                problems.append(f"'{parts[1]}' is no platform of binaries/")
            if Path(name).suffix in {".so", ".dll", ".dylib"} and Path(name).stem not in identifiers:
                problems.append(f"the library '{name}' is not named after the model identifier")
    missing = [file.get("name") for file in root.iter("File") if f"sources/{file.get('name')}" not in names]
    problems.extend(f"the source file '{name}' is missing" for name in missing)
    if not any(name.startswith(("binaries/", "sources/")) and not name.endswith("/") for name in names):
        problems.append("there is neither a binary nor a source file")
    return tuple(problems)


def _head(root: Element) -> Iterator[str]:
    if root.get("fmiVersion") != "2.0":
        yield f"fmiVersion is '{root.get('fmiVersion')}', not '2.0'"
    if not root.get("guid"):
        yield "the GUID is missing"
    interfaces = [e for e in root if e.tag in {"ModelExchange", "CoSimulation"}]
    if not interfaces:
        yield "neither ModelExchange nor CoSimulation is offered"
    for e in interfaces:
        if not re.fullmatch(r"[A-Za-z_]\w*", e.get("modelIdentifier", ""), re.ASCII):
            yield f"{e.tag}: the model identifier '{e.get('modelIdentifier')}' is no C name"
    date = root.get("generationDateAndTime")
    if date is not None and not re.fullmatch(r"\d{4}-\d\d-\d\dT\d\d:\d\d:\d\d(\.\d+)?Z", date):
        yield f"generationDateAndTime '{date}' is not YYYY-MM-DDThh:mm:ssZ"
    categories = [e.get("name") for e in root.iter("Category")]
    yield from (f"the log category '{name}' occurs twice" for name in sorted(_repeated(categories)))
    experiment = root.find("DefaultExperiment")
    if experiment is not None:
        start, stop = (float(experiment.get(key, "nan")) for key in ("startTime", "stopTime"))
        if stop < start:
            yield "DefaultExperiment: the stop time is before the start time"
        if any(float(experiment.get(key, "1")) <= 0.0 for key in ("stepSize", "tolerance")):
            yield "DefaultExperiment: step size and tolerance must be positive"


def _units(root: Element) -> Iterator[str]:
    units = list(root.iterfind("UnitDefinitions/Unit"))
    yield from (f"the unit '{name}' is declared twice" for name in sorted(_repeated([u.get("name") for u in units])))
    for unit in units:
        displays = [d.get("name") for d in unit.iter("DisplayUnit")]
        yield from (f"display unit '{d}' of '{unit.get('name')}' occurs twice" for d in sorted(_repeated(displays)))
        for base in unit.iter("BaseUnit"):
            if not set(base.keys()) <= BASE_UNITS:
                yield f"unit '{unit.get('name')}' has an unknown base unit"
        for d in unit.iter("DisplayUnit"):
            if float(d.get("factor", "1")) == 0.0:
                yield f"display unit '{d.get('name')}' has the factor 0"


def _types(root: Element) -> Iterator[str]:
    types = {t.get("name"): t[0] for t in root.iterfind("TypeDefinitions/SimpleType")}
    names = [t.get("name") for t in root.iterfind("TypeDefinitions/SimpleType")]
    variables = {v.get("name") for v in root.iter("ScalarVariable")}
    yield from (f"the type '{name}' is declared twice" for name in sorted(_repeated(names)))
    yield from (
        f"the type '{name}' has the name of a variable" for name in sorted(n for n in types if n in variables and n)
    )
    units = {
        u.get("name"): {d.get("name") for d in u.iter("DisplayUnit")} for u in root.iterfind("UnitDefinitions/Unit")
    }
    for owner, value in [*types.items(), *((v.get("name"), _value(v)) for v in root.iter("ScalarVariable"))]:
        declared = types.get(value.get("declaredType")) if value.get("declaredType") else None
        if value.get("declaredType") and (declared is None or declared.tag != value.tag):
            yield f"'{owner}': no type '{value.get('declaredType')}' of this kind is declared"
        unit = value.get("unit") or (declared.get("unit") if declared is not None else None)
        if unit is not None and unit not in units:
            yield f"'{owner}': the unit '{unit}' is not declared"
        if value.get("displayUnit") and value.get("displayUnit") not in units.get(unit, set[str | None]()):
            yield f"'{owner}': the display unit '{value.get('displayUnit')}' is not one of '{unit}'"


def _names(root: Element) -> Iterator[str]:
    names = [v.get("name", "") for v in root.iter("ScalarVariable")]
    yield from (f"the variable '{name}' occurs twice" for name in sorted(_repeated(names)))
    for name in names:
        if not name or re.search(r"[\r\n\t]", name):
            yield f"the variable name {name!r} is empty or holds a line end or tab"


def _kinds(root: Element) -> Iterator[str]:
    variables = list(root.iter("ScalarVariable"))
    if sum(v.get("causality") == "independent" for v in variables) > 1:
        yield "more than one variable is independent"
    for v in variables:
        causality, variability = v.get("causality", "local"), v.get("variability", "continuous")
        initial = _initial(v)
        allowed = LEGAL.get((causality, variability))
        if allowed is None or initial not in allowed:
            yield f"'{v.get('name')}': {causality}, {variability}, initial {initial} is no legal combination"
        if variability == "continuous" and _value(v).tag != "Real":
            yield f"'{v.get('name')}': only Real variables are continuous"


def _values(root: Element) -> Iterator[str]:
    for v in root.iter("ScalarVariable"):
        name, value = v.get("name"), _value(v)
        needs = _initial(v) in {"exact", "approx"} or v.get("causality") == "input"
        if needs != (value.get("start") is not None):
            yield f"'{name}': a start value is {'missing' if needs else 'given for what is calculated'}"
        if value.tag not in {"Real", "Integer"}:
            continue
        low, high = (float(value.get(key, default)) for key, default in (("min", "-inf"), ("max", "inf")))
        if not low <= high:
            yield f"'{name}': min is above max"
        if value.get("start") is not None and not low <= float(value.get("start", "0")) <= high:
            yield f"'{name}': the start value is outside min and max"
        if value.tag == "Real" and not float(value.get("nominal", "1")) > 0.0:
            yield f"'{name}': the nominal value is not positive"


def _aliases(root: Element) -> Iterator[str]:
    seen: dict[tuple[str, str], list[Element]] = {}
    for v in root.iter("ScalarVariable"):
        seen.setdefault((_value(v).tag, v.get("valueReference", "")), []).append(v)
    for (kind, reference), group in seen.items():
        if len({_value(v).get("unit") for v in group}) > 1:
            yield f"{kind} variables with the reference {reference} have different units"
        settable = [v for v in group if v.get("causality") in {"input", "parameter"} or _initial(v) == "exact"]
        if len(settable) > 1:
            yield f"{kind} variables with the reference {reference}: more than one can be set"


def _initial(v: Element) -> str | None:
    """The value of initial, or its default."""
    causality = v.get("causality", "local")
    default = "exact" if v.get("variability") == "constant" else DEFAULT_INITIAL.get(causality)
    return v.get("initial", default)


def _value(v: Element) -> Element:
    """The element Real, Integer, ... of a variable."""
    return next(e for e in v if e.tag in {"Real", "Integer", "Boolean", "String", "Enumeration"})


def _repeated(names: Sequence[str | None]) -> set[str]:
    return {name for name in names if name is not None and names.count(name) > 1}
