"""A small lab study whose motions come from a known two-mode normal form."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from romgen.simulate import simulate
from romgen.trajectory import Trajectory
from romgen.trajectory_files import write_trajectories
from tests.records import example_model

SHAPES = np.array([[1.0, -0.8], [1.1, 0.1], [0.9, 0.9]])
STARTS = {"bending": (0.8, 0.0), "torsion": (0.0, 0.6), "mixed": (0.5, 0.4), "other": (0.7, 0.2)}
STUDY_TOML = """
[study]
name = "lab"
[data]
files = ["motions.h5"]
sensors = ["lower", "mid", "upper"]
unit = "m"
training = ["bending", "torsion", "mixed"]
validation = ["other"]
[learn]
internal_resonance = [1, 2]
order = 3
"""


def write_lab_study(folder: Path) -> Path:
    """Write study.toml and four decays of 0.4 s at 10 kHz; return the study's path."""
    model, t = example_model(), 1e-4 * np.arange(4001)
    motions = []
    for name, start in STARTS.items():
        z = simulate(model, t, np.array(start, dtype=np.complex128))
        motions.append(Trajectory(name, t, ("lower", "mid", "upper"), 1e-3 * z.real @ SHAPES.T))
    write_trajectories(folder / "motions.h5", motions)
    (folder / "study.toml").write_text(STUDY_TOML, encoding="utf-8")
    return folder / "study.toml"
