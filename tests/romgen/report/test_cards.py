"""Headline numbers and their verdicts."""

from __future__ import annotations

from dataclasses import replace

import pytest

from romgen.report import ReportInputs
from romgen.report.cards import cards
from romgen.settings import AcceptanceSettings


def card(inputs: ReportInputs, name: str) -> tuple[str, bool | None]:
    """Value and verdict of one headline number."""
    return next((c.value, c.passed) for c in cards(inputs) if c.label == name)


def test_worst_validation_motion_is_judged(full_inputs: ReportInputs) -> None:
    """Training motions never count; the limit decides."""
    worse = tuple(
        replace(pair, nmte_percent=80.0 if pair.role == "training" else 6.4) for pair in full_inputs.reconstructions
    )
    for limit, met in ((5.0, False), (10.0, True)):
        judged = replace(full_inputs, reconstructions=worse, limits=AcceptanceSettings(nmte_percent=limit))
        assert card(judged, "Validation NMTE") == ("6.40", met)


def test_no_validation_motion_no_verdict(full_inputs: ReportInputs) -> None:
    """A model that was never validated shows no validation error."""
    seen = tuple(pair for pair in full_inputs.reconstructions if pair.role == "training")
    labels = [c.label for c in cards(replace(full_inputs, reconstructions=seen))]
    assert "Validation NMTE" not in labels


def test_clamping_force_error(full_inputs: ReportInputs) -> None:
    """|54600 / (54600 1.0004) - 1| = 0.04 %; undetermined interfaces are passed over."""
    assert card(full_inputs, "Clamping force error") == ("0.04", True)
    assert full_inputs.preload is not None
    loose = tuple(replace(i, applied_force_n=float("nan")) for i in full_inputs.preload.interfaces)
    labels = [c.label for c in cards(replace(full_inputs, preload=replace(full_inputs.preload, interfaces=loose)))]
    assert "Clamping force error" not in labels


def test_frequencies_come_from_the_model_where_there_is_one(full_inputs: ReportInputs) -> None:
    """f = Im(lambda) / 2 pi; without a model the first modes."""
    assert card(full_inputs, "Frequency 2") == (f"{1249.1 / 6.283185307179586:.2f}", None)
    assert card(replace(full_inputs, model=None), "Frequency 2") == ("198.80", None)
    assert float(card(full_inputs, "Frequency ratio")[0]) == pytest.approx(1249.1 / 689.3, abs=5e-5)
