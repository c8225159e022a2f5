"""The rules of FMI 2.0 for modelDescription.xml and the archive that its schema cannot state; the door to all rules.

Written from the text of FMI 2.0.5, sections 2.2 and 2.3; each message names the variable or element and the rule.
"""

from __future__ import annotations

import re
import zipfile
from collections.abc import Iterator
from pathlib import Path
from xml.etree import ElementTree
from xml.etree.ElementTree import Element

from romgen.errors import InputError
from romgen.fmu.rules3 import RULES3, archive_problems3
from romgen.fmu.rules_of_both import applied, binary_rules, identity_rules
from romgen.fmu.rules_structure import structure_rules
from romgen.fmu.rules_types import UNTYPED, alias_rules, initial_of, limits, repeated, type_rules, value_of

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

BUILD = "sources/buildDescription.xml"
BASE_UNITS = {"kg", "m", "s", "A", "K", "mol", "cd", "rad", "factor", "offset"}
B_NAME = r"([A-Za-z_]\w*|'([^'\\]|\\.)+')"
PATH = rf"{B_NAME}(\[\d+(,\d+)*\])?(\.{B_NAME}(\[\d+(,\d+)*\])?)*"
STRUCTURED = re.compile(rf"{PATH}|der\({PATH}(,\d+)?\)", re.ASCII)
"""Names of the structured convention (FMI 2.0.5, section 2.2.9)."""

PLATFORMS = re.compile(r"(win|linux|darwin)(32|64)|(aarch64|aarch32|x86|x86_64|riscv64)-(linux|darwin|windows)")


def rule_problems(path: Path | str) -> tuple[str, ...]:
    """What a unit breaks of the rules of FMI 2.0 or 3.0, one sentence each; empty for one that keeps them all.

    Raises
    ------
    InputError : the file is no archive with a readable model description.
    """
    build = None
    try:
        with zipfile.ZipFile(path) as archive:
            root = ElementTree.fromstring(archive.read("modelDescription.xml"))
            names = archive.namelist()
            if BUILD in names:
                build = ElementTree.fromstring(archive.read(BUILD))
    except (OSError, KeyError, zipfile.BadZipFile, ElementTree.ParseError) as error:
        raise InputError(f"is not an FMU ({error})", where=str(path)) from error
    if (root.get("fmiVersion") or "").startswith("3."):
        return (*description_problems3(root), *archive_problems3(root, names, build))
    return (*description_problems(root), *archive_problems(root, names))


def description_problems3(root: Element) -> tuple[str, ...]:
    """The rules of FMI 3.0 that concern modelDescription.xml alone."""
    return applied((*RULES3, _experiment, _units), root)


def description_problems(root: Element) -> tuple[str, ...]:
    """The rules of FMI 2.0 that concern modelDescription.xml alone."""
    rules = (
        _head, _experiment, _units, type_rules, _names, _kinds, _values, _special, alias_rules, structure_rules,
    )  # fmt: skip
    return applied(rules, root)


def archive_problems(root: Element, names: list[str]) -> tuple[str, ...]:
    """The rules that concern the files beside it."""
    identifiers = {e.get("modelIdentifier") for e in root if e.tag in {"ModelExchange", "CoSimulation"}}
    missing = [file.get("name") for file in root.iter("File") if f"sources/{file.get('name')}" not in names]
    problems = [f"the source file '{name}' is missing" for name in missing]
    return (*binary_rules(names, identifiers, PLATFORMS), *problems)


def _head(root: Element) -> Iterator[str]:
    if root.get("fmiVersion") != "2.0":
        yield f"fmiVersion is '{root.get('fmiVersion')}', not '2.0'"
    if not root.get("guid"):
        yield "the GUID is missing"
    interfaces = [e for e in root if e.tag in {"ModelExchange", "CoSimulation"}]
    if not interfaces:
        yield "neither ModelExchange nor CoSimulation is offered"
    yield from identity_rules(root, interfaces)
    tools = [tool.get("name") for tool in root.iterfind("VendorAnnotations/Tool")]
    yield from (f"two annotations of the tool '{name}'" for name in sorted(repeated(tools)))
    for e in interfaces:
        files = [file.get("name") for file in e.iter("File")]
        yield from (f"{e.tag}: the source file '{name}' is listed twice" for name in sorted(repeated(files)))


