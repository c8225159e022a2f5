"""The rule checks find nothing in exported units, and every seeded fault in a damaged one."""

from __future__ import annotations

import re
import zipfile
from pathlib import Path
from xml.etree import ElementTree

import numpy as np
import pytest

from romgen.errors import InputError
from romgen.fmu.export import export_fmu
from romgen.fmu.records import FmuExport
from romgen.fmu.rules import STRUCTURED, archive_problems, description_problems, rule_problems
from romgen.reduced_model import ReducedModel
from romgen.settings import FmuSettings
from tests.romgen.fmu.damage import damaged


@pytest.fixture(scope="module")
def text(native: FmuExport) -> str:
    """The model description as it is exported."""
    with zipfile.ZipFile(native.path) as archive:
        return archive.read("modelDescription.xml").decode()


@pytest.mark.parametrize(
    "kwargs", [{}, {"absolute": True}, {"start": "sensors"}, {"absolute": True, "start": "sensors"}]
)
def test_exported_units_keep_every_rule(kwargs: dict, model: ReducedModel, tmp_path: Path) -> None:
    export = export_fmu(model, tmp_path / "x.fmu", FmuSettings(platforms=(), **kwargs))
    assert rule_problems(export.path) == ()


def test_the_pythonfmu_unit_keeps_every_rule(pythonfmu_unit: FmuExport) -> None:
    assert rule_problems(pythonfmu_unit.path) == ()


FAULTS = [
    (r'fmiVersion="2.0"', 'fmiVersion="2.1"', "fmiVersion"),
    (r'guid="[^"]*"', 'guid=""', "GUID"),
    (r'(<CoSimulation\s+modelIdentifier=")', r"\g<1>1-", "no C name"),
    (r'(generationDateAndTime="[^"]*)Z"', r'\1"', "generationDateAndTime"),
    (r'name="logAll"', 'name="logStatusError"', "log category"),
    (r'stopTime="[^"]*"', 'stopTime="-1"', "stop time"),
    (r'stopTime="[^"]*"', 'stopTime="0"', "stop time is not after"),
    (r'stepSize="[^"]*"', 'stepSize="1e3"', "not shorter than the experiment"),
    (r'</LogCategories>', "</LogCategories><VendorAnnotations>" + 2 * '<Tool name="a"/>' + "</VendorAnnotations>",
     "two annotations"),
    (r'(<File name="rom_log.c"/>)', r"\1\1", "source file 'rom_log.c' is listed twice"),
    (r'(NamingConvention=)"flat"([\s\S]*)name="z1_im"', r'\1"structured"\2name="z1..im"', "not structured"),
    (r'(<SimpleType name="Time">\s*<Real)', r'\1 min="2" max="1"', "'Time': min is above max"),
    (r'(<SimpleType name="Displacement">\s*<Real)', r'\1 min="0"', None),
    (r'(<SimpleType name="Acceleration">\s*<Real)([\s\S]*name="base_acceleration"[^>]*>\s*<Real) ',
     r'\1 max="1"\2 max="2" ', "exceeds the range of the type"),
    (r'</TypeDefinitions>', '<SimpleType name="E"><Enumeration><Item name="a" value="1"/><Item name="b" value="1"/>'
     "</Enumeration></SimpleType></TypeDefinitions>", "same name or value"),
    (r'</TypeDefinitions>', '<SimpleType name="I"><Integer max="3000000000"/></SimpleType></TypeDefinitions>',
     "outside the 32-bit integers"),
    (r'(name="trust_ratio" )', r'\1canHandleMultipleSetPerTimeInstant="true" ', "for inputs in Model Exchange"),
    (r'(name="trust_ratio"[^>]*>\s*<Real )', r'\1reinit="true" ', "for states in Model Exchange"),
    (r'(name="natural_frequency_2" valueReference=")\d+("[\s\S]*name="damping_ratio_1" valueReference=")\d+',
     r'\g<1>900\g<2>900', "constants with different values"),
    (r'(name="damping_ratio_1" valueReference=")\d+', r'\g<1>0', "some are constant and some are not"),
    (r'(name="z1_im" valueReference=")1"', r'\g<1>0"', "more than one has a start value"),
    (r'(name="z1_im" valueReference=")1"([^>]*causality=")local("[^>]*) initial="exact"', r'\g<1>0"\2independent\3',
     "one is independent"),
    (r'stepSize="[^"]*"', 'stepSize="0"', "must be positive"),
    (r'<Unit name="m/s">', '<Unit name="m">', "declared twice"),
    (r'<DisplayUnit name="um"', '<DisplayUnit name="mm"', "occurs twice"),
    (r'<SimpleType name="Velocity">', '<SimpleType name="Displacement">', "type 'Displacement' is declared twice"),
    (r'<SimpleType name="Time">', '<SimpleType name="trust_ratio">', "name of a variable"),
    (r'declaredType="Time"', 'declaredType="Clock"', "no type 'Clock'"),
    (r'unit="Hz" start', 'unit="kHz" start', "is not declared"),
    (r'displayUnit="deg"/>\s*</Sc|displayUnit="deg" nominal', 'displayUnit="grad" nominal', "display unit 'grad'"),
    (r'name="z1_im"', 'name="z1_re"', "'z1_re' occurs twice"),
    (r'name="z1_im"', 'name=""', "is empty"),
    (r'(name="trust_radius"[^>]*variability=")tunable', r"\1continuous", "no legal combination"),
    (r'(name="inside_trust_region"[^>]*variability=")discrete', r"\1continuous", "only Real"),
    (r'(name="z1_re"[^>]*>\s*<Real [^>]*) start="0"', r"\1", "start value is missing"),
    (r'(name="trust_ratio"[^>]*>\s*<Real [^>]*) nominal', r'\1 start="0" nominal', "given for what is calculated"),
    (r'(name="trust_ratio"[^>]*>\s*<Real [^>]*)nominal="[^"]*"', r'\1nominal="0"', "nominal"),
    (r'(name="base_acceleration"[^>]*>\s*<Real [^>]*)start="0"', r'\1min="1" start="0"', "outside min and max"),
    (r'(name="base_acceleration"[^>]*>\s*<Real [^>]*)start="0"', r'\1min="1" max="-1" start="0"', "min is above max"),
    (r'(name="z1_im" valueReference=")1"', r'\g<1>0"', "more than one can be set"),
    (r'(name="hard_limit" valueReference=")\d+"', r'\g<1>0"', "more than one can be set"),
    (r'derivative="2"', 'derivative="1"', "two derivatives"),
    (r'derivative="2"', 'derivative="999"', "points to no other variable"),
    (r'<Outputs>\s*<Unknown[^>]*/>', "<Outputs>", "ModelStructure/Outputs lists"),
    (r'<Derivatives>\s*<Unknown[^>]*/>', "<Derivatives>", "ModelStructure/Derivatives lists"),
    (r'<InitialUnknowns>\s*<Unknown[^>]*/>', "<InitialUnknowns>", "ModelStructure/InitialUnknowns lists"),
    (r'(<InitialUnknowns>\s*)(<Unknown[^>]*/>)(\s*)(<Unknown[^>]*/>)', r"\1\4\3\2", "not in ascending order"),
    (r'(<Derivatives>\s*<Unknown[^>]*dependencies=")(\d+) (\d+)', r"\1\3 \2", "dependencies are not in ascending"),
    (r'(<Derivatives>\s*<Unknown[^>]*dependencies=")(\d+)', r"\g<1>5", "are no knowns"),
    (r'(<Derivatives>\s*<Unknown[^>]*dependenciesKind="dependent) dependent', r"\1", "differ in length"),
    (r'(<InitialUnknowns>\s*<Unknown[^>]*dependenciesKind=")dependent', r"\1tunable", "no kind allowed"),
]  # fmt: skip


