"""Points of a study: on which body they lie, and whether the study says so where it must."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np

from romgen.settings.finite_elements import BlockSettings
from romgen.settings.study import Study

_ON_FACE = 1e-6
"""Share of the size of a block within which a point counts as on its face."""

_NEAR = 0.01
"""The same for points that are taken for outside; the mesh decides about those between."""


@dataclass(frozen=True)
class NamedPoint:
    """Where a study names a point (m), the key of the body it is on, and the body that it gives, if any.

    A sensor where bodies touch measures the first of them and says so; what acts there must name its body.
    """

    where: str
    key: str
    point: tuple[float, float, float]
    body: str | None
    is_sensor: bool = False


def named_points(study: Study) -> tuple[NamedPoint, ...]:
    """Return all points of sensors, loads, excitations, springs and masses."""
    points = [
        NamedPoint(f"[{table}.{name}]", "body", item.point, item.body, table == "sensors")
        for table in ("sensors", "excitations", "springs", "point_masses")
        for name, item in getattr(study, table).items()
        if item.point is not None
    ]
    points += [NamedPoint(f"[loads[{k}]]", "body", i.point, i.body) for k, i in enumerate(study.loads) if i.point]
    points += [
        NamedPoint(f"[springs.{name}] to:", "to_body", spring.to, spring.to_body)
        for name, spring in study.springs.items()
        if spring.to is not None
    ]
    return tuple(points)


def unknown_bodies(study: Study) -> tuple[tuple[str, str], ...]:
    """Return where a point names a body that the study does not have, and its name."""
    points = named_points(study)
    return tuple((f"{p.where} {p.key}:", p.body) for p in points if p.body is not None and p.body not in study.bodies)


def place_problems(study: Study) -> Iterator[str]:
    """One line per point outside its block, or on blocks that touch without saying which; meshes are checked later."""
    for item in named_points(study):
        known = {name: block for name, block in study.blocks.items() if item.body in (None, name)}
        if not study.meshes and known and not any(_inside(block, item.point, _NEAR) for block in known.values()):
            place = "no block" if item.body is None else f"no part of block {item.body}"
            yield f"{item.where} point lies in {place}; got {list(item.point)} m"
        touching = _touching(study, item)
        if len(touching) > 1 and not item.is_sensor:
            yield (
                f"{item.where} point lies on {' and '.join(touching)}, which move apart; add {item.key} = "
                f'"{touching[0]}" or another; got {list(item.point)} m'
            )


def place_warnings(study: Study) -> Iterator[str]:
    """One line per sensor where blocks touch that does not say which it measures."""
    for item in named_points(study):
        touching = _touching(study, item)
        if len(touching) > 1 and item.is_sensor:
            bodies = " and ".join(touching)
            yield f"{item.where} lies on {bodies} and measures {touching[0]}; add body if another is meant"


def _touching(study: Study, item: NamedPoint) -> list[str]:
    """The blocks on which a point lies that names no body."""
    if item.body is not None:
        return []
    return [name for name, block in study.blocks.items() if _inside(block, item.point, _ON_FACE)]


def _inside(block: BlockSettings, point: tuple[float, float, float], margin: float) -> bool:
    """Whether a point lies in a block, its arch included, or outside by less than a share of its size."""
    low, high = (np.array([block.x[k], block.y[k], block.z[k]]) for k in (0, -1))
    rise = 0.0
    if block.arch is not None and abs(point[0]) < 0.5 * block.arch.span:
        rise = 0.5 * block.arch.rise * (1.0 + np.cos(2.0 * np.pi * point[0] / block.arch.span))
    flat = np.array(point) - [0.0, rise, 0.0]
    return bool(np.all((low - margin * (high - low) <= flat) & (flat <= high + margin * (high - low))))
