"""The rules of FMI 3.0 find nothing in exported units, and every seeded fault in a damaged one."""

from __future__ import annotations

import re
import zipfile
from pathlib import Path
from xml.etree import ElementTree

import numpy as np
import pytest

from romgen.fmu.export3 import export_fmi3
from romgen.fmu.rules import description_problems3, rule_problems
from romgen.fmu.rules3 import archive_problems3
from romgen.reduced_model import ReducedModel
from romgen.settings import FmuSettings
from tests.romgen.fmu.damage import damaged
from tests.romgen.fmu.models import random_model


@pytest.fixture(scope="module")
def text(tmp_path_factory: pytest.TempPathFactory) -> str:
    """The model description as it is exported."""
    path = tmp_path_factory.mktemp("rules3") / "x.fmu"
    export_fmi3(random_model(3, 2), path, FmuSettings(platforms=()))
    with zipfile.ZipFile(path) as archive:
        return archive.read("modelDescription.xml").decode()


@pytest.mark.parametrize("kwargs", [{}, {"absolute": True, "start": "sensors"}])
def test_exported_units_keep_every_rule(kwargs: dict, model: ReducedModel, tmp_path: Path) -> None:
    export = export_fmi3(model, tmp_path / "x.fmu", FmuSettings(platforms=(), **kwargs))
    assert rule_problems(export.path) == ()


FAULTS = [
    (r'fmiVersion="3.0"', 'fmiVersion="4.0"', "fmiVersion"),
    (r'instantiationToken="[^"]*"', 'instantiationToken=""', "token"),
    (r'(<CoSimulation\s+modelIdentifier=")', r"\g<1>1-", "no C name"),
    (r'(generationDateAndTime="[^"]*)Z"', r'\1"', "generationDateAndTime"),
    (r'name="logAll"', 'name="logStatusError"', "log category"),
    (r'stopTime="[^"]*"', 'stopTime="0"', "stop time is not after"),
    (r'<Unit name="m/s">', '<Unit name="m">', "declared twice"),
    (r'<Float64Type name="Time"', '<Float64Type name="Rate"', "type 'Rate' is declared twice"),
    (r'<Float64Type name="Time"', '<Float64Type name="z"', "has the name of a variable"),
    (r'declaredType="Time"', 'declaredType="Clock"', "no type 'Clock'"),
    (r'(<Float64 name="z".*unit=")1"', r'\g<1>kg"', "unit 'kg' is not declared"),
    (r'(<Float64 name="displacement".*displayUnit=")mm', r"\1yd", "display unit 'yd'"),
    (r'(<Float64 name="base_acceleration")', r'\1 min="1" max="0"', "min is above max"),
    (r'(<Float64 name="base_acceleration")', r'\1 min="1"', "start value is outside"),
    (r'<Float64 name="der_z"', '<Float64 name="z"', "variable 'z' occurs twice"),
    (r'(name="der_z" valueReference=")\d+', r"\g<1>0", "reference 0 occurs twice"),
    (r'(name="trust_ratio"[^>]*variability=")continuous', r"\1fixed", "no legal combination"),
    (r'(name="inside_trust_region"[^>]*variability=")discrete', r"\1continuous", "only Float"),
    (r'(name="input_gain")', r'\1 intermediateUpdate="true"', "no intermediate updates"),
    (r'(name="z"[^>]*) start="[^"]*"', r"\1", "start value is missing"),
    (r'(name="trust_ratio")', r'\1 start="0"', "given for what is calculated"),
    (r'(name="z"[^>]*) start="[^"]*"', r'\1 start="0 0 0"', "3 start values for 4 elements"),
    (r'(name="z"[^>]*) nominal="[^"]*"', r'\1 nominal="0"', "nominal"),
    (r'<Dimension start="4"/>', '<Dimension start="4" valueReference="0"/>', "either a length or a reference"),
    (r'(name="der_z"[^>]*>\s*<Dimension start=")4', r"\g<1>3", "no continuous variable of its size"),
    (r'(name="trust_ratio")', r'\1 reinit="true"', "for states in Model Exchange"),
    (r'(name="trust_ratio")', r'\1 canHandleMultipleSetPerTimeInstant="true"', "for inputs in Model Exchange"),
    (r'<Output [^>]*/>', "", "ModelStructure/Output lists"),
    (r'<ContinuousStateDerivative [^>]*/>', "", "ModelStructure/ContinuousStateDerivative lists"),
    (r'(<InitialUnknown [^>]*/>)', r"\1\1", "ModelStructure/InitialUnknown lists"),
    (r'(<Output [^>]*dependencies=")', r"\g<1>4 ", "differ in length"),
    (r'(<Output [^>]*dependencies=")\d+', r"\g<1>999", "are no knowns"),
    (r'(<InitialUnknown [^>]*dependenciesKind=")dependent', r"\1fixed", "no kind allowed"),
]  # fmt: skip


@pytest.mark.parametrize(("pattern", "replacement", "message"), FAULTS, ids=[f"{f[2]}-{f[0][:12]}" for f in FAULTS])
def test_each_seeded_fault_is_found(text: str, pattern: str, replacement: str, message: str) -> None:
    faulty, count = re.subn(pattern, replacement, text, count=1)
    assert count == 1
    assert any(message in problem for problem in description_problems3(ElementTree.fromstring(faulty)))


def test_faults_of_the_archive_are_found(text: str) -> None:
    root = ElementTree.fromstring(text)
    twice = ElementTree.fromstring(
        '<d><BuildConfiguration><SourceFile name="a.c"/><SourceFile name="a.c"/></BuildConfiguration></d>'
    )
    for names, build, message in (
        (["sources/a.c"], None, "no buildDescription.xml"),
        (["sources/b.c"], twice, "'a.c' is missing"),
        (["sources/a.c"], twice, "listed twice"),
        (["binaries\\x86_64-linux\\x.so"], None, "backslash"),
        (["binaries/linux64/random_panel.so"], None, "no platform"),
        (["binaries/x86_64-linux/other.so"], None, "not named after"),
        ([], None, "neither a binary nor"),
    ):
        assert any(message in problem for problem in archive_problems3(root, names, build))


def test_damaged_descriptions_are_judged_to_the_end(text: str) -> None:
    rng, root = np.random.default_rng(2), ElementTree.fromstring(text)
    for _ in range(300):
        found = description_problems3(damaged(root, rng))
        assert all(isinstance(problem, str) and problem for problem in found)
