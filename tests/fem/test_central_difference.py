"""Explicit marching: critical step, agreement with the implicit scheme, ledger, restarts, refusals."""

from __future__ import annotations

import numpy as np
import pytest

from fem.block import graded, hex_block
from fem.body import Body
from fem.campaign import Observation, march_campaign, moving_starts
from fem.central_difference import ExplicitSettings, ExplicitTransient
from fem.critical_step import critical_step
from fem.errors import FemConvergenceError, FemInputError
from fem.material import Material
from fem.model import Model, Pair, build_model
from fem.modes import Rayleigh, no_modes, rest_state
from fem.supports import Support
from fem.transient import Transient, TransientSettings
from tests.fem.small_models import box, single
from tests.records import same

SOFT = Material(2e6, 0.0, 1000.0)
DAMPING = Rayleigh(3.0, 2e-5)


def _stack() -> Model:
    """Two soft blocks under a common roof of friction: the upper one may slide and lift off."""
    side = graded([0.0, 1.0], [1])
    lower = hex_block(side, graded([0.0, 1.0], [1]), side)
    upper = hex_block(side, graded([1.0, 1.5], [1]), side)
    bodies = [Body("lower", lower, SOFT), Body("upper", upper, SOFT)]
    pairs = [Pair("joint", "upper.y_min", "lower.y_max", 0.3)]
    return build_model(bodies, pairs=pairs, supports=[Support("lower.y_min", ("x", "y", "z"))])


def _push(model: Model) -> np.ndarray:
    """The upper block flies down at 0.5 m/s and sideways at 0.4 m/s, (n_dof, 1)."""
    velocity = np.zeros((len(model.points), 3))
    velocity[int(model.offsets[1]) :] = (0.4, -0.5, 0.1)
    return velocity.reshape(-1, 1)


def _explicit(model: Model, time_step: float = 1e-4, **options: float) -> ExplicitTransient:
    settings = ExplicitSettings(time_step, solver="superlu", **options)  # type: ignore[arg-type]
    return ExplicitTransient(model, rest_state(model), DAMPING, settings)


def test_critical_step_is_that_of_the_stiffest_mode() -> None:
    """Against all eigenvalues of the dense pencil with closed contact; damping shortens the step as in one mode."""
    model = _stack()
    mass, free = model.lumped_mass(), model.free
    rest = rest_state(model)
    closed = model.contact.stick_tangent(np.ones(model.contact.n_point, dtype=np.int64))
    stiffness = (model.elastic_tangent(rest.u) + closed).toarray()[np.ix_(free, free)]
    root = 1.0 / np.sqrt(mass[free])
    omega = float(np.sqrt(np.linalg.eigvalsh(root[:, None] * stiffness * root).max()))
    # The Ritz value is below the largest eigenvalue by 1e-3 at most, and is raised by as much.
    found = critical_step(model, rest.u, mass, Rayleigh(0.0, 0.0))
    assert 2.0 / omega * (1.0 - 5.1e-4) < found < 2.0 / omega * (1.0 + 1e-6)
    # The limit of u'' + 2 xi w u' + w^2 u with lagged velocity: an eigenvalue of the step map at -1.
    h, beta = critical_step(model, rest.u, mass, Rayleigh(0.0, 2e-4)), 2e-4
    assert _growth(omega, beta, 0.999 * h) <= 1.0 + 1e-12
    assert _growth(omega, beta, 1.002 * h) > 1.0


