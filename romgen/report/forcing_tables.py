"""Load inputs of a model of recorded data: what they were calibrated on and how well that holds."""

from __future__ import annotations

import numpy as np

from romgen.load_calibration import CalibratedPoint, InputLoad
from romgen.load_fit import AMPLITUDE_ERROR, FREQUENCY_ERROR, LEVEL_ERROR
from romgen.report.backbone_figures import MEASURE_NAMES
from romgen.report.blocks import TableBlock
from romgen.report.style import unit_text


def load_table(loads: tuple[InputLoad, ...]) -> TableBlock:
    """Modal load of every input, its deviation and its source."""
    rows = tuple(
        (
            load.input.replace("_", " "),
            _source(load),
            ", ".join(f"{f:.4g}" for f in load.modal_load),
            ", ".join(f"{d:.1f}" if np.isfinite(d) else "-" for d in load.deviation_percent),
            f"{load.spread_percent:.1f}" if np.isfinite(load.spread_percent) else "-",
        )
        for load in loads
    )
    caption = (
        "Loads of the input on the master modes: acceleration of the sensor that moves most in a mode, in m/s² per "
        "unit of the input. Deviation: standard deviation of each. Spread: of the points about the fit, in level. "
        "Recorded data do not hold these loads; they are as good as the points."
    )
    return TableBlock(caption, ("input", "from", "load on the modes", "deviation [%]", "spread [%]"), rows)


def _source(load: InputLoad) -> str:
    n = len(load.points)
    return f"{n} measured point{'s' * (n > 1)}" if n else "given participation"


def calibration_table(load: InputLoad) -> TableBlock:
    """Every measured point against the calibrated model."""
    header = (
        "level",
        "frequency [Hz]",
        "model resonates at [Hz]",
        "mode",
        "sensor",
        "measured [mm]",
        "model [mm]",
        "level needed",
        "deviation [%]",
        "expected [%]",
        "remark",
    )
    caption = (
        f"Points that “{load.input}” was calibrated on. Model: its amplitude under the same level, next to the "
        "measurement. Needed: the level at which the model shows the measured amplitude; near a fold a small deviation "
        f"of it moves the amplitude far. Expected: what {100 * AMPLITUDE_ERROR:g} % in amplitude, "
        f"{100 * LEVEL_ERROR:g} % in level and {100 * FREQUENCY_ERROR:g} % in frequency explain; a point weighs by "
        "its inverse square."
    )
    return TableBlock(caption, header, tuple(_row(point) for point in load.points))


def _row(point: CalibratedPoint) -> tuple[str, ...]:
    remarks = (
        ("peak of the response", point.peak),
        ("outside the trained range", point.distance > 1.0),
        ("not stable", not point.stable),
    )
    return (
        f"{point.level:g} {unit_text(point.unit)}",
        f"{point.frequency_hz:.3f}",
        f"{point.resonance_hz:.3f}" if np.isfinite(point.resonance_hz) else "-",
        f"{point.mode}",
        f"{point.sensor}, {MEASURE_NAMES[point.measure]}",
        f"{1e3 * point.measured_m:.4f}",
        f"{1e3 * point.model_m:.4f}" if np.isfinite(point.model_m) else "none",
        f"{point.level_needed:.4g}",
        f"{point.deviation_percent:+.2f}",
        f"{point.expected_percent:.1f}",
        ", ".join(text for text, holds in remarks if holds),
    )
