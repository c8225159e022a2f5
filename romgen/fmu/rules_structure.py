"""The rules of FMI 2.0 for ModelStructure: which unknowns are listed, and what they may depend on."""

from __future__ import annotations

from collections.abc import Iterator
from xml.etree.ElementTree import Element

RUNNING_KINDS = {"dependent", "constant", "fixed", "tunable", "discrete"}
INITIAL_KINDS = {"dependent", "constant"}


def structure_rules(root: Element) -> Iterator[str]:
    """Problems of ModelStructure, one sentence each."""
    variables = list(root.iter("ScalarVariable"))
    reals = [v.find("Real") for v in variables]
    state_of = {
        k: int(r.get("derivative", "0")) for k, r in enumerate(reals, 1) if r is not None and r.get("derivative")
    }
    yield from _derivatives(variables, state_of)
    states = {state for state in state_of.values() if 1 <= state <= len(variables)}
    causality = {k: v.get("causality", "local") for k, v in enumerate(variables, 1)}
    outputs = [k for k in causality if causality[k] == "output"]
    rates = sorted(state_of)
    computed = {k for k, v in enumerate(variables, 1) if v.get("initial", "calculated") in {"calculated", "approx"}}
    initial = {k for k in (*outputs, *states, *rates) if k in computed}
    initial |= {k for k in causality if causality[k] == "calculatedParameter"}
    inputs = {k for k in causality if causality[k] in {"input", "independent"}}
    given = {k for k, v in enumerate(variables, 1) if v.get("initial") == "exact" or causality[k] == "parameter"}
    tuned = {k for k in given if variables[k - 1].get("variability") in {"fixed", "tunable"}}
    yield from _listed(root, "Outputs", set(outputs), inputs | states | tuned, RUNNING_KINDS)
    yield from _listed(root, "Derivatives", set(rates), inputs | states | tuned, RUNNING_KINDS)
    yield from _listed(root, "InitialUnknowns", initial, inputs | given, INITIAL_KINDS)


def _derivatives(variables: list[Element], state_of: dict[int, int]) -> Iterator[str]:
    for k, state in state_of.items():
        name = variables[k - 1].get("name")
        if not 1 <= state <= len(variables) or state == k:
            yield f"'{name}': the attribute derivative points to no other variable"
        elif variables[state - 1].find("Real") is None or variables[state - 1].get("variability") != "continuous":
            yield f"'{name}': the attribute derivative points to a variable that is not a continuous Real"
    if len(set(state_of.values())) < len(state_of):
        yield "a state has two derivatives"


def _listed(root: Element, part: str, expected: set[int], known: set[int], kinds: set[str]) -> Iterator[str]:
    entries = list(root.iterfind(f"ModelStructure/{part}/Unknown"))
    indices = [int(e.get("index", "0")) for e in entries]
    if len(indices) != len(set(indices)):
        yield f"ModelStructure/{part} lists a variable twice"
    if set(indices) != expected:
        yield f"ModelStructure/{part} lists {sorted(set(indices))}, the variables ask for {sorted(expected)}"
    if part == "InitialUnknowns" and indices != sorted(indices):
        yield "ModelStructure/InitialUnknowns is not in ascending order"
    for entry, index in zip(entries, indices, strict=True):
        where = f"ModelStructure/{part}, index {index}"
        dependencies = [int(k) for k in entry.get("dependencies", "").split()]
        given_kinds = entry.get("dependenciesKind", "").split()
        if dependencies != sorted(set(dependencies)):
            yield f"{where}: the dependencies are not in ascending order"
        if not set(dependencies) <= known:
            yield f"{where}: {sorted(set(dependencies) - known)} are no knowns"
        if entry.get("dependenciesKind") is not None and len(given_kinds) != len(dependencies):
            yield f"{where}: dependencies and dependenciesKind differ in length"
        if not set(given_kinds) <= kinds:
            yield f"{where}: {sorted(set(given_kinds) - kinds)} is no kind allowed here"
