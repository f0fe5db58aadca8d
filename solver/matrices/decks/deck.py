"""The files of a deck, what it says of its nodes (places, sets, axes), and which edges of it are drawn.

Elements by their corner nodes, as CalculiX and Abaqus number them. A face that one element alone has is of
the surface; an edge between two such faces is drawn where they are inclined to each other.
"""

from __future__ import annotations

import math
import re
from collections.abc import Collection, Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from enum import Enum
from pathlib import Path
from typing import Annotated, Any

import numpy as np
from numpy.typing import NDArray

from solver.arrays import Integer, Real
from solver.matrices.readers.numbers_in_text import FormatError, fortran_real

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
    # Unit normals of faces, (n, 3), by the diagonals of a quadrangle; 0 of a face without area.
    fourth = np.where(rows[:, 3] < 0, rows[:, 0], rows[:, 3])
    across = np.cross(points[rows[:, 2]] - points[rows[:, 0]], points[fourth] - points[rows[:, 1]])
    length = np.linalg.norm(across, axis=1, keepdims=True)
    normals = np.asarray(np.divide(across, length, out=np.zeros_like(across), where=length > 0.0))
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


def _bent(which: Integer, normals: Real, count: int) -> NDArray[np.bool_]:
    """Whether each edge has one face, more than two, or two that are inclined; whichever way they look."""
    faces = np.bincount(which, minlength=count)
    order = np.argsort(which, kind="stable")
    first = np.concatenate([[0], np.cumsum(faces)[:-1]])
    second = np.minimum(first + 1, len(which) - 1)
    along = np.abs(np.sum(normals[order[first]] * normals[order[second]], axis=1))
    return np.asarray((faces != 2) | (along < math.cos(_BENT)))


_DEEPEST = 10  # files that include each other
_MOST_MEMBERS = 2_000_000


@dataclass(frozen=True, slots=True)
class DeckFile:
    """A file of a deck."""

    path: Path
    alone: Annotated[bool, "Whether it may not include other files, as a stranger's."] = False
    depth: Annotated[int, "How many files include it."] = 0

    def lines(self) -> Iterator[str]:
        """The lines of the file, one after the other."""
        with self.path.open(encoding="latin-1") as file:
            for line in file:
                yield line.rstrip("\n")

    def other(self, name: str, line: int) -> DeckFile:
        """The file that a line includes.

        Raises
        ------
        FormatError
            It may not, or files include each other.
        """
        if self.alone:
            raise FormatError(
                f"line {line} includes another file, which is not read here: put the nodes and sets into one "
                "deck"
            )
        if self.depth == _DEEPEST:
            raise FormatError(f"{self.path.name!r} includes {name!r} too deeply")
        return DeckFile(self.path.parent / name, self.alone, self.depth + 1)


class Members:
    """Counts the members of all sets of a deck: a line can name ranges, and sets that name sets."""

    def __init__(self) -> None:
        self._count = 0

    def add(self, members: list[int], more: Sequence[int]) -> None:
        """Add to a set.

        Raises
        ------
        FormatError
            The sets then have more members than those of any deck.
        """
        self._count += len(more)
        if self._count > _MOST_MEMBERS:
            raise FormatError(f"the sets have more than {_MOST_MEMBERS} members together")
        members += more


def real(text: str) -> float:
    """A number as `fortran_real` reads it, nothing being 0."""
    return fortran_real(text) if text.strip() else 0.0


@dataclass(frozen=True, slots=True)
class Deck:
    """What a deck says of its nodes."""

    nodes: Annotated[
        dict[int, tuple[float, float, float]], "Position of each node, in the units of the deck."
    ] = field(default_factory=dict)
    sets: Annotated[dict[str, list[int]], "Nodes of each set, by its name in capitals."] = field(
        default_factory=dict
    )
    elements: Annotated[
        list[tuple[ElementShape, Integer]], "If they were asked for: those of ``*ELEMENT`` that can be drawn."
    ] = field(default_factory=list)
    systems: Annotated[
        dict[int, CoordinateSystem],
        "Coordinate system along whose axes a node moves, where it is not the global one.",
    ] = field(default_factory=dict)


def positions(deck: Deck, nodes: Sequence[int]) -> Real:
    """Positions of nodes, (n, 3).

    Raises
    ------
    ValueError
        The deck does not have one of them.
    """
    missing = [node for node in nodes if node not in deck.nodes]
    if missing:
        raise ValueError(f"node {missing[0]} is not in the deck, which has {len(deck.nodes)} nodes")
    return np.array([deck.nodes[node] for node in nodes], dtype=np.float64).reshape(-1, 3)


def frames(deck: Deck, nodes: Sequence[int]) -> Real:
    """The axes of nodes as columns, (n, 3, 3).

    Raises
    ------
    ValueError
        A node on the axis of its cylindrical or spherical system, where the axes are not known.
    """
    found = np.broadcast_to(np.eye(3), (len(nodes), 3, 3)).copy()
    of: dict[int, list[int]] = {}
    for i, node in enumerate(nodes):
        if node in deck.systems:
            of.setdefault(id(deck.systems[node]), []).append(i)
    for rows in of.values():
        own = [nodes[i] for i in rows]
        system = deck.systems[own[0]]
        found[rows] = system.frames(positions(deck, own))
        bad = np.flatnonzero(np.isnan(found[rows]).any(axis=(1, 2)))
        if bad.size:
            raise ValueError(
                f"node {own[bad[0]]} moves along the axes of a {system.kind.value} system and lies on its "
                "axis, where they have no direction: give it another system before the export"
            )
    return found


