"""The rules of FMI 3.0 for modelDescription.xml and the archive that its schema cannot state; clocks are left out.

Written after FMI 3.0, section 2.4; each message names the variable or element and the rule.
"""

from __future__ import annotations

import re
from collections.abc import Iterator
from xml.etree.ElementTree import Element

from romgen.fmu.rules_of_both import Rule, binary_rules, identity_rules
from romgen.fmu.rules_types import limits, repeated

FLOATS = {"Float32", "Float64"}
NUMBERS = FLOATS | {f"{sign}Int{bits}" for sign in ("", "U") for bits in (8, 16, 32, 64)} | {"Enumeration"}
PARAMETERS = {"structuralParameter", "parameter", "calculatedParameter"}
GIVEN, COMPUTED = {"exact"}, {"calculated", "approx"}
LEGAL: dict[tuple[str, str], set[str | None]] = {
    **{(kind, how): set(GIVEN) for kind in ("structuralParameter", "parameter") for how in ("fixed", "tunable")},
    **{(kind, how): set(COMPUTED) for kind in ("calculatedParameter", "local") for how in ("fixed", "tunable")},
    **{(kind, how): {*GIVEN, *COMPUTED} for kind in ("output", "local") for how in ("discrete", "continuous")},
    **{(kind, "constant"): set(GIVEN) for kind in ("output", "local")},
    ("input", "discrete"): {"exact"},
    ("input", "continuous"): {"exact"},
    ("independent", "continuous"): {None},
}
"""Values of initial by causality and variability (section 2.4.7.5); an input has none but a start value."""

PLATFORM = re.compile(r"(aarch32|aarch64|riscv32|riscv64|x86|x86_64|ppc32|ppc64)-(darwin|linux|windows)(-\w+)?")
INTERFACES = {"ModelExchange", "CoSimulation", "ScheduledExecution"}
INITIAL_KINDS = {"dependent", "constant"}
RUNNING_KINDS = {"dependent", "constant", "fixed", "tunable", "discrete"}


def head_rules(root: Element) -> Iterator[str]:
    """Identity, interfaces, time."""
    if not (root.get("fmiVersion") or "").startswith("3."):
        yield f"fmiVersion is '{root.get('fmiVersion')}'"
    if not root.get("instantiationToken"):
        yield "the instantiation token is missing"
    interfaces = [e for e in root if e.tag in INTERFACES]
    if not interfaces:
        yield "no interface is offered"
    yield from identity_rules(root, interfaces)


def type_rules(root: Element) -> Iterator[str]:
    """Types, units and ranges."""
    types = list(root.find("TypeDefinitions") or ())
    variables = _variables(root)
    names = [e.get("name") for e in types]
    yield from (f"the type '{name}' is declared twice" for name in sorted(repeated(names)))
    taken = {v.get("name") for v in variables} & set(names)
    yield from (f"the type '{name}' has the name of a variable" for name in sorted(str(n) for n in taken))
    declared = {(e.tag.removesuffix("Type"), e.get("name")): e for e in types}
    units = {
        u.get("name"): {d.get("name") for d in u.iter("DisplayUnit")} for u in root.iterfind("UnitDefinitions/Unit")
    }
    for e in [*types, *variables]:
        kind = declared.get((e.tag, e.get("declaredType")))
        if e.get("declaredType") and kind is None:
            yield f"'{e.get('name')}': no type '{e.get('declaredType')}' of this kind is declared"
        unit = e.get("unit") or (kind.get("unit") if kind is not None else None)
        if unit is not None and unit not in units:
            yield f"'{e.get('name')}': the unit '{unit}' is not declared"
        if e.get("displayUnit") and e.get("displayUnit") not in units.get(unit, set[str | None]()):
            yield f"'{e.get('name')}': the display unit '{e.get('displayUnit')}' is not one of '{unit}'"
        if e.tag.removesuffix("Type") in NUMBERS and not limits(e)[0] <= limits(e)[1]:
            yield f"'{e.get('name')}': min is above max"


def variable_rules(root: Element) -> Iterator[str]:
    """Names, references, kinds and start values."""
    variables = _variables(root)
    names = [v.get("name") for v in variables] + [alias.get("name") for v in variables for alias in v.iter("Alias")]
    yield from (f"the variable '{name}' occurs twice" for name in sorted(repeated(names)))
    references = [v.get("valueReference") for v in variables]
    yield from (f"the reference {reference} occurs twice" for reference in sorted(repeated(references)))
    if sum(v.get("causality") == "independent" for v in variables) > 1:
        yield "more than one variable is independent"
    exchanged = root.find("ModelExchange") is not None
    states = {v.get("derivative") for v in variables}
    for v in variables:
        yield from (f"'{v.get('name')}': {problem}" for problem in (*_kind(v), *_start(v), *_shape(v)))
        if v.get("reinit") is not None and not (exchanged and v.get("valueReference") in states):
            yield f"'{v.get('name')}': reinit is for states in Model Exchange"
        repeated_sets = v.get("canHandleMultipleSetPerTimeInstant") == "true"
        if repeated_sets and not (exchanged and v.get("causality") == "input"):
            yield f"'{v.get('name')}': canHandleMultipleSetPerTimeInstant is for inputs in Model Exchange"


