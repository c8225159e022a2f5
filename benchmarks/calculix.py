"""python -m benchmarks.calculix [20k 188k]: the clamped panel here and in CalculiX, same mesh, materials and penalties.

Preload, frequencies about it, then implicit steps of 1e-4 s after a uniform acceleration of the preloaded structure is
taken off at t = 0; average acceleration without damping in both. Interfaces tied, then with friction. Needs ccx.
"""

from __future__ import annotations

import argparse
import os
import re
import shutil
import statistics
import subprocess
import sys
import tempfile
import time
from collections.abc import Callable
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np

from benchmarks.sizes import MESHES, refined
from fem.inp_writer import nodal_loads, write_inp
from fem.model import Model
from fem.modes import Rayleigh, solve_modes
from fem.preload import StaticSettings, solve_static
from fem.sensor import Sensor, sensor_rows
from fem.transient import Transient, TransientSettings
from romgen.fe_stages import build
from romgen.settings import Study, TieSettings

ACCELERATION = 500.0  # m/s^2 along y: about 1 mm, two thirds of the thickness
TIME_STEP = 1e-4
JOINTS = ("tied", "friction")
_DYNAMIC = 3  # number of the step of the deck
_POLL_S = 0.02


@dataclass
class Outcome:
    """What one program found: SI units, (n_sensor,) along y; None where it did not get there."""

    preload: np.ndarray | None = None
    frequency: np.ndarray | None = None
    released: np.ndarray | None = None
    moved: np.ndarray | None = None
    seconds: dict[str, float] = field(default_factory=dict)
    note: str = ""


@dataclass(frozen=True)
class Case:
    """One comparison: the model with its joints, the load that is taken off (n_dof,) N, sensor rows, steps, limit."""

    model: Model
    pull: np.ndarray
    rows: np.ndarray
    steps: int
    modes: int
    limit_s: float


def with_joints(study: Study, joints: str) -> Study:
    """The study with its contacts, or with ties between the same surfaces."""
    if joints == "friction":
        return study
    ties = {name: TieSettings(slave=c.slave, master=c.master) for name, c in study.contacts.items()}
    return study.model_copy(update={"contacts": {}, "ties": ties})


def ours(case: Case) -> Outcome:
    """Preload, modes and motion by this program."""
    model, found, begin = case.model, Outcome(), time.perf_counter()
    state = solve_static(model, model.load, StaticSettings())
    found.seconds["preload"] = time.perf_counter() - begin
    found.preload, begin = case.rows @ state.u, time.perf_counter()
    modes = solve_modes(model, state, case.modes)
    found.seconds["modes"] = time.perf_counter() - begin
    found.frequency = modes.omega / (2.0 * np.pi)
    loaded = solve_static(model, model.load + case.pull, StaticSettings(), start=state)
    found.released = case.rows @ (loaded.u - state.u)
    settings = TransientSettings(TIME_STEP, spectral_radius=1.0, dispersion_correction=False)
    scale = float(np.linalg.norm(case.pull))
    transient = Transient(model, state, modes, Rayleigh(0.0, 0.0), settings, force_scale=scale)
    away = (loaded.u - state.u)[:, None]
    start = transient.start(away, np.zeros_like(away), loaded.contact.slip, settled=True)
    stamps = [time.perf_counter()]
    for record in transient.march(start, case.steps):
        stamps.append(time.perf_counter())
        found.moved = case.rows @ (record.state.u[:, 0] - loaded.u)
    found.seconds["step"] = statistics.median(np.diff(stamps)[1:])
    return found