@pytest.mark.parametrize(("pattern", "replacement", "message"), FAULTS, ids=[f"{f[2]}-{f[0][:12]}" for f in FAULTS])
def test_each_seeded_fault_is_found(text: str, pattern: str, replacement: str, message: str | None) -> None:
    faulty, count = re.subn(pattern, replacement, text, count=1)
    assert count == 1
    found = description_problems(ElementTree.fromstring(faulty))
    assert any(message in problem for problem in found) if message else found == ()


def test_structured_names_follow_their_grammar() -> None:
    """Examples of section 2.2.9, and names that break it."""
    for name in ("vehicle.transmission.ratio", "a.b[1,2].c", "der(engine.'phi 1',2)", "'x\\'y'[3]", "_x1"):
        assert STRUCTURED.fullmatch(name)
    for name in ("1x", "a..b", "a[1", "der(a", "a b", "der(a,x)", "a.'b", ""):
        assert not STRUCTURED.fullmatch(name)


def test_faults_of_the_archive_are_found(text: str) -> None:
    root = ElementTree.fromstring(text)
    sources = sorted({f"sources/{file.get('name')}" for file in root.iter("File")})
    assert archive_problems(root, sources) == ()
    for names, message in (
        (sources[1:], "is missing"),
        ([*sources, "binaries\\win64\\x.dll"], "backslash"),
        ([*sources, "binaries/win65/random_panel.dll"], "no platform"),
        ([*sources, "binaries/win64/other.dll"], "not named after"),
        ([], "neither a binary nor"),
    ):
        assert any(message in problem for problem in archive_problems(root, names))


def test_damaged_descriptions_are_judged_to_the_end(text: str) -> None:
    """Whatever is missing or unreadable in a unit of others becomes a sentence, nothing stops the rules."""
    rng, root = np.random.default_rng(1), ElementTree.fromstring(text)
    for _ in range(300):
        found = description_problems(damaged(root, rng))
        assert all(isinstance(problem, str) and problem for problem in found)
    broken = re.sub(r'(<SimpleType name="Displacement">\s*<Real)', r'\1 min="low"', text, count=1)
    assert any("cannot be read (could not" in p for p in description_problems(ElementTree.fromstring(broken)))


def test_a_file_that_is_no_unit_is_refused(tmp_path: Path) -> None:
    (tmp_path / "x.fmu").write_text("nothing")
    with pytest.raises(InputError, match="not an FMU"):
        rule_problems(tmp_path / "x.fmu")