Vector = Sequence[float] | NDArray[Any]
_NONE = 1e-9  # share of a length that counts as none


class CoordinateKind(Enum):
    """How three numbers tell a place."""

    RECTANGULAR = "rectangular"  # x, y, z
    CYLINDRICAL = "cylindrical"  # r, θ from x [degrees], z
    SPHERICAL = "spherical"  # r, θ from z [degrees], φ from x [degrees]


@dataclass(frozen=True, slots=True, eq=False)
class CoordinateSystem:
    """A coordinate system."""

    kind: CoordinateKind
    origin: Annotated[Real, "In the global system, (3,)."]
    axes: Annotated[Real, "Directions of x, y and z as columns, orthonormal and right-handed, (3, 3)."]

    def places(self, given: Real) -> Real:
        """Places (n, 3) in the global system of the numbers (n, 3) that tell them in this one."""
        local = given
        if self.kind is CoordinateKind.CYLINDRICAL:
            r, angle = given[:, 0], np.radians(given[:, 1])
            local = np.stack([r * np.cos(angle), r * np.sin(angle), given[:, 2]], axis=1)
        elif self.kind is CoordinateKind.SPHERICAL:
            r, polar, angle = given[:, 0], np.radians(given[:, 1]), np.radians(given[:, 2])
            across = r * np.sin(polar)
            local = np.stack([across * np.cos(angle), across * np.sin(angle), r * np.cos(polar)], axis=1)
        return np.asarray(self.origin + local @ self.axes.T)

    def frames(self, places: Real) -> Real:
        """The axes of nodes at global places (n, 3) as columns, (n, 3, 3); NaN where they are not known.

        On the axis of a cylinder, and of a sphere, a radius has no direction.
        """
        if self.kind is CoordinateKind.RECTANGULAR:
            return np.broadcast_to(self.axes, (len(places), 3, 3)).copy()
        local = (places - self.origin) @ self.axes
        across = np.hypot(local[:, 0], local[:, 1])
        size = np.linalg.norm(local, axis=1) + float(np.linalg.norm(self.origin))
        with np.errstate(invalid="ignore", divide="ignore"):
            c, s = np.where(across > _NONE * size, local[:, :2].T / across, np.nan)
        zero, one = np.zeros_like(c), np.ones_like(c)
        about = [-s, c, zero]
        if self.kind is CoordinateKind.CYLINDRICAL:
            columns = [[c, s, zero], about, [zero, zero, one]]
        else:
            radius = np.linalg.norm(local, axis=1)
            sin, cos = across / np.maximum(radius, 1e-300), local[:, 2] / np.maximum(radius, 1e-300)
            columns = [[sin * c, sin * s, cos], [cos * c, cos * s, -sin], about]
        return np.asarray(self.axes @ np.array(columns).transpose(2, 1, 0))

    def moved(self, turn: Real, shift: Real) -> CoordinateSystem:
        """The system after a rotation (3, 3) of the whole space about the origin and then a shift (3,)."""
        return CoordinateSystem(self.kind, turn @ self.origin + shift, turn @ self.axes)


GLOBAL = CoordinateSystem(CoordinateKind.RECTANGULAR, np.zeros(3), np.eye(3))


def axes_by(first: int, along: Vector, second: int, beside: Vector) -> Real:
    """Axes (3, 3) of which one lies along a vector, and another on the side of a second vector.

    Parameters
    ----------
    first, second : which of the axes 0, 1, 2.
    along : the direction of the first.
    beside : a vector in the plane of both, on the positive side of the second.

    Raises
    ------
    ValueError
        The vectors are none, or parallel.
    """
    one, other = np.asarray(along, dtype=np.float64), np.asarray(beside, dtype=np.float64)
    size = float(np.linalg.norm(one))
    if not 0.0 < size < math.inf:
        raise ValueError("two of its points are the same")
    one = one / size
    left = other - (other @ one) * one
    if not float(np.linalg.norm(left)) > _NONE * float(np.linalg.norm(other)):
        raise ValueError("its points lie on one line")
    axes = np.zeros((3, 3))
    axes[:, first], axes[:, second] = one, left / np.linalg.norm(left)
    third = 3 - first - second
    axes[:, third] = np.cross(axes[:, (third + 1) % 3], axes[:, (third + 2) % 3])
    return axes


def around(axis: Vector) -> Real:
    """Axes (3, 3) with z along a vector, x and y anywhere: of a cylinder whose angles nobody asks for."""
    z = np.asarray(axis, dtype=np.float64)
    return axes_by(2, z, 0, np.eye(3)[int(np.argmin(np.abs(z)))])


def rotation(axis: Vector, angle: float) -> Real:
    """The rotation by an angle [rad] about an axis through the origin, (3, 3) (Rodrigues)."""
    k = np.asarray(axis, dtype=np.float64)
    k = k / np.linalg.norm(k)
    cross = np.array([[0.0, -k[2], k[1]], [k[2], 0.0, -k[0]], [-k[1], k[0], 0.0]])
    return np.asarray(np.eye(3) + math.sin(angle) * cross + (1.0 - math.cos(angle)) * (cross @ cross))


def ansys_axes(xy: float, yz: float, zx: float) -> Real:
    """Axes (3, 3) turned by Ansys' angles [degrees]: about z, then about the new x, then about the new y."""
    z, x, y = (
        rotation(axis, math.radians(angle))
        for axis, angle in (((0, 0, 1), xy), ((1, 0, 0), yz), ((0, 1, 0), zx))
    )
    return np.asarray(z @ x @ y)