def _kind(v: Element) -> Iterator[str]:
    causality, variability, initial = v.get("causality", "local"), _variability(v), _initial(v)
    allowed = LEGAL.get((causality, variability))
    if allowed is None or initial not in allowed:
        yield f"{causality}, {variability}, initial {initial} is no legal combination"
    if variability == "continuous" and v.tag not in FLOATS:
        yield "only Float variables are continuous"
    if causality in PARAMETERS and v.get("intermediateUpdate") == "true":
        yield "parameters take no intermediate updates"


def _start(v: Element) -> Iterator[str]:
    if v.tag in {"Clock", "String", "Binary"}:
        return
    given = v.get("start")
    needed = _initial(v) in {"exact", "approx"}
    if needed != (given is not None):
        yield f"a start value is {'missing' if needed else 'given for what is calculated'}"
    if given is None or v.tag not in NUMBERS:
        return
    values = [float(text) for text in given.split()]
    if len(values) not in {1, _length(v)}:
        yield f"{len(values)} start values for {_length(v)} elements"
    low, high = limits(v)
    if not all(low <= value <= high for value in values):
        yield "a start value is outside min and max"
    if v.tag in FLOATS and not float(v.get("nominal", "1")) > 0.0:
        yield "the nominal value is not positive"


def _shape(v: Element) -> Iterator[str]:
    for dimension in v.iter("Dimension"):
        if (dimension.get("start") is None) == (dimension.get("valueReference") is None):
            yield "a dimension has either a length or a reference"
        if v.get("causality") == "structuralParameter":
            yield "a structural parameter is no array"


def structure_rules(root: Element) -> Iterator[str]:
    """ModelStructure: what is listed, and on what it may depend."""
    variables = _variables(root)
    by_reference = {v.get("valueReference", ""): v for v in variables}
    rates = {r for r, v in by_reference.items() if v.get("derivative") is not None}
    states = {by_reference[r].get("derivative", "") for r in rates}
    for rate in sorted(rates):
        state = by_reference.get(by_reference[rate].get("derivative", ""))
        if state is None or _variability(state) != "continuous" or _length(state) != _length(by_reference[rate]):
            yield f"'{by_reference[rate].get('name')}': the derivative is of no continuous variable of its size"
    outputs = {r for r, v in by_reference.items() if v.get("causality") == "output"}
    computed = {r for r in outputs | states | rates if r in by_reference and _initial(by_reference[r]) in COMPUTED}
    computed |= {r for r, v in by_reference.items() if v.get("causality") == "calculatedParameter"}
    for part, expected, kinds in (
        ("Output", outputs, RUNNING_KINDS),
        ("ContinuousStateDerivative", rates, RUNNING_KINDS),
        ("InitialUnknown", computed, INITIAL_KINDS),
    ):
        entries = list(root.iterfind(f"ModelStructure/{part}"))
        listed = [e.get("valueReference", "") for e in entries]
        if set(listed) != expected or len(set(listed)) < len(listed):
            yield f"ModelStructure/{part} lists {sorted(listed)}, the variables ask for {sorted(expected)}"
        unknown = set(listed) if part == "InitialUnknown" else rates | outputs
        for e in entries:
            problems = _dependencies(e, set(by_reference) - unknown, kinds)
            yield from (f"ModelStructure/{part} {e.get('valueReference')}: {problem}" for problem in problems)


def _dependencies(entry: Element, known: set[str], kinds: set[str]) -> Iterator[str]:
    given, given_kinds = entry.get("dependencies", "").split(), entry.get("dependenciesKind", "").split()
    if not set(given) <= known:
        yield f"{sorted(set(given) - known)} are no knowns"
    if entry.get("dependenciesKind") is not None and len(given) != len(given_kinds):
        yield "dependencies and dependenciesKind differ in length"
    if not set(given_kinds) <= kinds:
        yield f"{sorted(set(given_kinds) - kinds)} is no kind allowed here"


def archive_problems3(root: Element, names: list[str], build: Element | None) -> tuple[str, ...]:
    """The rules that concern the files beside the description; ``build`` is buildDescription.xml."""
    problems = list(binary_rules(names, {e.get("modelIdentifier") for e in root if e.tag in INTERFACES}, PLATFORM))
    if build is None and any(name.startswith("sources/") for name in names):
        problems.append("sources/ has no buildDescription.xml")
    for configuration in build.iter("BuildConfiguration") if build is not None else ():
        files = [file.get("name") for file in configuration.iter("SourceFile")]
        problems.extend(f"the source file '{file}' is missing" for file in files if f"sources/{file}" not in names)
        problems.extend(f"the source file '{file}' is listed twice" for file in sorted(repeated(files)))
    return tuple(problems)


RULES3: tuple[Rule, ...] = (head_rules, type_rules, variable_rules, structure_rules)


def _variables(root: Element) -> list[Element]:
    return list(root.iterfind("ModelVariables/*"))


def _variability(v: Element) -> str:
    if v.get("causality") in PARAMETERS:
        return v.get("variability", "fixed")
    return v.get("variability", "continuous" if v.tag in FLOATS else "discrete")


def _initial(v: Element) -> str | None:
    """The value of initial, or its default."""
    causality = v.get("causality", "local")
    if causality == "independent":
        return v.get("initial")
    given = causality in {"input", "parameter", "structuralParameter"} or v.get("variability") == "constant"
    return v.get("initial", "exact" if given else "calculated")


def _length(v: Element) -> int:
    """Elements of an array of fixed size; 1 for a scalar."""
    n = 1
    for dimension in v.iter("Dimension"):
        n *= int(dimension.get("start", "1"))
    return n