def _growth(omega: float, beta: float, h: float) -> float:
    """Spectral radius of one step of the scheme for one mode, unknowns (u, v, a)."""
    half = np.array([[1.0, 0.0, 0.0], [0.0, 1.0, 0.5 * h], [0.0, 0.0, 1.0]])
    move = np.array([[1.0, h, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]])
    force = np.array([[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [-(omega**2), -beta * omega**2, 0.0]])
    return float(np.abs(np.linalg.eigvals(half @ force @ move @ half)).max())


def test_both_schemes_find_the_same_collision() -> None:
    """Blocks that collide, slide and part, with lumped mass in both: four times finer steps, half the gap."""
    model = _stack()
    rest, velocity, gaps = rest_state(model), _push(model), []
    zero = np.zeros_like(velocity)
    for parts, safety in ((5, 0.9), (20, 0.225)):
        explicit = _explicit(model, 2e-3, safety=safety)
        fast = list(explicit.march(explicit.start(zero, velocity), 60))
        settings = TransientSettings(2e-3 / parts, 1.0, tolerance=1e-8, dispersion_correction=False, solver="superlu")
        implicit = Transient(explicit.model, rest, no_modes(model, rest), DAMPING, settings, force_scale=1e4)
        slow = [r for r in implicit.march(implicit.start(zero, velocity), 60 * parts) if r.state.step % parts == 0]
        paths = [np.array([r.state.u[:, 0] for r in run]) for run in (fast, slow)]
        gaps.append(np.abs(paths[0] - paths[1]).max() / np.abs(paths[1]).max())
    assert any((r.contact.status == 2).any() for r in fast)
    assert any((r.contact.status == 0).all() for r in fast[5:]), "the blocks should part again"
    assert gaps[0] < 0.02
    assert gaps[1] < 0.5 * gaps[0]
    # The ledger: what the trapezoidal sums leave, h^2/8 a' M a, is of the order of (omega h)^2 of the largest mode.
    total = np.array([r.energies.sum() + r.state.work[:2].sum() - r.state.work[2].sum() for r in fast])
    assert np.abs(total / total[0] - 1.0).max() < 5e-3


def test_restart_repeats_the_explicit_campaign_bit_by_bit() -> None:
    model = _stack()
    observation = Observation(no_modes(model, rest_state(model)), np.eye(model.n_dof)[:2], 2)
    starts = moving_starts(rest_state(model), np.zeros((model.n_dof, 1)), _push(model))
    whole = list(march_campaign(_explicit(model), observation, 12, 5, starts=starts))
    again = list(march_campaign(_explicit(model), observation, 12, 5, restart=whole[0].state))
    assert len(again) == 2
    for first, second in zip(whole[1:], again, strict=True):
        assert same(first, second)


def test_step_above_the_critical_one_is_refused() -> None:
    model = _stack()
    critical = _explicit(model).critical
    assert _explicit(model, 1e-3, step=critical).substeps == np.ceil(1e-3 / critical)
    with pytest.raises(FemInputError, match=r"unstable for central differences.*critical step of this mesh"):
        _explicit(model, step=1.01 * critical)


def test_massless_body_is_named() -> None:
    model = single(box((1.0, 1.0, 1.0), (1, 1, 1)), SOFT)
    with pytest.raises(FemInputError, match="no mass"):
        critical_step(model, np.zeros(model.n_dof), 0.0 * model.lumped_mass(), DAMPING)


def test_march_that_blows_up_is_named() -> None:
    """Stretched to six times its height and let go: far stiffer than at rest, where the step was chosen."""
    model = single(box((1.0, 1.0, 1.0), (1, 1, 1)), SOFT, supports=(Support("body.y_min", ("x", "y", "z")),))
    explicit = _explicit(model, 1e-2, safety=1.0)
    stretched = np.zeros((len(model.points), 3))
    stretched[:, 1] = 5.0 * model.points[:, 1]
    with pytest.raises(FemConvergenceError, match="blew up"), np.errstate(all="ignore"):
        list(explicit.march(explicit.start(stretched.reshape(-1, 1), np.zeros((model.n_dof, 1))), 50))


@pytest.mark.parametrize("options", [{"time_step": 0.0}, {"safety": 1.5}])
def test_settings_that_make_no_sense_are_refused(options: dict[str, float]) -> None:
    with pytest.raises(FemInputError):
        ExplicitSettings(**({"time_step": 1e-4} | options))