def calculix(case: Case, folder: Path) -> Outcome:
    """The same by CalculiX: one deck for preload and frequencies, one for the motion."""
    found = Outcome()
    nodes = np.unique(np.flatnonzero(np.any(case.rows, axis=0)) // 3)
    write_inp(folder / "model.inp", case.model)
    model = "*INCLUDE,INPUT=model.inp\n*NSET,NSET=sensors\n" + "".join(f"{n + 1},\n" for n in nodes)
    rest = nodal_loads(case.model.load)
    static = "*STEP,NLGEOM,INC=1000\n*STATIC\n1.,1.\n"
    output = "\n*NODE PRINT,NSET=sensors,FREQUENCY=1\nU\n*END STEP\n"
    modes = f"*STEP,PERTURBATION\n*FREQUENCY\n{case.modes}\n*END STEP\n"
    motion = f"*STEP,NLGEOM,AMPLITUDE=STEP,INC={case.steps}\n*DYNAMIC,DIRECT,ALPHA=0.\n"
    motion += f"{TIME_STEP:.6e},{case.steps * TIME_STEP:.6e}\n"
    pulled = nodal_loads(case.model.load + case.pull)
    (folder / "modes.inp").write_text(model + static + rest + output + modes)
    # An implicit *DYNAMIC step asks for energies from the first step on.
    energies = f"\n*EL PRINT,ELSET={case.model.bodies[0].name},TOTALS=ONLY\nELSE"
    steps = [static + rest + energies, static + pulled, motion + rest]
    (folder / "motion.inp").write_text(model + "".join(step + output for step in steps))
    found.note = _run(folder, "modes", case.limit_s, found.seconds)
    dat = _text(folder / "modes.dat")
    found.frequency = _frequencies(dat, case.modes)
    note = _run(folder, "motion", case.limit_s, found.seconds)
    found.note = "; ".join(n for n in (found.note, note) if n)
    # The steps end at 1 and 2 in the time of the file; mode shapes carry 2 too, but stand in the other deck.
    found.preload = _displacements(dat, nodes, case).get(1.0)
    at = _displacements(_text(folder / "motion.dat"), nodes, case)
    if 2.0 in at:
        found.released = at[2.0] - at[1.0]
        moved = [time for time in at if time > 2.0]
        found.moved = at[moved[-1]] - at[2.0] if len(moved) == case.steps else None
    return found


def _run(folder: Path, name: str, limit_s: float, seconds: dict[str, float]) -> str:
    """Run a deck; the times at which increments end go to ``seconds``. Returns what went wrong, or ""."""
    stamps: list[float] = [time.perf_counter()]
    environment = {**os.environ, "OMP_NUM_THREADS": os.environ.get("OMP_NUM_THREADS", "2")}
    with (folder / f"{name}.log").open("w") as log:
        process = subprocess.Popen(["ccx", name], cwd=folder, stdout=log, stderr=log, env=environment)
        while process.poll() is None and time.perf_counter() - stamps[0] < limit_s:
            time.sleep(_POLL_S)
            done = len(_increments(folder / f"{name}.sta"))
            stamps += [time.perf_counter()] * (done + 1 - len(stamps))
        end = time.perf_counter()
        if late := process.poll() is None:
            process.kill()
        process.wait()
    of_step = _increments(folder / f"{name}.sta")
    if name == "modes" and 1 in of_step and not (late and len(of_step) == 1):
        seconds["preload"] = stamps[of_step.count(1)] - stamps[0]
        seconds["modes"] = end - stamps[of_step.count(1)]
    motion = [b - a for step, a, b in zip(of_step, stamps, stamps[1:], strict=False) if step == _DYNAMIC]
    if len(motion) > 1:
        seconds["step"] = statistics.median(motion[1:])
    if late:
        tries = sum(line.split()[:1] == [str(_DYNAMIC)] for line in _text(folder / f"{name}.cvg").splitlines())
        return f"{name}: ccx stopped after {limit_s:.0f} s, {len(motion)} time steps converged in {tries} iterations"
    return f"{name}: ccx failed, see {folder / name}.log" if process.returncode else ""


def _text(path: Path) -> str:
    return path.read_text() if path.is_file() else ""


def _increments(path: Path) -> list[int]:
    """The step of every increment that converged, from the status file."""
    rows = [line.split() for line in _text(path).splitlines()]
    # Step, increment, attempt, iterations, times; the attempt of one that was cut back ends with U.
    return [int(row[0]) for row in rows if len(row) >= 6 and row[0].isdigit() and row[1].isdigit() and row[2].isdigit()]


def _displacements(dat: str, nodes: np.ndarray, case: Case) -> dict[float, np.ndarray]:
    """Sensor displacements (n_sensor,) by the time of the file."""
    found = {}
    _, *blocks = re.split(r"displacements \(vx,vy,vz\) for set SENSORS and time +", dat)
    for block in blocks:
        head, *lines = [line for line in block.splitlines() if line.strip()]
        u = np.zeros(case.model.n_dof)
        for line in lines[: len(nodes)]:
            node, *values = line.split()
            u[3 * int(node) - 3 : 3 * int(node)] = [float(value) for value in values]
        found[float(head)] = case.rows @ u
    return found


def _frequencies(dat: str, count: int) -> np.ndarray | None:
    """Frequencies in Hz from the table: number, eigenvalue (symmetric case only), rad/s, Hz, imaginary part."""
    _, _, table = dat.partition("E I G E N V A L U E   O U T P U T")
    rows = [line.split() for line in table.splitlines()]
    values = [float(row[-2]) for row in rows if len(row) in {4, 5} and row[0].isdigit()][:count]
    return np.array(values) if values else None


def print_table(found: Outcome, theirs: Outcome, steps: int) -> None:
    """Quantity, ours, CalculiX, difference; then wall times and their ratio."""
    print(f"  {'quantity':<34}{'ours':>14}{'ccx':>14}{'difference':>12}")

    def row(label: str, a: float, b: float | None) -> None:
        rest = f"{b:>14.6g}{100 * (b / a - 1):>10.2f} %" if b is not None else f"{'-':>14}{'-':>12}"
        print(f"  {label:<34}{a:>14.6g}{rest}")

    pairs: tuple[tuple[str, Callable[[Outcome], np.ndarray | None]], ...] = (
        ("preload, sensor {} (um)", lambda o: None if o.preload is None else 1e6 * o.preload),
        ("frequency {} (Hz)", lambda o: o.frequency),
        ("static under 500 m/s2, sensor {} (mm)", lambda o: None if o.released is None else 1e3 * o.released),
        (f"motion in {steps} steps, sensor {{}} (mm)", lambda o: None if o.moved is None else 1e3 * o.moved),
    )
    for label, of in pairs:
        left, right = of(found), of(theirs)
        assert left is not None
        for k, value in enumerate(left):
            row(label.format(k + 1), value, None if right is None else right[k])
    for name, seconds in found.seconds.items():
        other = theirs.seconds.get(name)
        rest = f"{other:>14.3f}{other / seconds:>10.1f} x" if other is not None else f"{'-':>14}{'-':>12}"
        print(f"  {f'wall time, {name} (s)':<34}{seconds:>14.3f}{rest}")
    if theirs.note:
        print(f"  {theirs.note}")


def compare(name: str, joints: str, steps: int, limit_s: float) -> None:
    """Print the table of one mesh with one kind of joint."""
    study = with_joints(refined(name), joints)
    model = build(study)
    pull = ACCELERATION * (model.mass @ model.direction("y")) * model.free
    rows = sensor_rows(model, [Sensor(s, t.point, t.direction, t.body) for s, t in study.sensors.items()])
    case = Case(model, pull, rows, steps, study.modes.count, limit_s)
    print(f"{name}, {joints}: {model.n_dof} DOF", flush=True)
    found = ours(case)
    folder = Path(tempfile.mkdtemp(prefix=f"calculix_{name}_{joints}_"))
    theirs = calculix(case, folder)
    print_table(found, theirs, steps)
    if not theirs.note:
        shutil.rmtree(folder)


def main() -> None:
    """Compare on the meshes asked for."""
    parser = argparse.ArgumentParser(prog="python -m benchmarks.calculix", description=__doc__)
    parser.add_argument("meshes", nargs="*", default=["20k"], metavar="mesh", help=f"of {', '.join(MESHES)}")
    parser.add_argument("--joints", nargs="+", choices=JOINTS, default=JOINTS)
    parser.add_argument("--steps", type=int, default=10, help="time steps, at least 2")
    parser.add_argument("--limit", type=float, default=600.0, help="seconds after which a run of ccx is stopped")
    arguments = parser.parse_args()
    if arguments.steps < 2:
        parser.error("--steps: at least 2, the first one is not timed")
    if shutil.which("ccx") is None:
        sys.exit("CalculiX (ccx) is not installed; on Debian and Ubuntu: apt install calculix-ccx")
    for name in arguments.meshes:
        for joints in arguments.joints:
            compare(name, joints, arguments.steps, arguments.limit)


if __name__ == "__main__":
    main()
