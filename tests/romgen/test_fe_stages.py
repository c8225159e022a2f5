"""From a study to the finite-element half and back, on a very coarse panel."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from romgen import fe_stages, fe_transients
from romgen.errors import InputError, NumericalError
from romgen.forced_motion import ForcedMotion, cosine
from romgen.settings import Study, load_study
from romgen.store import read_file, write_file
from romgen.structure import Modes, Preload
from tests.records import same

STUDY_TOML = """
[study]
name = "tiny"
[materials.steel]
young_modulus = 200e9
poisson_ratio = 0.3
density = 7800.0
[blocks.panel]
material = "steel"
x = [0.0, 0.08, 0.1]
cells_x = [3, 1]
y = [-1e-3, 1e-3]
cells_y = [1]
z = [-0.01, 0.01]
cells_z = [1]
arch = { rise = 0.5e-3, span = 0.16 }
[blocks.support]
material = "steel"
kinematics = "linear"
x = [0.08, 0.1]
cells_x = [1]
y = [-11e-3, -1e-3]
cells_y = [1]
z = [-0.01, 0.01]
cells_z = [1]
[blocks.blade]
material = "steel"
kinematics = "linear"
x = [0.08, 0.1]
cells_x = [1]
y = [1e-3, 11e-3]
cells_y = [1]
z = [-0.01, 0.01]
cells_z = [1]
[contacts.lower]
slave = "panel.y_min"
master = "support.y_max"
friction = 0.3
[contacts.upper]
slave = "panel.y_max"
master = "blade.y_min"
friction = 0.3
[[constraints]]
surface = "panel.x_min"
directions = ["x"]
[[constraints]]
surface = "support.y_min"
directions = ["x", "y", "z"]
[[loads]]
name = "bolts"
surface = "blade.y_max"
total_force = 4e3
[preload]
steps = 2
[modes]
count = 3
[sensors.mid]
point = [0.0, 0.0005, 0.0]
direction = "y"
[base_acceleration]
direction = "y"
[ringdowns]
time_step = 5e-5
duration = 1e-3
segment_steps = 8
snapshot_stride = 5
start = "static"
[[ringdowns.training]]
name = "strong"
amplitudes = [2e-4, 0.0]
[[ringdowns.validation]]
name = "weak"
amplitudes = [5e-5, 2e-6]
[learn]
master_modes = [1, 2]
internal_resonance = [1, 2]
order = 3
"""


def _silent(_fraction: float, _text: str) -> None:
    """Progress that nobody watches."""


@pytest.fixture(scope="module")
def solved(tmp_path_factory: pytest.TempPathFactory) -> tuple[Study, Preload, Modes]:
    """The tiny study with its preload and modes."""
    path = tmp_path_factory.mktemp("tiny") / "study.toml"
    path.write_text(STUDY_TOML, encoding="utf-8")
    study = load_study(path)
    preload = fe_stages.solve_preload(study, _silent)
    return study, preload, fe_stages.solve_modes(study, preload)


def test_structure_has_all_bodies_and_a_closed_skin(solved: tuple[Study, Preload, Modes]) -> None:
    study = solved[0]
    structure = fe_stages.structure(study)
    assert structure.bodies == ("panel", "support", "blade")
    np.testing.assert_array_equal(np.bincount(structure.cell_body), [4, 1, 1])
    assert structure.points[:, 1].max() == pytest.approx(11e-3)
    # Every edge of a closed triangulated surface belongs to two triangles, once in each direction.
    edges = np.vstack([structure.skin[:, [i, (i + 1) % 3]] for i in range(3)])
    forward = {tuple(e) for e in edges.tolist()}
    assert len(forward) == len(edges)
    assert forward == {(b, a) for a, b in forward}


def test_preload_record_describes_the_interfaces(solved: tuple[Study, Preload, Modes]) -> None:
    _, preload, _ = solved
    assert [i.name for i in preload.interfaces] == ["lower", "upper"]
    for interface in preload.interfaces:
        assert interface.applied_force_n == pytest.approx(4e3, rel=1e-9)
        assert interface.normal_force_n == pytest.approx(4e3, rel=1e-6)
        assert interface.normal_force_n == pytest.approx(interface.pressure @ interface.area, rel=1e-12)
    np.testing.assert_allclose(preload.load_factors, [0.5, 1.0])


def test_equilibrium_is_rebuilt_from_its_record(solved: tuple[Study, Preload, Modes]) -> None:
    """The record keeps tractions; the anchors that follow from them must give the same tractions again."""
    study, preload, _ = solved
    model = fe_stages.build(study)
    state = fe_stages.equilibrium(model, preload)
    again = model.contact.evaluate(model.contact.relative(preload.displacement[:, None]), state.contact.slip)
    scale = np.abs(state.contact.traction).max()
    np.testing.assert_allclose(again.traction, state.contact.traction, atol=1e-9 * scale)
    force = model.elastic_force(preload.displacement[:, None])[0] + model.contact.force(again.traction)
    assert np.linalg.norm((model.load - force[:, 0])[model.free]) < 1e-7 * np.linalg.norm(model.load)


def test_modes_record_is_complete(solved: tuple[Study, Preload, Modes]) -> None:
    study, _, modes = solved
    assert modes.damping_ratio[:2] == pytest.approx([0.004, 0.004], rel=1e-9)
    np.testing.assert_allclose(modes.left.T @ modes.shapes, np.eye(3), atol=1e-9)
    # Participation of all modes in y is at most the total mass: sum of (phi' M b)^2 <= b' M b.
    volume = 2e-3 * 0.02 * 0.1 + 2 * 0.02 * 0.02 * 0.01
    assert 0.0 < float((modes.modal_load**2).sum()) < 7800.0 * volume
    assert modes.inputs == ("base_acceleration",)
    assert modes.sensor_matrix.shape == (1, modes.shapes.shape[0])
    model = fe_stages.build(study)
    assert modes.sensor_matrix[0] @ model.direction("y") == pytest.approx(1.0, abs=1e-12)


def test_ringdowns_restart_and_join(solved: tuple[Study, Preload, Modes]) -> None:
    study, preload, modes = solved
    segments = list(fe_transients.march_ringdowns(study, preload, modes, None))
    resumed = list(fe_transients.march_ringdowns(study, preload, modes, segments[0]))
    assert len(segments) == 3
    for again, first in zip(resumed, segments[1:], strict=True):
        assert same(again, first)
    strong, weak = fe_transients.join_ringdowns(segments, study, modes)
    assert (strong.trajectory.name, weak.trajectory.name) == ("strong", "weak")
    t = strong.trajectory.t
    np.testing.assert_allclose(t, 5e-5 * np.arange(21), rtol=1e-12)
    assert strong.trajectory.eta is not None
    assert strong.trajectory.snapshots is not None
    assert strong.trajectory.snapshot_index is not None
    np.testing.assert_array_equal(strong.trajectory.snapshot_index, [0, 5, 10, 15, 20])
    kept = strong.trajectory.snapshots.astype(float) @ modes.left[:, :2]
    scale = np.abs(strong.trajectory.eta).max()
    # Snapshots are single precision.
    np.testing.assert_allclose(kept, strong.trajectory.eta[::5], atol=1e-6 * scale)
    peak = np.linalg.norm(modes.shapes[:, 0].reshape(-1, 3), axis=1).max()
    assert strong.trajectory.eta[0] == pytest.approx([2e-4 / peak, 0.0], abs=1e-6 * scale)
    for ring in (strong, weak):
        energy = ring.energy
        released = (energy.kinetic + energy.strain + energy.contact)[0]
        assert energy.imbalance[0] == 0.0
        # The arched strip at 0.5 kHz and 5e-5 s: omega h = 0.16, its square over 12 is 0.2 %.
        assert np.abs(energy.imbalance).max() < 0.005 * released
        assert np.all(np.diff(energy.friction) >= -1e-15)
        assert np.all(np.diff(energy.damping) >= 0.0)


@pytest.mark.parametrize(
    "options",
    [
        {"start": "modal", "refactor_above": 2, "tolerance": 1e-7},
        {"error_tolerance": 2e-4, "max_doublings": 1},
        {"method": "newton"},
        {"scheme": "central_difference"},
    ],
    ids=["refactored", "adaptive", "newton", "explicit"],
)
def test_other_ways_to_march_resume_from_their_files(
    solved: tuple[Study, Preload, Modes], options: dict[str, object], tmp_path: Path
) -> None:
    """Every way through the segment files to the same bits, and to the motion of the default one.

    1 % of the peak: measured 0.2 % with the lumped mass of central differences, 0.02 % and less otherwise.
    """
    study, preload, modes = solved
    assert study.ringdowns is not None
    table = study.ringdowns.model_copy(update={"duration": 4e-4, "segment_steps": 5, "start": "static"} | options)
    changed = study.model_copy(update={"ringdowns": table})
    segments = list(fe_transients.march_ringdowns(changed, preload, modes, None))
    write_file(tmp_path / "segment.h5", segments[0])
    stored = read_file(tmp_path / "segment.h5", fe_transients.Segment)
    for again, first in zip(fe_transients.march_ringdowns(changed, preload, modes, stored), segments[1:], strict=True):
        assert same(again, first)
    found = fe_transients.join_ringdowns(segments, changed, modes)[0]
    assert found.effort.steps.sum() > 0
    if "refactor_above" in options:
        assert found.effort.factors.sum() > 0
        return
    plain = study.model_copy(update={"ringdowns": study.ringdowns.model_copy(update={"duration": 4e-4})})
    expected = fe_transients.join_ringdowns(
        list(fe_transients.march_ringdowns(plain, preload, modes, None)), plain, modes
    )[0]
    assert expected.trajectory.eta is not None
    assert found.trajectory.eta is not None
    peak = np.abs(expected.trajectory.eta[:, 0]).max()
    np.testing.assert_allclose(found.trajectory.eta[:, 0], expected.trajectory.eta[:, 0], atol=0.01 * peak)


def test_failures_come_as_those_of_romgen(solved: tuple[Study, Preload, Modes]) -> None:
    study = solved[0]
    loose = study.model_copy(update={"constraints": study.constraints[:1]})
    with pytest.raises(InputError, match="nothing holds") as caught:
        fe_stages.solve_preload(loose, _silent)
    assert caught.value.exit_code == 2
    hasty = study.model_copy(update={"preload": study.preload.model_copy(update={"max_iterations": 1})})
    with pytest.raises(NumericalError, match="no static equilibrium") as stopped:
        fe_stages.solve_preload(hasty, _silent)
    assert len(stopped.value.history) >= 1
    assert stopped.value.exit_code == 3


def test_unreachable_damping_is_refused(solved: tuple[Study, Preload, Modes]) -> None:
    study, preload, _ = solved
    table = study.modes.model_copy(update={"damping_ratio": (0.0001, 0.5)})
    with pytest.raises(InputError, match="Rayleigh"):
        fe_stages.solve_modes(study.model_copy(update={"modes": table}), preload)


def test_record_of_other_interfaces_is_another_state(solved: tuple[Study, Preload, Modes]) -> None:
    """A preload whose tractions were changed no longer balances: the rebuilt state follows the record."""
    study, preload, _ = solved
    first = replace(preload.interfaces[0], traction=preload.interfaces[0].traction + 1e5)
    changed = replace(preload, interfaces=(first, *preload.interfaces[1:]))
    model = fe_stages.build(study)
    ours, other = fe_stages.equilibrium(model, preload), fe_stages.equilibrium(model, changed)
    n = len(first.area)
    k = model.contact.law[:n, 1:2]
    np.testing.assert_allclose((ours.contact.slip - other.contact.slip)[:n, :, 0] * k, 1e5, rtol=1e-6)


def test_study_file_is_read(tmp_path: Path) -> None:
    path = tmp_path / "study.toml"
    path.write_text(STUDY_TOML.replace("cells_x = [3, 1]", "cells_x = [3]"), encoding="utf-8")
    with pytest.raises(InputError, match="cells_x"):
        load_study(path)


def test_forced_march_follows_the_linear_steady_state(solved: tuple[Study, Preload, Modes]) -> None:
    """Small motions about the preload follow eta_1 = Re(X exp(i W t)), X = L a/(omega^2 - W^2 + 2i zeta omega W).

    Both cases start on that orbit in mode 1; the step errs by (W h)^2/12 of the forcing and more near resonance,
    and C couples the modes through the stuck joints: 1 % of the larger orbit, measured 0.6 %.
    """
    study, preload, modes = solved
    omega, zeta, load = 2.0 * np.pi * modes.frequency_hz[0], modes.damping_ratio[0], modes.modal_load[0, 0]
    drive = omega * np.array([0.3, 1.2])
    level = 1e-6 * omega**2 / abs(load) * np.ones(2) * 1e-2
    X = load * level / (omega**2 - drive**2 + 2j * zeta * omega * drive)
    start = np.outer(modes.shapes[:, 0], X.real), np.outer(modes.shapes[:, 0], (1j * drive * X).real)
    motion = ForcedMotion(*start, {"base_acceleration": cosine(level, drive)}, 40)
    segments = list(fe_transients.march_forced(study, preload, modes, motion, None))
    t, sensors = fe_transients.join_sensors(segments, study)
    eta = np.concatenate([s.eta for s in segments])[:, 0, :]
    expected = (X * np.exp(1j * np.outer(t, drive))).real
    np.testing.assert_allclose(eta, expected, atol=1e-2 * np.abs(X).max())
    assert sensors.shape == (41, 1, 2)
    resumed = list(fe_transients.march_forced(study, preload, modes, motion, segments[0]))
    assert same(resumed[-1], segments[-1])
