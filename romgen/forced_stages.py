"""The stages that answer forced questions with the reduced model: frequency responses and backbones."""

from __future__ import annotations

from dataclasses import dataclass

from romgen.backbone import Backbone, backbone
from romgen.forced_curve import ForcedResponse
from romgen.forced_response import forced_response
from romgen.learning_stages import learned_model
from romgen.settings import Study
from romgen.stage import Context, Stage


@dataclass(frozen=True)
class Backbones:
    """Backbones of all master modes.

    Attributes
    ----------
    curves : each mode with the others at zero, then those that the others can lock to.
    """

    curves: tuple[Backbone, ...]


def forced_stages(study: Study) -> tuple[Stage, ...]:
    """Return the stages: without levels there is no forced response."""
    backbones = Stage("backbone", Backbones, ("learn",), (), compute_backbones)
    if not study.forced_response.levels:
        return (backbones,)
    return (Stage("forced_response", ForcedResponse, ("learn",), ("forced_response",), compute_response), backbones)


def compute_response(context: Context) -> ForcedResponse:
    """Follow the frequency responses at all levels."""
    return forced_response(learned_model(context), context.study.forced_response)


def compute_backbones(context: Context) -> Backbones:
    """Follow the backbone of every master mode."""
    model = learned_model(context)
    modes = range(len(model.eigenvalues))
    curves = [backbone(model, mode) for mode in modes]
    r = model.internal_resonance
    # The others lock only to a mode whose integer divides all others: in 1:2 to the first mode, not to the second.
    locking = [mode for mode in modes if r and all(other % r[mode] == 0 for other in r)]
    curves += [backbone(model, mode, slaved=True) for mode in locking]
    return Backbones(tuple(curves))
