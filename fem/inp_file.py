"""Abaqus and CalculiX input files: nodes, elements, sets and surfaces; everything else is skipped."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np

from fem.arrays import IntArray
from fem.element import reference_element
from fem.errors import FemInputError
from fem.mesh_file import MeshFile

_SOLID = {"C3D4": "tet4", "C3D10": "tet10", "C3D8": "hex8", "C3D20": "hex20", "C3D27": "hex27"}
_N_LOCAL = {"tet4": 4, "tet10": 10, "hex8": 8, "hex20": 20, "hex27": 27}
# Corner nodes of the faces S1, S2, ... of the Abaqus manual, section 28.1.4, counted from 0.
TET_FACES = ((0, 1, 2), (0, 3, 1), (1, 3, 2), (2, 3, 0))
HEX_FACES = ((0, 1, 2, 3), (4, 7, 6, 5), (0, 4, 5, 1), (1, 5, 6, 2), (2, 6, 7, 3), (3, 7, 4, 0))
# Number of nodes and of corners of the elements that only mark a surface or a line.
_SURFACE = {"3": (3, 3), "6": (6, 3), "65": (6, 3), "4": (4, 4), "8": (8, 4), "9": (9, 4)}
_SURFACE_FAMILIES = ("CPS", "CPE", "CAX", "STRI", "SFM3D", "M3D", "S")
_LINE = {"T3D2": 2, "T3D3": 3, "B31": 2, "B32": 3}
_GENERATING = ("*NGEN", "*NCOPY", "*NFILL", "*NMAP", "*ELGEN", "*ELCOPY", "*ELMAP")


@dataclass
class _Input:
    """What has been read so far; labels are those of the file."""

    nodes: dict[int, tuple[float, float, float]] = field(default_factory=dict)
    solids: dict[str, dict[int, list[int]]] = field(default_factory=dict)
    facets: dict[int, list[int]] = field(default_factory=dict)
    lines: dict[int, list[int]] = field(default_factory=dict)
    elsets: dict[str, list[int]] = field(default_factory=dict)
    nsets: dict[str, list[int]] = field(default_factory=dict)
    surfaces: dict[str, list[tuple[str, str]]] = field(default_factory=dict)
    node_surfaces: dict[str, list[str]] = field(default_factory=dict)


Options = dict[str, str]


def read_inp(path: Path) -> MeshFile:
    """An Abaqus or CalculiX input file, flat (without *PART and *INSTANCE copies).

    Element sets of solid elements become groups; *SURFACE and sets of shell or membrane elements become surfaces; node
    sets and sets of line elements become node sets.

    Raises
    ------
    FemInputError : lines that are not what their keyword asks for, generated nodes, several instances, missing nodes.
    """
    content = _Input()
    instances = 0
    for keyword, options, lines in _blocks(path):
        if keyword in _GENERATING:
            raise FemInputError("generated nodes and elements are not read", where=path.name, value=keyword)
        instances += keyword == "*INSTANCE"
        if instances > 1 or (keyword == "*INSTANCE" and lines):
            advice = "write the model flat, without parts and instances"
            raise FemInputError("several or moved instances", where=path.name, value=keyword, advice=advice)
        try:
            _take(content, keyword, options, lines)
        except (ValueError, KeyError, IndexError) as error:
            where = f"{path.name}, {keyword} {', '.join(options.values())}".rstrip()
            raise FemInputError("cannot read these lines", where=where, value=str(error)) from error
    return _finished(content, path)


def _blocks(path: Path) -> Iterator[tuple[str, Options, list[list[str]]]]:
    """Keyword, its options, and its data lines split at commas; *INCLUDE is followed."""
    keyword = ""
    options: Options = {}
    data: list[list[str]] = []
    for line in path.read_text(encoding="utf-8", errors="replace").splitlines():
        text = line.strip()
        if not text or text.startswith("**"):
            continue
        if not text.startswith("*"):
            data.append([entry.strip() for entry in text.rstrip(",").split(",")])
            continue
        if keyword:
            yield keyword, options, data
        head, *rest = [entry.strip() for entry in text.split(",")]
        pairs = [entry.partition("=") for entry in rest]
        keyword, options, data = head.upper(), {k.strip().upper(): v.strip().strip('"') for k, _, v in pairs}, []
        if keyword == "*INCLUDE":
            other = path.parent / options.get("INPUT", "")
            if not other.is_file():
                raise FemInputError("no such file to include", where=path.name, value=str(other))
            yield from _blocks(other)
            keyword = ""
    if keyword:
        yield keyword, options, data


def _take(content: _Input, keyword: str, options: Options, lines: list[list[str]]) -> None:
    """Store the data of one keyword."""
    if keyword == "*NODE":
        for label, *x in lines:
            content.nodes[int(label)] = (float(x[0]), float(x[1]), float(x[2]) if len(x) > 2 else 0.0)
        _extend(content.nsets, options.get("NSET"), [int(line[0]) for line in lines])
    elif keyword == "*ELEMENT":
        _take_elements(content, options, lines)
    elif keyword == "*NSET":
        _extend(content.nsets, options["NSET"], _members(lines, content.nsets, "GENERATE" in options))
    elif keyword == "*ELSET":
        _extend(content.elsets, options["ELSET"], _members(lines, content.elsets, "GENERATE" in options))
    elif keyword == "*SURFACE":
        name, kind = options["NAME"], options.get("TYPE", "ELEMENT").upper()
        if kind == "NODE":
            content.node_surfaces.setdefault(name, []).extend(line[0] for line in lines)
        elif kind == "ELEMENT":
            content.surfaces.setdefault(name, []).extend((line[0], [*line, ""][1].upper()) for line in lines)


def _extend(sets: dict[str, list[int]], name: str | None, labels: list[int]) -> None:
    if name:
        sets.setdefault(_spelled(sets, name), []).extend(labels)


def _spelled(sets: dict[str, list[int]], name: str) -> str:
    """The name as it was spelled first: names do not distinguish upper and lower case."""
    return next((known for known in sets if known.upper() == name.upper()), name)


def _members(lines: list[list[str]], sets: dict[str, list[int]], generate: bool) -> list[int]:
    """Labels of a set: numbers, names of other sets, or first, last, increment."""
    found: list[int] = []
    for line in lines:
        if generate:
            first, last, step = (*(int(entry) for entry in line), 1)[:3]
            found.extend(range(first, last + 1, step))
            continue
        for entry in line:
            found.extend([int(entry)] if entry.lstrip("-").isdigit() else sets[_spelled(sets, entry)])
    return found


def _take_elements(content: _Input, options: Options, lines: list[list[str]]) -> None:
    kind = options["TYPE"].upper()
    solid = next((element for name, element in _SOLID.items() if kind in _solid_names(name)), None)
    surface = next((kind[len(f) :].rstrip("RIHT") for f in _SURFACE_FAMILIES if kind.startswith(f)), "")
    if solid is not None:
        n_node, table = _N_LOCAL[solid], content.solids.setdefault(solid, {})
    elif surface in _SURFACE:
        n_node, table = _SURFACE[surface][0], content.facets
    elif kind in _LINE:
        n_node, table = _LINE[kind], content.lines
    elif kind.startswith("C3D"):
        raise ValueError(f"unsupported solid element {kind}; use tetrahedra C3D10 or hexahedra C3D20, C3D27")
    else:
        return
    numbers = [int(entry) for line in lines for entry in line if entry]
    if len(numbers) % (n_node + 1):
        raise ValueError(f"{kind} needs {n_node + 1} numbers per element, got {len(numbers)} in all")
    rows = np.array(numbers, dtype=np.int64).reshape(-1, n_node + 1)
    n_corner = _SURFACE[surface][1] if solid is None and surface in _SURFACE else n_node
    table.update({int(row[0]): row[1 : 1 + n_corner].tolist() for row in rows})
    _extend(content.elsets, options.get("ELSET"), rows[:, 0].tolist())


def _solid_names(name: str) -> set[str]:
    """C3D20 is also C3D20R, C3D20H, C3D20RH, C3D20I, C3D10M and so on: the same nodes."""
    return {name + ending for ending in ("", "R", "H", "RH", "I", "M", "MH", "S", "T", "RT", "HS")}


def _finished(content: _Input, path: Path) -> MeshFile:
    labels = np.array(sorted(content.nodes), dtype=np.int64)
    points = np.array([content.nodes[int(label)] for label in labels]).reshape(-1, 3)

    def rows(wanted: list[int] | IntArray) -> IntArray:
        wanted = np.asarray(wanted, dtype=np.int64)
        place = np.minimum(np.searchsorted(labels, wanted), max(len(labels) - 1, 0))
        missing = wanted[labels[place] != wanted] if len(labels) else wanted.ravel()
        if len(missing):
            raise FemInputError("an element or set names a missing node", where=path.name, value=int(missing[0]))
        return np.asarray(place)

    cells = {element: rows(np.array(list(table.values()))) for element, table in content.solids.items() if table}
    if "hex27" in cells:
        cells["hex27"] = _vtk_hex27(points, cells["hex27"])
    place = {label: (element, row) for element, table in content.solids.items() for row, label in enumerate(table)}
    groups: dict[str, dict[str, IntArray]] = {}
    facets: dict[str, list[IntArray]] = {}
    sets = {name: np.unique(rows(members)) for name, members in content.nsets.items() if members}
    for name, members in content.elsets.items():
        for element in cells:
            chosen = [place[label][1] for label in members if place.get(label, ("", 0))[0] == element]
            if chosen:
                groups.setdefault(name, {})[element] = np.unique(chosen)
        facets[name] = _stacked([rows(content.facets[label]) for label in members if label in content.facets])
        ends = [rows(content.lines[label]) for label in members if label in content.lines]
        if ends:
            sets[name] = np.unique(np.concatenate([sets.get(name, ends[0]), *ends]))
    for name, entries in content.surfaces.items():
        facets[name] = _element_faces(content, cells, place, name, entries)
    for name, members_of in content.node_surfaces.items():
        members = _members([members_of], content.nsets, generate=False)
        sets[name] = np.unique(rows(members))
    return MeshFile(path, points, cells, groups, {n: parts for n, parts in facets.items() if parts}, sets)


def _stacked(facets: list[IntArray]) -> list[IntArray]:
    """Facets by their number of corners."""
    return [np.array([f for f in facets if len(f) == n]) for n in (3, 4) if any(len(f) == n for f in facets)]


def _element_faces(
    content: _Input,
    cells: dict[str, IntArray],
    place: dict[int, tuple[str, int]],
    name: str,
    entries: list[tuple[str, str]],
) -> list[IntArray]:
    """Corner nodes of the faces of a *SURFACE: lines of an element or element set and a face S1, S2, ..."""
    found: list[IntArray] = []
    for members, face in entries:
        labels = [int(members)] if members.isdigit() else content.elsets.get(_spelled(content.elsets, members), [])
        if not labels or not face.startswith("S") or not face[1:].isdigit():
            value = f"{members}, {face}".rstrip(", ")
            advice = "give an element or element set and a face S1 to S6"
            raise FemInputError(
                "cannot read a line of this surface", where=f"*SURFACE {name}", value=value, advice=advice
            )
        for label in labels:
            if label not in place:
                continue
            element, row = place[label]
            table = TET_FACES if element.startswith("tet") else HEX_FACES
            if not 1 <= int(face[1:]) <= len(table):
                raise FemInputError("no such face", where=f"*SURFACE {name}", value=f"{face} of a {element}")
            found.append(cells[element][row, list(table[int(face[1:]) - 1])])
    return _stacked(found)


def _vtk_hex27(points: np.ndarray, cells: IntArray) -> IntArray:
    """The seven nodes of faces and centre in VTK order, found by their place, since programs disagree on theirs."""
    reference = reference_element("hex27")
    corner = points[cells[:, :8]]
    weight = reference_element("hex20").nodes[:8]
    at = reference.nodes[20:]
    shape = np.where(weight[None] > 0.5, at[:, None, :], 1.0 - at[:, None, :]).prod(axis=2)
    expected = np.einsum("na,eai->eni", shape, corner)
    distance = np.linalg.norm(expected[:, :, None] - points[cells[:, 20:]][:, None], axis=3)
    nearest = distance.argmin(axis=2)
    return np.hstack([cells[:, :20], np.take_along_axis(cells[:, 20:], nearest, axis=1)])
