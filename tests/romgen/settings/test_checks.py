"""Unit-system warnings: legal numbers that look like another unit system."""

from __future__ import annotations

from typing import Any

import pytest

from romgen.fmu.compilers import TARGETS
from romgen.settings import Study, study_warnings, surfaces
from romgen.settings.checks import PLATFORMS

STEEL = {
    "SI": (2.1e11, 7850.0, 0),
    "mm-t-s": (2.1e5, 7.85e-9, 2),
    "mm-kg-ms": (210.0, 7.85e-6, 2),
    "density in g/cm^3": (2.1e11, 7.85, 1),
    "modulus in MPa": (2.1e5, 7850.0, 1),
}


@pytest.mark.parametrize("system", STEEL)
def test_steel_in_other_systems_is_noticed(tables: dict[str, Any], system: str) -> None:
    young_modulus, density, count = STEEL[system]
    tables["materials"]["steel"] |= {"young_modulus": young_modulus, "density": density}
    warnings = study_warnings(Study.model_validate(tables))
    assert len(warnings) == count
    assert all("[materials.steel]" in line and "\n" not in line for line in warnings)


def test_a_sensor_where_blocks_touch_is_warned_about(tables: dict[str, Any]) -> None:
    tables["sensors"]["tip"]["point"] = [1.0, 0.0, 0.1]
    assert study_warnings(Study.model_validate(tables)) == (
        "[sensors.tip] lies on bar and base and measures bar; add body if another is meant",
    )
    tables["sensors"]["tip"]["body"] = "base"
    assert study_warnings(Study.model_validate(tables)) == ()


def test_unit_strings_give_si_numbers(tables: dict[str, Any]) -> None:
    tables["materials"]["steel"] |= {"young_modulus": "210 GPa", "density": "7.85e-9 t/mm^3"}
    steel = Study.model_validate(tables).materials["steel"]
    assert steel.young_modulus == pytest.approx(2.1e11, rel=1e-15)
    assert steel.density == pytest.approx(7850.0, rel=1e-15)


def test_faces_of_all_blocks(tables: dict[str, Any]) -> None:
    assert len(surfaces(Study.model_validate(tables))) == 12


def test_platforms_are_those_of_the_compiler() -> None:
    assert set(PLATFORMS) == {"host", "all", *TARGETS}
