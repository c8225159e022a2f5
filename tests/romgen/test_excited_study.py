"""Point and surface loads as load inputs: settings, modal loads, forced marches, columns of the reduced model."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from scipy.integrate import solve_ivp

from fem.body import locate
from romgen import fe_stages, fe_transients
from romgen.fe_inputs import still, time_loads
from romgen.forced_motion import ForcedMotion, cosine
from romgen.settings import Study, StudyError, load_study
from romgen.structure import Modes, Preload
from tests.romgen.test_fe_stages import STUDY_TOML

EXCITED = (
    STUDY_TOML
    + """
[excitations.shaker]
point = [0.02, 0.0, 0.01]
direction = [0.0, -2.0, 0.0]
[excitations.wind]
surface = "panel.y_max"
[excitations.edge]
surface = "panel.x_min&y_max"
direction = [0.0, 1.0, 0.0]
[point_masses.accelerometer]
point = [0.0, 0.0, 0.01]
mass = "2 g"
[springs.cable]
point = [0.0, 0.0, 0.01]
stiffness = [0.0, "0.5 N/mm", 0.0]
[foundations.side]
surface = "panel.z_min"
normal = "1 MPa/mm"
"""
)


def _study(folder: Path, text: str) -> Study:
    path = folder / "study.toml"
    path.write_text(text, encoding="utf-8")
    return load_study(path)


@pytest.fixture(scope="module")
def excited(tmp_path_factory: pytest.TempPathFactory) -> tuple[Study, Preload, Modes]:
    """The tiny study with a shaker, a pressure and a line force."""
    study = _study(tmp_path_factory.mktemp("excited"), EXCITED)
    preload = fe_stages.solve_preload(study, lambda _fraction, _text: None)
    return study, preload, fe_stages.solve_modes(study, preload)


def test_every_excitation_is_a_column_of_the_modal_load(excited: tuple[Study, Preload, Modes]) -> None:
    """Phi' p: minus the shape at the point; the mean of the shape times the area; the mean along the edge."""
    study, _, modes = excited
    assert modes.inputs == ("base_acceleration", "shaker", "wind", "edge")
    assert modes.input_units == ("m/s2", "N", "Pa", "N")
    model = fe_stages.build(study)
    sensor = fe_stages.sensor_rows(model, [fe_stages.Sensor("at", (0.02, 0.0, 0.01), "y")])[0]
    np.testing.assert_allclose(modes.modal_load[:, 1], -sensor @ modes.shapes, rtol=1e-12)
    loads = time_loads(study, model, dict.fromkeys(("wind", "edge"), still))
    along = model.direction("y")
    assert loads[0].pattern @ along == pytest.approx(-0.1 * 0.02)
    assert loads[1].pattern @ along == pytest.approx(1.0)
    index, name = locate(model.bodies, "panel.x_min&y_max")
    nodes = model.bodies[index].mesh.nodes(name) + model.offsets[index]
    assert set(np.flatnonzero(loads[1].pattern) // 3) == set(nodes)


def test_point_mass_spring_and_foundation_reach_the_model(excited: tuple[Study, Preload, Modes]) -> None:
    study, _, modes = excited
    model = fe_stages.build(study)
    bare = fe_stages.build(study.model_copy(update={"springs": {}, "foundations": {}, "point_masses": {}}))
    along = model.direction("y")
    assert along @ ((model.mass - bare.mass) @ along) == pytest.approx(2e-3)
    assert along @ ((model.stiffness - bare.stiffness) @ along) == pytest.approx(500.0)
    across = model.direction("z")
    assert across @ ((model.stiffness - bare.stiffness) @ across) == pytest.approx(1e9 * 2e-3 * 0.1)
    assert modes.total_mass == pytest.approx(float(along @ (model.mass @ along)))


def test_shaker_drives_the_finite_element_model_on_its_linear_orbit(excited: tuple[Study, Preload, Modes]) -> None:
    """Small motions: eta_1 = Re(X exp(i W t)), X = L F/(omega^2 - W^2 + 2i zeta omega W), as for a moving base; 1 %."""
    study, preload, modes = excited
    omega, zeta, load = 2.0 * np.pi * modes.frequency_hz[0], modes.damping_ratio[0], modes.modal_load[0, 1]
    drive = omega * np.array([0.3, 1.2])
    level = 1e-8 * omega**2 / abs(load) * np.ones(2)
    X = load * level / (omega**2 - drive**2 + 2j * zeta * omega * drive)
    shape = modes.shapes[:, 0]
    start = np.outer(shape, X.real), np.outer(shape, (1j * drive * X).real)
    # The force excites the other modes too, a base nearly the first alone; they stay small below resonance.
    motion = ForcedMotion(*start, {"shaker": cosine(level, drive)}, 40)
    segments = list(fe_transients.march_forced(study, preload, modes, motion, None))
    t, _ = fe_transients.join_sensors(segments, study)
    eta = np.concatenate([s.eta for s in segments])[:, 0, :]
    np.testing.assert_allclose(eta, (X * np.exp(1j * np.outer(t, drive))).real, atol=1e-2 * np.abs(X).max())


def test_explicit_scheme_takes_the_same_loads(excited: tuple[Study, Preload, Modes]) -> None:
    """A pulse on the resting strip: its first mode by central differences against its equation; 2 % (lumped mass)."""
    study, preload, modes = excited
    table = study.ringdowns
    assert table is not None
    explicit = study.model_copy(update={"ringdowns": table.model_copy(update={"scheme": "central_difference"})})
    still_field = np.zeros((len(modes.shapes), 1))
    motion = ForcedMotion(still_field, still_field, {"shaker": lambda t: np.array([np.sin(2e3 * t)])}, 3)
    segments = list(fe_transients.march_forced(explicit, preload, modes, motion, None))
    omega, zeta, load = 2.0 * np.pi * modes.frequency_hz[0], modes.damping_ratio[0], modes.modal_load[0, 1]

    def rate(t: float, y: np.ndarray) -> list[float]:
        return [y[1], load * np.sin(2e3 * t) - 2.0 * zeta * omega * y[1] - omega**2 * y[0]]

    eta = np.concatenate([s.eta[:, 0, 0] for s in segments])
    exact = solve_ivp(rate, (0.0, 1.6e-4), [0.0, 0.0], t_eval=5e-5 * np.arange(4), rtol=1e-9, atol=1e-20).y[0]
    assert np.abs(eta - exact).max() < 0.02 * np.abs(exact).max()


@pytest.mark.parametrize(
    ("old", "new", "problem"),
    [
        (
            "point = [0.02, 0.0, 0.01]\ndirection",
            "point = [9.0, 0.0, 0.01]\ndirection",
            "shaker.* point lies in no block",
        ),
        ("direction = [0.0, -2.0, 0.0]\n", "", "shaker.* a force at a point needs a direction"),
        ("direction = [0.0, -2.0, 0.0]", "direction = [0.0, 0.0, 0.0]", "shaker.* direction is zero"),
        ('surface = "panel.y_max"\n[exc', 'surface = "panel.top"\n[exc', "wind.* unknown surface 'panel.top'"),
        ('surface = "panel.y_max"\n[exc', "[exc", "wind.* needs either surface or point"),
        ("[excitations.wind]", "[excitations.mid]", "mid.* the name is taken"),
        ("[excitations.wind]", '[excitations."a-b"]', "letters, digits and underscores"),
        ('surface = "panel.z_min"', 'surface = "panel.bottom"', "foundations.side.* unknown surface"),
    ],
)
def test_wrong_excitations_are_named(tmp_path: Path, old: str, new: str, problem: str) -> None:
    assert old in EXCITED
    with pytest.raises(StudyError, match=problem):
        _study(tmp_path, EXCITED.replace(old, new))
