"""The edges of a mesh that are worth drawing: where its surface ends, or is bent.

Elements by their corner nodes, as CalculiX and Abaqus number them. A face that one element alone has is of
the surface; an edge between two such faces is drawn where they are inclined to each other.
"""

from __future__ import annotations

import math
import re
from collections.abc import Collection, Mapping, Sequence
from dataclasses import dataclass
from typing import Annotated

import numpy as np
from numpy.typing import NDArray

from solver.arrays import Integer, Real
from solver.matrices.readers.numbers_in_text import FormatError

# C3D20R, C3D10MH; S4, S8R, S4R5.
_KIND = re.compile(r"C3D(?P<solid>[0-9]+)[A-Z]*|S(?P<shell>[0-9])(R|RS|RSW|R5|T|RT)?")
_BENT = math.radians(25.0)  # between the normals of two faces


@dataclass(frozen=True, slots=True)
class ElementShape:
    """A kind of element: how many nodes it has, and the faces between its corners."""

    nodes: Annotated[int, "Of the element, those on its edges too."]
    faces: Annotated[tuple[tuple[int, ...], ...], "Corners of each face in turn, three or four."]


_TETRAHEDRON = ((0, 1, 2), (0, 3, 1), (1, 3, 2), (2, 3, 0))
_WEDGE = ((0, 1, 2), (3, 5, 4), (0, 3, 4, 1), (1, 4, 5, 2), (2, 5, 3, 0))
_BRICK = ((0, 1, 2, 3), (4, 7, 6, 5), (0, 4, 5, 1), (1, 5, 6, 2), (2, 6, 7, 3), (3, 7, 4, 0))
_TRIANGLE, _QUADRANGLE = ((0, 1, 2),), ((0, 1, 2, 3),)
_SOLIDS = {4: _TETRAHEDRON, 10: _TETRAHEDRON, 6: _WEDGE, 15: _WEDGE, 8: _BRICK, 20: _BRICK}
_SHELLS = {3: _TRIANGLE, 6: _TRIANGLE, 4: _QUADRANGLE, 8: _QUADRANGLE}


def shape_of(kind: str) -> ElementShape | None:
    """The shape of a type of element such as C3D20R or S4; None for one that is not drawn."""
    found = _KIND.fullmatch(kind.strip().upper())
    if found is None:
        return None
    known = _SOLIDS if found["solid"] else _SHELLS
    count = int(found["solid"] or found["shell"])
    return ElementShape(count, known[count]) if count in known else None


def elements_of(shape: ElementShape, numbers: Sequence[int], line: int) -> Integer:
    """The nodes of elements, (n, nodes), of numbers as a deck lists them: each behind that of its element.

    Raises
    ------
    FormatError
        They do not come out even.
    """
    width = shape.nodes + 1
    if len(numbers) % width:
        raise FormatError(f"the elements behind line {line} must have {shape.nodes} nodes each")
    return np.array(numbers, np.int64).reshape(-1, width)[:, 1:]


def drawn_edges(
    blocks: Sequence[tuple[ElementShape, Integer]], places: Mapping[int, tuple[float, float, float]]
) -> Integer:
    """The edges to be drawn, (n, 2) nodes: where the surface of a mesh ends or is bent.

    Raises
    ------
    ValueError
        An element has a node without a place.
    """
    faces = _surface(blocks)
    if not faces.size:
        return np.zeros((0, 2), np.int64)
    known = np.unique(faces[faces >= 0])
    missing = [int(node) for node in known if int(node) not in places]
    if missing:
        raise ValueError(f"an element has the node {missing[0]}, which has no place in the deck")
    points = np.array([places[int(node)] for node in known])
    rows = np.where(faces >= 0, np.searchsorted(known, faces), -1)
    normals = _normals(points, rows)
    pairs, owners = [], []
    for i in range(4):
        ahead = np.where((i == 3) | (rows[:, (i + 1) % 4] < 0), rows[:, 0], rows[:, (i + 1) % 4])
        some = rows[:, i] >= 0
        pairs.append(np.sort(np.stack([rows[some, i], ahead[some]], axis=1), axis=1))
        owners.append(np.flatnonzero(some))
    edges, which = np.unique(np.concatenate(pairs), axis=0, return_inverse=True)
    drawn = _bent(which.ravel(), normals[np.concatenate(owners)], len(edges))
    return np.asarray(known[edges[drawn]], np.int64)


def faces_of(blocks: Sequence[tuple[ElementShape, Integer]], nodes: Collection[int]) -> list[list[int]]:
    """The corners of each face of the surface that lies between these nodes; of shells, all their faces."""
    faces = _surface(blocks)
    inside = faces[(np.isin(faces, list(nodes)) | (faces < 0)).all(axis=1)]
    return [[int(node) for node in face if node >= 0] for face in inside]


def _surface(blocks: Sequence[tuple[ElementShape, Integer]]) -> Integer:
    """The faces that one element alone has, (n, 4) nodes, the fourth -1 of a triangle."""
    found = []
    for shape, elements in blocks:
        for face in shape.faces:
            wide = np.full((len(elements), 4), -1, np.int64)
            wide[:, : len(face)] = elements[:, list(face)]
            found.append(wide)
    if not found:
        return np.zeros((0, 4), np.int64)
    faces = np.concatenate(found)
    _, first, count = np.unique(np.sort(faces, axis=1), axis=0, return_index=True, return_counts=True)
    return np.asarray(faces[first[count == 1]], np.int64)


def _normals(points: Real, rows: Integer) -> Real:
    """Unit normals of faces, (n, 3), by the diagonals of a quadrangle; 0 of a face without area."""
    fourth = np.where(rows[:, 3] < 0, rows[:, 0], rows[:, 3])
    across = np.cross(points[rows[:, 2]] - points[rows[:, 0]], points[fourth] - points[rows[:, 1]])
    length = np.linalg.norm(across, axis=1, keepdims=True)
    return np.asarray(np.divide(across, length, out=np.zeros_like(across), where=length > 0.0))


def _bent(which: Integer, normals: Real, count: int) -> NDArray[np.bool_]:
    """Whether each edge has one face, more than two, or two that are inclined; whichever way they look."""
    faces = np.bincount(which, minlength=count)
    order = np.argsort(which, kind="stable")
    first = np.concatenate([[0], np.cumsum(faces)[:-1]])
    second = np.minimum(first + 1, len(which) - 1)
    along = np.abs(np.sum(normals[order[first]] * normals[order[second]], axis=1))
    return np.asarray((faces != 2) | (along < math.cos(_BENT)))
