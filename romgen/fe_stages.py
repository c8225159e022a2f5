"""From the tables of a study to the finite-element half and back to the records of ``romgen.structure``."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager

import numpy as np

from fem.block import arch, graded, hex_block
from fem.campaign import (
    CampaignSegment,
    Observation,
    Starts,
    march_campaign,
    modal_coordinates,
    modal_starts,
    snap_back_starts,
)
from fem.contact import ContactState
from fem.equilibrium import interface_states
from fem.errors import FemConvergenceError, FemError
from fem.material import Material
from fem.mesh import Mesh
from fem.model import Body, Clamp, Model, Pair, Support, build_model
from fem.modes import ModalBasis, Rayleigh, damping_ratios, rayleigh
from fem.modes import solve_modes as tangent_modes
from fem.preload import StaticSettings, StaticState, solve_static
from fem.sensor import Sensor, sensor_rows
from fem.transient import Transient, TransientSettings
from romgen.arrays import FloatArray, IntArray
from romgen.differences import DROPPED, first_derivative, second_derivative
from romgen.errors import InputError, NumericalError
from romgen.progress import Report
from romgen.settings import BlockSettings, RingDownSettings, Study
from romgen.structure import EnergyLedger, Interface, Modes, Preload, RingDown, Structure
from romgen.trajectory import Trajectory

RingDownSegment = CampaignSegment


@contextmanager
def _translated() -> Iterator[None]:
    """Raise the failures of ``fem`` as those of romgen, message and history kept."""
    try:
        yield
    except FemConvergenceError as error:
        raise NumericalError(
            error.what, where=error.where, value=error.value, advice=error.advice, history=error.history
        ) from error
    except FemError as error:
        raise InputError(error.what, where=error.where, value=error.value, advice=error.advice) from error


@_translated()
def build(study: Study) -> Model:
    """Mesh the blocks of a study and assemble them with their contacts, constraints and loads."""
    bodies = []
    for name, block in study.blocks.items():
        table = study.materials[block.material]
        material = Material(table.young_modulus, table.poisson_ratio, table.density)
        bodies.append(Body(name, _mesh(block), material, block.kinematics))
    pairs = [
        Pair(name, c.slave, c.master, c.friction, c.normal_penalty, c.tangential_penalty)
        for name, c in study.contacts.items()
    ]
    supports = [Support(c.surface, tuple(c.directions)) for c in study.constraints]
    clamps = [Clamp(load.name, load.surface, load.total_force) for load in study.loads]
    return build_model(bodies, pairs=pairs, supports=supports, clamps=clamps)


def _mesh(block: BlockSettings) -> Mesh:
    lines = [graded(*block.axis(name)) for name in ("x", "y", "z")]
    shape = block.arch
    mapping = None if shape is None else lambda points: arch(points, shape.rise, shape.span)
    return hex_block(lines[0], lines[1], lines[2], element=block.element, mapping=mapping)


def structure(study: Study) -> Structure:
    """Return the geometry of a study for pictures and field output."""
    model = build(study)
    skins = [body.mesh.skin() + offset for body, offset in zip(model.bodies, model.offsets, strict=True)]
    counts = [len(body.mesh.cells) for body in model.bodies]
    return Structure(
        points=model.points,
        cells=np.vstack([body.mesh.cells + offset for body, offset in zip(model.bodies, model.offsets, strict=True)]),
        cell_type=model.bodies[0].mesh.element,
        cell_body=np.repeat(np.arange(len(counts)), counts),
        bodies=tuple(body.name for body in model.bodies),
        skin=_triangles(np.vstack(skins)),
    )


def _triangles(facets: IntArray) -> IntArray:
    """Two corner triangles per quadrilateral, one per triangle."""
    if facets.shape[1] == 6:
        return facets[:, :3]
    return np.vstack([facets[:, [0, 1, 2]], facets[:, [0, 2, 3]]])


@_translated()
def solve_preload(study: Study, report: Report) -> Preload:
    """Find the static equilibrium under the loads of a study."""
    model = build(study)
    table = study.preload
    settings = StaticSettings(table.steps, table.tolerance, table.max_iterations)
    state = solve_static(model, model.load, settings, progress=lambda f: report(f, f"load factor {f:.2f}"))
    interfaces = tuple(
        Interface(
            name=s.name,
            points=model.contact.points[s.point],
            area=model.contact.area[s.point],
            pressure=s.pressure,
            traction=s.traction,
            gap=s.gap,
            status=s.status,
            normal_force_n=s.normal_force,
            applied_force_n=s.applied_force,
            contact_area_m2=s.contact_area,
        )
        for s in interface_states(model, state.u, state.contact)
    )
    return Preload(state.u, interfaces, np.array(state.load_factors), np.array(state.residuals))


def _equilibrium(model: Model, preload: Preload) -> StaticState:
    """Rebuild the converged state from its record; the anchor of every spring is s_p = s - tau_t / k_t."""
    contact = model.contact
    empty = np.empty((0, 3))
    traction = np.concatenate([empty, *(np.column_stack([-i.pressure, i.traction]) for i in preload.interfaces)])
    status = np.concatenate([np.empty(0, dtype=np.int64), *(i.status for i in preload.interfaces)])
    tangential = (contact.operator @ preload.displacement).reshape(-1, 3)[:, 1:]
    slip = tangential - traction[:, 1:] / contact.law[:, 1:2]
    state = ContactState(traction.reshape(-1, 1), slip[:, :, None], status[:, None])
    return StaticState(preload.displacement, state, tuple(preload.load_factors), tuple(preload.residuals))


@_translated()
def solve_modes(study: Study, preload: Preload) -> Modes:
    """Find the modes about the preloaded state, their damping, loads and sensors."""
    model = build(study)
    basis = tangent_modes(model, _equilibrium(model, preload), study.modes.count)
    damping = _damping(study, basis)
    base = study.base_acceleration
    inertia = -basis.left.T @ model.direction(base.direction) if base else np.empty((study.modes.count, 0))
    sensors = [Sensor(name, table.point, table.direction) for name, table in study.sensors.items()]
    return Modes(
        frequency_hz=basis.omega / (2.0 * np.pi),
        damping_ratio=damping_ratios(basis, damping),
        shapes=basis.shapes,
        left=basis.left,
        modal_load=inertia.reshape(study.modes.count, -1),
        inputs=("base_acceleration",) if base else (),
        input_units=("m/s2",) if base else (),
        sensors=tuple(study.sensors),
        sensor_matrix=sensor_rows(model, sensors),
        alpha=damping.alpha,
        beta=damping.beta,
    )


def _damping(study: Study, basis: ModalBasis) -> Rayleigh:
    first, second = study.modes.rayleigh_modes
    return rayleigh(basis, (first - 1, second - 1), study.modes.damping_ratio)


def march_ringdowns(
    study: Study, preload: Preload, modes: Modes, restart: CampaignSegment | None
) -> Iterator[CampaignSegment]:
    """Yield the missing segments of all ring-downs of a study, which march together."""
    with _translated():
        table = _ringdowns(study)
        model = build(study)
        equilibrium = _equilibrium(model, preload)
        omega = 2.0 * np.pi * modes.frequency_hz
        basis = ModalBasis(omega, modes.shapes, modes.left, model.elastic_tangent(equilibrium.u))
        etas = _start_coordinates(study, basis)
        count = len(etas[0])
        inertia = [np.linalg.norm(modes.left[:, :count] @ (omega[:count] ** 2 * eta)) for eta in etas]
        settings = TransientSettings(table.time_step, table.spectral_radius, table.tolerance, corrected_modes=count)
        damping = Rayleigh(modes.alpha, modes.beta)
        transient = Transient(model, equilibrium, basis, damping, settings, force_scale=float(max(inertia)))
        yield from march_campaign(
            transient,
            Observation(basis, modes.sensor_matrix, table.snapshot_stride),
            table.steps,
            table.segment_steps,
            starts=None if restart is not None else _starts(table, transient, basis, etas),
            restart=None if restart is None else restart.state,
        )


def _ringdowns(study: Study) -> RingDownSettings:
    if study.ringdowns is None:
        raise InputError("the study has no ring-downs", where="[ringdowns]")
    return study.ringdowns


def _start_coordinates(study: Study, basis: ModalBasis) -> list[FloatArray]:
    """Modal coordinates of every start up to the highest master mode; modes between the masters start at zero."""
    masters = np.array(study.learn.master_modes) - 1
    etas = []
    for start in _ringdowns(study).starts:
        peaks = np.zeros(masters.max() + 1)
        peaks[masters] = start.amplitudes
        etas.append(modal_coordinates(basis, tuple(peaks)))
    return etas


def _starts(table: RingDownSettings, transient: Transient, basis: ModalBasis, etas: Sequence[FloatArray]) -> Starts:
    if table.start == "static":
        return snap_back_starts(transient, basis, etas)
    return modal_starts(basis, transient.equilibrium, etas)


def join_ringdowns(segments: Sequence[CampaignSegment], study: Study, modes: Modes) -> tuple[RingDown, ...]:
    """Join the segments of the campaign into one record per ring-down, in the order of the study."""
    starts = _ringdowns(study).starts
    return tuple(_ringdown(segments, study, modes, case, start.name) for case, start in enumerate(starts))


def _ringdown(segments: Sequence[CampaignSegment], study: Study, modes: Modes, case: int, name: str) -> RingDown:
    masters = np.array(study.learn.master_modes) - 1
    step = _ringdowns(study).time_step
    steps = np.concatenate([s.steps for s in segments])
    displacement = np.concatenate([s.displacement[..., case] for s in segments])
    velocity = np.concatenate([s.velocity[..., case] for s in segments])
    eta, eta_dot, eta_ddot = (
        np.concatenate([getattr(s, rate)[:, masters, case] for s in segments])
        for rate in ("eta", "eta_dot", "eta_ddot")
    )
    trajectory = Trajectory(
        name=name,
        t=steps * step,
        sensors=modes.sensors,
        displacement=displacement,
        velocity=_inside(first_derivative, displacement, step, velocity),
        eta=eta,
        eta_dot=_inside(first_derivative, eta, step, eta_dot),
        eta_ddot=_inside(second_derivative, eta, step, eta_ddot),
        snapshots=np.concatenate([s.snapshots[..., case] for s in segments]),
        snapshot_index=np.searchsorted(steps, np.concatenate([s.snapshot_steps for s in segments])),
    )
    energies = np.concatenate([s.energies[..., case] for s in segments])
    return RingDown(trajectory, _ledger(energies), np.concatenate([s.iterations[:, case] for s in segments]))


def _inside(
    derivative: Callable[[FloatArray, float], FloatArray], x: FloatArray, step: float, ends: FloatArray
) -> FloatArray:
    """Derivative of the computed motion, with the integrator's own values at the few samples of either end.

    Generalised-alpha velocities and accelerations differ from the derivatives of its displacements by O((omega h)^2),
    0.1 % at 200 Hz and 1e-4 s: a model learned from them would not reproduce the motion that it was learned from.
    """
    rates = ends.copy()
    rates[DROPPED:-DROPPED] = derivative(x, step)
    return rates


def _ledger(energies: FloatArray) -> EnergyLedger:
    """Turn the columns kinetic, strain, contact, friction, damping, external into a ledger with its imbalance."""
    kinetic, strain, contact, friction, damping, external = energies.T
    stored = kinetic + strain + contact
    imbalance = stored - stored[0] + friction + damping - external
    return EnergyLedger(kinetic, strain, contact, friction, damping, external, imbalance)
