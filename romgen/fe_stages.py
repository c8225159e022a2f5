"""From the tables of a study to the finite-element half and back to the records of ``romgen.structure``."""

from __future__ import annotations

import logging
import warnings
from collections.abc import Iterator, Mapping
from contextlib import contextmanager

import numpy as np

from fem.block import arch, graded, hex_block
from fem.contact import ContactState
from fem.equilibrium import interface_states
from fem.errors import FemConvergenceError, FemError
from fem.locate_point import bodies_at_point, cell_of_point
from fem.material import Material
from fem.mesh import Mesh, within
from fem.modal_quantities import effective_masses, near_integer_ratios, total_masses
from fem.model import (
    Body,
    Bolt,
    Foundation,
    Model,
    Pair,
    PointMass,
    Spring,
    Support,
    Tie,
    build_model,
)
from fem.modes import ModalBasis, Rayleigh, damping_ratios, rayleigh
from fem.modes import solve_modes as tangent_modes
from fem.preload import StaticSettings, StaticState, lock_bolts
from fem.preload import solve_preload as tighten
from fem.reach import ReachWarning, TieWarning
from fem.read_mesh import read_mesh
from fem.sensor import Sensor, SensorWarning, sensor_rows
from fem.sliding import SlidingWarning
from fem.springs import Elastic
from fem.stress import nodal_stress
from romgen.arrays import IntArray
from romgen.errors import InputError, NumericalError
from romgen.fe_inputs import dead_load, still, time_loads
from romgen.progress import Report
from romgen.settings import BlockSettings, MeshSettings, Study, named_points, named_surfaces, unknown
from romgen.structure import RATIO_TOLERANCE, FrequencyRatio, Interface, Modes, Preload, Structure

log = logging.getLogger(__name__)


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


@contextmanager
def logged() -> Iterator[None]:
    """Hand what ``fem`` warns of to the log, and so to the report."""
    with warnings.catch_warnings(record=True) as caught:
        for category in (SensorWarning, SlidingWarning, ReachWarning, TieWarning):
            warnings.simplefilter("always", category)
        yield
    for warning in caught:
        log.warning("%s", warning.message)


@translated()
def build(study: Study) -> Model:
    """Mesh the bodies of a study and assemble them with their contacts, constraints and loads.

    What it warns of (``TieWarning``) is logged by the preload, which every other stage comes after.
    """
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", TieWarning)
        return _assembled(study)


def _assembled(study: Study) -> Model:
    bodies = [_body(study, name, body_mesh(study, name)) for name in study.bodies]
    pairs = [Pair(name, **contact.model_dump()) for name, contact in study.contacts.items()]
    ties = [Tie(name, **tie.model_dump()) for name, tie in study.ties.items()]
    bolts = [Bolt(name, **bolt.model_dump()) for name, bolt in study.bolts.items()]
    springs: list[Elastic] = [Spring(name, **spring.model_dump()) for name, spring in study.springs.items()]
    springs += [Foundation(name, **bed.model_dump()) for name, bed in study.foundations.items()]
    masses = [PointMass(name, **mass.model_dump()) for name, mass in study.point_masses.items()]
    supports = [Support(c.surface, tuple(c.directions), c.displacement or 0.0) for c in study.constraints]
    loads = [dead_load(table) for table in study.loads]
    return build_model(
        bodies,
        pairs=pairs,
        supports=supports,
        loads=loads,
        ties=ties,
        bolts=bolts,
        springs=springs,
        point_masses=masses,
    )


def _body(study: Study, name: str, mesh: Mesh) -> Body:
    table = study.bodies[name]
    values = study.materials[table.material]
    return Body(name, mesh, Material(values.young_modulus, values.poisson_ratio, values.density), table.kinematics)


def body_mesh(study: Study, name: str) -> Mesh:
    """Mesh one body of a study, with its regions."""
    table = study.bodies[name]
    if isinstance(table, MeshSettings):
        mesh = read_mesh(
            table.file, group=table.group, unit=table.unit_m, raise_order=table.raise_order, mesh_size=table.mesh_size
        )
    else:
        mesh = _block(table)
    for label, region in study.regions.items():
        if region.body == name:
            mesh = mesh.with_region(label, within(region.x, region.y, region.z))
    return mesh


def _block(block: BlockSettings) -> Mesh:
    lines = [graded(*block.axis(name)) for name in ("x", "y", "z")]
    shape = block.arch
    mapping = None if shape is None else lambda points: arch(points, shape.rise, shape.span)
    return hex_block(lines[0], lines[1], lines[2], element=block.element, mapping=mapping)


