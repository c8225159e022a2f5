"""A study whose clamp is a solid bolt: tightened, recorded, locked in every later stage."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from romgen import fe_stages, fe_transients
from romgen.settings import Study, StudyError, load_study
from romgen.structure import Preload
from tests.romgen.test_fe_stages import STUDY_TOML

_CLAMP = """[[loads]]
name = "bolts"
surface = "blade.y_max"
total_force = 4e3
"""
_BLOCK = """[blocks.{name}]
material = "steel"
kinematics = "linear"
x = [0.08, 0.1]
cells_x = [{cells}]
y = [{low}, {high}]
cells_y = [{layers}]
z = [-0.01, 0.01]
cells_z = [{cells}]
"""
# The shank passes through the clamped parts without touching them: only named surfaces meet.
_BOLT = (
    _BLOCK.format(name="nut", low=-15e-3, high=-11e-3, cells=2, layers=1)
    + _BLOCK.format(name="shank", low=-11e-3, high=11e-3, cells=1, layers=4)
    + _BLOCK.format(name="head", low=11e-3, high=15e-3, cells=2, layers=1)
    + """[ties.thread]
slave = "shank.y_min"
master = "nut.y_max"
[ties.neck]
slave = "shank.y_max"
master = "head.y_min"
[contacts.foot]
slave = "support.y_min"
master = "nut.y_max"
friction = 0.3
[contacts.under_head]
slave = "blade.y_max"
master = "head.y_min"
friction = 0.3
[bolts.m6]
body = "shank"
force = "4 kN"
"""
)


def _study(folder: Path, text: str) -> Study:
    path = folder / "study.toml"
    path.write_text(text, encoding="utf-8")
    return load_study(path)


def _no_report(_fraction: float, _text: str) -> None:
    """Progress that nobody watches."""


BOLTED = STUDY_TOML.replace(_CLAMP, _BOLT).replace('"support.y_min"\ndirections', '"nut.y_min"\ndirections')


@pytest.fixture(scope="module")
def bolted(tmp_path_factory: pytest.TempPathFactory) -> tuple[Study, Preload]:
    """The tiny study held together by a bolt, and its preload."""
    study = _study(tmp_path_factory.mktemp("bolted"), BOLTED)
    return study, fe_stages.solve_preload(study, _no_report)


def test_bolt_presses_all_interfaces_with_its_force(bolted: tuple[Study, Preload]) -> None:
    _, preload = bolted
    assert {i.name for i in preload.interfaces} == {"lower", "upper", "foot", "under_head"}
    for interface in preload.interfaces:
        assert interface.normal_force_n == pytest.approx(4e3, rel=1e-6)
    assert preload.bolt_shortening.shape == (1,)
    # At least the stretch of the shank alone, F L / (E A).
    assert preload.bolt_shortening[0] > 4e3 * 22e-3 / (200e9 * 0.02**2)


def test_later_stages_find_the_bolt_locked(bolted: tuple[Study, Preload]) -> None:
    """The rebuilt, locked model balances the recorded displacement without any other load."""
    study, preload = bolted
    model = fe_stages.preloaded(study, preload)
    assert model.bolts.forces(preload.displacement)[0] == pytest.approx(4e3, rel=1e-6)
    state = fe_stages.equilibrium(model, preload)
    force = model.elastic_force(state.u[:, None])[0] + model.contact.force(state.contact.traction)
    residual = (model.load - force[:, 0])[model.free]
    assert np.linalg.norm(residual) < 1e-6 * 4e3
    unlocked = fe_stages.build(study)
    assert np.linalg.norm((unlocked.load - force[:, 0])[model.free]) > 1e3


def test_bolted_study_rings_down(bolted: tuple[Study, Preload]) -> None:
    """First segment: what was stored at the start is kinetic, strain, contact energy or was dissipated; 1 % of it."""
    study, preload = bolted
    modes = fe_stages.solve_modes(study, preload)
    assert np.all(np.diff(modes.frequency_hz) > 0.0)
    first = next(iter(fe_transients.march_ringdowns(study, preload, modes, None)))
    held = first.energies[:, :3].sum(axis=1)
    lost = first.energies[:, 3] + first.energies[:, 4] - first.energies[:, 5]
    assert np.all(held[0] > 0.0)
    np.testing.assert_allclose(held + lost, np.broadcast_to(held[0], held.shape), atol=0.01 * held[0].min())


@pytest.mark.parametrize(
    ("wrong", "message"),
    [
        (BOLTED.replace('body = "shank"', 'body = "shaft"'), r"\[bolts.m6\] body: unknown body 'shaft'"),
        (BOLTED.replace('slave = "shank.y_min"', 'slave = "shank.y_mid"'), r"\[ties.thread\] slave: unknown surface"),
        (BOLTED.replace('force = "4 kN"', 'force = "-4 kN"'), r"bolts"),
    ],
)
def test_wrong_joints_are_found_before_anything_is_computed(tmp_path: Path, wrong: str, message: str) -> None:
    with pytest.raises(StudyError, match=message):
        _study(tmp_path, wrong)
