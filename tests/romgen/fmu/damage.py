"""Damaged model descriptions for the tests of what reads units of others."""

from __future__ import annotations

import copy
from xml.etree.ElementTree import Element

import numpy as np

ODD = ("", "x", "-1", "1e999", "nan", "99999999999", "1 2", "ä", "true")


def damaged(root: Element, rng: np.random.Generator) -> Element:
    """A copy with one to three elements dropped, doubled or stripped, or attributes removed or given odd values."""
    root = copy.deepcopy(root)
    for _ in range(int(rng.integers(1, 4))):
        parents = [e for e in root.iter() if len(e)]
        parent = parents[int(rng.integers(len(parents)))]
        child = parent[int(rng.integers(len(parent)))]
        kind = int(rng.integers(5))
        if kind == 0:
            parent.remove(child)
        elif kind == 1:
            parent.append(copy.deepcopy(child))
        elif kind == 2:
            child[:] = []
        elif child.attrib:
            key = sorted(child.attrib)[int(rng.integers(len(child.attrib)))]
            if kind == 3:
                del child.attrib[key]
            else:
                child.set(key, ODD[int(rng.integers(len(ODD)))])
    return root
