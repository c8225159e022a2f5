"""From the tables of a study to the finite-element half and back to the records of ``romgen.structure``."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager

import numpy as np

from fem.block import arch, graded, hex_block
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
from romgen.arrays import IntArray
from romgen.errors import InputError, NumericalError
from romgen.progress import Report
from romgen.settings import BlockSettings, Study
from romgen.structure import Interface, Modes, Preload, Structure


@contextmanager
def translated() -> Iterator[None]:
    """Raise the failures of ``fem`` as those of romgen, message and history kept."""
    try:
        yield
    except FemConvergenceError as error:
        raise NumericalError(
            error.what, where=error.where, value=error.value, advice=error.advice, history=error.history
        ) from error
    except FemError as error:
        raise InputError(error.what, where=error.where, value=error.value, advice=error.advice) from error


@translated()
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


@translated()
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


def equilibrium(model: Model, preload: Preload) -> StaticState:
    """Rebuild the converged state from its record; the anchor of every spring is s_p = s - tau_t / k_t."""
    contact = model.contact
    empty = np.empty((0, 3))
    traction = np.concatenate([empty, *(np.column_stack([-i.pressure, i.traction]) for i in preload.interfaces)])
    status = np.concatenate([np.empty(0, dtype=np.int64), *(i.status for i in preload.interfaces)])
    tangential = (contact.operator @ preload.displacement).reshape(-1, 3)[:, 1:]
    slip = tangential - traction[:, 1:] / contact.law[:, 1:2]
    state = ContactState(traction.reshape(-1, 1), slip[:, :, None], status[:, None])
    return StaticState(preload.displacement, state, tuple(preload.load_factors), tuple(preload.residuals))


@translated()
def solve_modes(study: Study, preload: Preload) -> Modes:
    """Find the modes about the preloaded state, their damping, loads and sensors."""
    model = build(study)
    basis = tangent_modes(model, equilibrium(model, preload), study.modes.count)
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
