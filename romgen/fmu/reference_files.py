"""Reference results beside a unit: FMI Cross-Check rules 4.1 and the layered standard LS-REF (1.0.0-alpha.1)."""

from __future__ import annotations

import shutil
from pathlib import Path

import numpy as np
from fmpy import read_model_description

import romgen
from romgen.arrays import ComplexArray, FloatArray
from romgen.errors import InputError
from romgen.fmu.compilers import host_platform
from romgen.fmu.model_file import model_in_unit
from romgen.fmu.sensor_variables import input_names, sensor_names
from romgen.fmu.templates import render
from romgen.reduced_model import ReducedModel
from romgen.simulate import Hold, sensors, simulate

N_STEP = 2000
INTERNAL = 5e-6
"""s, internal step of the reference: its own error is below 1e-12, what remains is the treatment of the input."""

MAX_SENSORS = 4
"""With displacement, velocity and trust ratio below the ten variables that the cross-check rules ask for."""

START = 0.3
LS_REF = "extra/org.fmi-standard.fmi-ls-ref"


def write_reference_files(unit: Path, folder: Path, step: float = 1e-5) -> tuple[Path, ...]:
    """Write reference solutions of a unit for both readings of its input file.

    ``{name}_in.csv`` is linear between its rows in the cross-check rules; importers that only call fmi2SetReal hold it.
    ``_ref.csv`` (linear) and ``_ref_held.csv`` give both, computed by the Python model, not by the unit.

    Parameters
    ----------
    unit : exported by ``export_fmu``, starting from states.
    folder : receives the cross-check tree fmus/2.0/{cs,me}/... and the LS-REF tree extra/...
    step : s, of the input file and of the communication.

    Returns
    -------
    The files written.

    Raises
    ------
    InputError : the unit holds no reduced model.
    """
    model = model_in_unit(unit)
    if model is None:
        raise InputError("holds no reduced model", where=str(unit))
    shown = {v.name for v in read_model_description(str(unit), validate=False).modelVariables}
    t: FloatArray = step * np.arange(N_STEP + 1, dtype=np.float64)
    z0 = START * model.trained_amplitude.astype(np.complex128)
    u = _sweep(model, t)
    inputs = _csv(("time", *input_names(model)), np.column_stack([t, u]))
    results = {hold: _result(model, t, (z0, u), hold, shown) for hold in ("linear", "constant")}
    starts = {f"z{j}_re": float(z.real) for j, z in enumerate(z0, 1)}
    return (
        *_cross_check(unit, folder, model.name, (inputs, results["linear"], results["constant"]), (step, starts)),
        *_layered(folder / LS_REF, model.name, (inputs, results["linear"], results["constant"]), (step, starts)),
    )


def _sweep(model: ReducedModel, t: FloatArray) -> FloatArray:
    """(n_time, n_input) a sine near the first mode that would swing it to half its trained amplitude in resonance."""
    if not model.inputs:
        return np.zeros((len(t), 0))
    omega = float(model.eigenvalues[0].imag)
    share = np.maximum(np.abs(model.input_matrix[0]), np.finfo(float).tiny)
    peak = 0.5 * float(model.trained_amplitude[0]) / (share * float(t[-1]) * len(share))
    u: FloatArray = np.sin(0.9 * omega * t)[:, None] * peak
    return u


def _result(
    model: ReducedModel, t: FloatArray, motion: tuple[ComplexArray, FloatArray], hold: Hold, shown: set[str]
) -> str:
    """CSV of the first sensors and the trust ratio."""
    z0, u = motion
    z = simulate(model, t, z0, u if model.inputs else None, hold, INTERNAL)
    names = sensor_names(model)[:MAX_SENSORS]
    x, v = sensors(model, z)
    columns = [column for k in range(len(names)) for column in (x[:, k], v[:, k])]
    ratio = model.trained_range.distance(z)
    header = ("time", *(name for pair in names for name in pair), "trust_ratio")
    missing = set(header) - shown - {"time"}
    if missing:
        raise InputError("variables are missing in the unit", where="reference files", value=sorted(missing))
    return _csv(header, np.column_stack([t, *columns, ratio])[:: max(1, len(t) // 1000)])


def _csv(header: tuple[str, ...], table: FloatArray) -> str:
    """Comma separated, quoted header, as the cross-check rules ask."""
    lines = [",".join(f'"{name}"' for name in header)]
    lines += [",".join(f"{value:.12g}" for value in row) for row in table]
    return "\n".join(lines) + "\n"


def _cross_check(
    unit: Path, folder: Path, name: str, texts: tuple[str, str, str], run: tuple[float, dict[str, float]]
) -> list[Path]:
    step, starts = run
    options = f"StartTime,0.0\nStopTime,{step * N_STEP:.12g}\nStepSize,{step:.12g}\nRelTol,1e-6\n"
    start_text = "".join(f"\n    {key} = {value!r}" for key, value in starts.items())
    readme = (
        f"{name}: reduced model exported by romgen {romgen.__version__}.\n\nStart values:{start_text}\n\n"
        f"{name}_ref.csv: {name}_in.csv linear between its rows; {name}_ref_held.csv: held from row to row.\n"
        "Both come from the Python model with internal steps of 5e-6 s.\n"
    )
    files = []
    for kind in ("cs", "me"):
        target = folder / "fmus" / "2.0" / kind / host_platform() / "romgen" / romgen.__version__ / name
        target.mkdir(parents=True, exist_ok=True)
        shutil.copyfile(unit, target / f"{name}.fmu")
        ends = ("_in.csv", "_ref.csv", "_ref_held.csv")
        content = {f"{name}{end}": text for end, text in zip(ends, texts, strict=True)}
        content |= {f"{name}_ref.opt": options, "README.txt": readme}
        files += [target / f"{name}.fmu", *_write(target, content)]
    return files


def _layered(folder: Path, name: str, texts: tuple[str, str, str], run: tuple[float, dict[str, float]]) -> list[Path]:
    step, starts = run
    folder.mkdir(parents=True, exist_ok=True)
    values = {"name": name, "step": repr(step), "stop": f"{step * N_STEP:.12g}", "starts": starts}
    content = {
        "fmi-ls-manifest.xml": render("fmi-ls-manifest.xml.j2", **values),
        "experiments.xml": render("experiments.xml.j2", **values),
        "start.ssv": render("start.ssv.j2", **values),
        "input.csv": texts[0],
        "linear.csv": texts[1],
        "held.csv": texts[2],
    }
    return _write(folder, content)


def _write(folder: Path, content: dict[str, str]) -> list[Path]:
    for name, text in content.items():
        (folder / name).write_text(text, encoding="utf-8")
    return [folder / name for name in content]