def _experiment(root: Element) -> Iterator[str]:
    """Also of FMI 3.0."""
    experiment = root.find("DefaultExperiment")
    if experiment is None:
        return
    start, stop, step = (float(experiment.get(key, "nan")) for key in ("startTime", "stopTime", "stepSize"))
    if stop <= start:
        yield "DefaultExperiment: the stop time is not after the start time"
    if step >= stop - start > 0.0:
        yield "DefaultExperiment: the step is not shorter than the experiment"
    if any(float(experiment.get(key, "1")) <= 0.0 for key in ("stepSize", "tolerance")):
        yield "DefaultExperiment: step size and tolerance must be positive"


def _units(root: Element) -> Iterator[str]:
    units = list(root.iterfind("UnitDefinitions/Unit"))
    yield from (f"the unit '{name}' is declared twice" for name in sorted(repeated([u.get("name") for u in units])))
    for unit in units:
        displays = [d.get("name") for d in unit.iter("DisplayUnit")]
        yield from (f"display unit '{d}' of '{unit.get('name')}' occurs twice" for d in sorted(repeated(displays)))
        for base in unit.iter("BaseUnit"):
            if not set(base.keys()) <= BASE_UNITS:
                yield f"unit '{unit.get('name')}' has an unknown base unit"
        for d in unit.iter("DisplayUnit"):
            if float(d.get("factor", "1")) == 0.0:
                yield f"display unit '{d.get('name')}' has the factor 0"


def _names(root: Element) -> Iterator[str]:
    names = [v.get("name", "") for v in root.iter("ScalarVariable")]
    yield from (f"the variable '{name}' occurs twice" for name in sorted(repeated(names)))
    for name in names:
        if not name or re.search(r"[\r\n\t]", name):
            yield f"the variable name {name!r} is empty or holds a line end or tab"
        elif root.get("variableNamingConvention") == "structured" and not STRUCTURED.fullmatch(name):
            yield f"the variable name '{name}' is not structured"


def _kinds(root: Element) -> Iterator[str]:
    variables = list(root.iter("ScalarVariable"))
    yield from (f"'{v.get('name')}': the variable has no type" for v in variables if value_of(v).tag == UNTYPED)
    if sum(v.get("causality") == "independent" for v in variables) > 1:
        yield "more than one variable is independent"
    for v in variables:
        causality, variability = v.get("causality", "local"), v.get("variability", "continuous")
        initial = initial_of(v)
        allowed = LEGAL.get((causality, variability))
        if allowed is None or initial not in allowed:
            yield f"'{v.get('name')}': {causality}, {variability}, initial {initial} is no legal combination"
        if variability == "continuous" and value_of(v).tag != "Real":
            yield f"'{v.get('name')}': only Real variables are continuous"


def _values(root: Element) -> Iterator[str]:
    for v in root.iter("ScalarVariable"):
        name, value = v.get("name"), value_of(v)
        needs = initial_of(v) in {"exact", "approx"} or v.get("causality") == "input"
        if needs != (value.get("start") is not None):
            yield f"'{name}': a start value is {'missing' if needs else 'given for what is calculated'}"
        if value.tag not in {"Real", "Integer"}:
            continue
        low, high = limits(value)
        if value.get("start") is not None and not low <= float(value.get("start", "0")) <= high:
            yield f"'{name}': the start value is outside min and max"
        if value.tag == "Real" and not float(value.get("nominal", "1")) > 0.0:
            yield f"'{name}': the nominal value is not positive"


def _special(root: Element) -> Iterator[str]:
    """Attributes that only some variables may have."""
    exchanged = root.find("ModelExchange") is not None
    states = {value_of(v).get("derivative") for v in root.iter("ScalarVariable")}
    for k, v in enumerate(root.iter("ScalarVariable"), 1):
        repeated_sets = v.get("canHandleMultipleSetPerTimeInstant") == "true"
        if repeated_sets and not (exchanged and v.get("causality") == "input"):
            yield f"'{v.get('name')}': canHandleMultipleSetPerTimeInstant is for inputs in Model Exchange"
        if value_of(v).get("reinit") is not None and not (exchanged and str(k) in states):
            yield f"'{v.get('name')}': reinit is for states in Model Exchange"