def mesh_file_problems(study: Study) -> tuple[tuple[str, ...], int]:
    """Open the mesh files of a study; one line per problem of files, regions and names on them, and their nodes."""
    problems: list[str] = []
    meshes: dict[str, Mesh] = {}
    regions = [region.body for region in study.regions.values()]
    for name in study.bodies:
        if name in study.meshes or name in regions:
            try:
                meshes[name] = body_mesh(study, name)
            except FemError as error:
                problems.append(f"[{'meshes' if name in study.meshes else 'regions of blocks'}.{name}] {error}")
    contacts = [f"[contacts.{name}]" for name in study.contacts] + [f"[ties.{name}]" for name in study.ties]
    for where, named in named_surfaces(study):
        body, _, parts = named.partition(".")
        if body not in meshes or body not in study.meshes:
            continue
        mesh = meshes[body]
        known = (*mesh.surfaces, "skin") if where.split()[0] in contacts else (*mesh.surfaces, *mesh.node_sets, "skin")
        wanted = [parts] if where.split()[0] in contacts else parts.split("&")
        problems += [
            unknown(where, "surface", f"{body}.{part}", [f"{body}.{name}" for name in sorted(set(known))])
            for part in wanted
            if part not in known
        ]
    if study.meshes and not problems:
        problems += _place_problems(study, meshes)
    return tuple(problems), sum(len(mesh.points) for name, mesh in meshes.items() if name in study.meshes)


def _place_problems(study: Study, meshes: Mapping[str, Mesh]) -> Iterator[str]:
    """One line per point that lies outside the bodies, or on several without saying which."""
    bodies = [_body(study, name, meshes[name] if name in meshes else body_mesh(study, name)) for name in study.bodies]
    for item in named_points(study):
        try:
            on = bodies_at_point(bodies, item.point, where=item.where) if item.is_sensor and item.body is None else ()
            body = on[0] if on else item.body
            cell_of_point(bodies, np.zeros(len(bodies), dtype=np.int64), item.point, where=item.where, body=body)
        except FemError as error:
            yield str(error)


def structure(study: Study) -> Structure:
    """Return the geometry of a study for pictures and field output."""
    model = build(study)
    skins = [body.mesh.skin() + offset for body, offset in zip(model.bodies, model.offsets, strict=True)]
    counts = [len(body.mesh.cells) for body in model.bodies]
    cells = np.full((sum(counts), max(body.mesh.cells.shape[1] for body in model.bodies)), -1, dtype=np.int64)
    ends = np.cumsum(counts)
    for body, offset, end in zip(model.bodies, model.offsets, ends, strict=True):
        cells[end - len(body.mesh.cells) : end, : body.mesh.cells.shape[1]] = body.mesh.cells + offset
    return Structure(
        points=model.points,
        cells=cells,
        cell_types=tuple(body.mesh.element for body in model.bodies),
        cell_body=np.repeat(np.arange(len(counts)), counts),
        bodies=tuple(body.name for body in model.bodies),
        skin=np.vstack([_triangles(skin) for skin in skins]),
    )


def _triangles(facets: IntArray) -> IntArray:
    """Two corner triangles per quadrilateral, one per triangle."""
    if facets.shape[1] == 6:
        return facets[:, :3]
    return np.vstack([facets[:, [0, 1, 2]], facets[:, [0, 2, 3]]])


@translated()
def solve_preload(study: Study, report: Report) -> Preload:
    """Find the static equilibrium under the loads of a study."""
    table = study.preload
    settings = StaticSettings(table.steps, table.tolerance, table.max_iterations)
    with logged():
        model, state = tighten(_assembled(study), settings, progress=lambda f: report(f, f"load factor {f:.2f}"))
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
    cauchy = nodal_stress(model, state.u).cauchy
    stress = cauchy[:, [0, 1, 2, 0, 1, 0], [0, 1, 2, 1, 2, 2]]
    return Preload(
        state.u, interfaces, np.array(state.load_factors), np.array(state.residuals), stress, model.bolts.shortening
    )


def preloaded(study: Study, preload: Preload) -> Model:
    """Build the model of a study with its bolts locked as the preload left them."""
    return lock_bolts(build(study), preload.bolt_shortening)


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
    model = preloaded(study, preload)
    basis = tangent_modes(model, equilibrium(model, preload), study.modes.count)
    damping = _damping(study, basis)
    loads = [load.pattern for load in time_loads(study, model, dict.fromkeys(study.load_inputs, still))]
    sensors = [Sensor(name, table.point, table.direction, table.body) for name, table in study.sensors.items()]
    with logged():
        rows = sensor_rows(model, sensors)
    frequency = basis.omega / (2.0 * np.pi)
    near = near_integer_ratios(frequency, tolerance=RATIO_TOLERANCE)
    return Modes(
        frequency_hz=frequency,
        damping_ratio=damping_ratios(basis, damping),
        shapes=basis.shapes,
        left=basis.left,
        modal_load=basis.shapes.T @ np.column_stack([np.empty((model.n_dof, 0)), *loads]),
        inputs=tuple(study.load_inputs),
        input_units=tuple(study.load_inputs.values()),
        sensors=tuple(study.sensors),
        sensor_matrix=rows,
        alpha=damping.alpha,
        beta=damping.beta,
        effective_mass=effective_masses(model, basis)[:, :3],
        total_mass=float(total_masses(model)[0]),
        near_ratios=tuple(FrequencyRatio(r.first, r.second, r.low, r.high, r.detuning) for r in near),
    )


def _damping(study: Study, basis: ModalBasis) -> Rayleigh:
    first, second = study.modes.rayleigh_modes
    return rayleigh(basis, (first - 1, second - 1), study.modes.damping_ratio)
