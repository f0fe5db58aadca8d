"""Faces of finite-element meshes that lie on each other: which node touches which, and for how much area."""

from __future__ import annotations

from collections import Counter
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Annotated

import numpy as np
from numpy.typing import NDArray
from scipy.spatial import Delaunay, QhullError, cKDTree

from solver.matrices.decks.deck import Deck, positions

_NEAR = 0.01  # share of the least distance of two nodes of a face within which nodes are one place
_FLAT = 1e-3  # a face thinner than this share of its length is a line
_FEW = 5


@dataclass(frozen=True, slots=True, kw_only=True)
class Face:
    """A face and what it lies on."""

    pairs: Annotated[
        list[tuple[int, int | None]], "Node of the first face and that of the second; None: the ground."
    ]
    places: Annotated[NDArray[np.float64], "Positions of the first face, in the units of the deck, (n, 3)."]
    areas: Annotated[
        NDArray[np.float64],
        "Area that belongs to each node, in those units squared, (n,); of a face that is a line, lengths.",
    ]
    plane: Annotated[
        NDArray[np.float64] | None,
        "Unit normal of the plane that fits best, of either sign, (3,); None of a line or a single node.",
    ]


def face(
    deck: Deck, first: Sequence[int], second: Sequence[int] | None, turn: NDArray[np.float64] | None = None,
    tolerance: float | None = None,
) -> Face:  # fmt: skip
    """Pair the nodes of two faces by their positions.

    Parameters
    ----------
    deck : with the positions.
    first : nodes of the first face.
    second : those of the second, or None for the ground.
    turn : (3, 3) rotation that brings the second face to where it touches, as of the next sector; or None.
    tolerance : distance within which nodes touch, in the units of the deck; a hundredth of the least distance
        of two nodes if left out.

    Raises
    ------
    ValueError
        Nodes that are not in the deck, twice in a face, or touch none of the other face, each named.
    """
    here = positions(deck, checked_nodes(first))
    areas, plane = _areas(here)
    if second is None:
        return Face(pairs=[(node, None) for node in first], places=here, areas=areas, plane=plane)
    there = positions(deck, checked_nodes(second))
    if turn is not None:
        there = there @ turn.T
    near = tolerance if tolerance is not None else _tolerance(here, there)
    distance, place = cKDTree(there).query(here)
    alone = [node for node, d in zip(first, distance, strict=True) if d > near]
    touched = {second[i] for i, d in zip(place, distance, strict=True) if d <= near}
    left = [node for node in second if node not in touched]
    if alone or left or len(touched) < len(here):
        raise ValueError(_unmatched(alone, left, distance, near))
    pairs: list[tuple[int, int | None]] = list(zip(first, (second[i] for i in place), strict=True))
    return Face(pairs=pairs, places=here, areas=areas, plane=plane)


def checked_nodes(nodes: Sequence[int]) -> list[int]:
    """The nodes of a face.

    Raises
    ------
    ValueError
        There are none, or one is there twice.
    """
    twice = [node for node, times in Counter(nodes).items() if times > 1]
    if twice:
        raise ValueError(f"node {twice[0]} is twice in a face")
    if not nodes:
        raise ValueError("a face has no nodes")
    return list(nodes)


def is_line(points: NDArray[np.float64]) -> bool:
    """Whether points lie along a line."""
    spans = np.linalg.svd(points - points.mean(axis=0), compute_uv=False)
    return len(points) == 2 or len(spans) < 2 or bool(spans[1] <= _FLAT * spans[0])


def _tolerance(here: NDArray[np.float64], there: NDArray[np.float64]) -> float:
    faces = [points for points in (here, there) if len(points) > 1]
    spans = [float(cKDTree(points).query(points, k=2)[0][:, 1].min()) for points in faces]
    return _NEAR * min(spans, default=float(np.linalg.norm(here)) or 1.0)


def _unmatched(alone: list[int], left: list[int], distance: NDArray[np.float64], near: float) -> str:
    nodes = ", ".join(map(str, [*alone, *left][:_FEW])) + (", …" if len(alone) + len(left) > _FEW else "")
    return (
        f"{len(alone) + len(left)} nodes touch none of the other face ({nodes}): the nearest lie up to "
        f"{float(distance.max()):.3g} apart, {near:.3g} counts as one place; the meshes must have nodes at "
        "the same places, or give a larger tolerance"
    )


def _areas(points: NDArray[np.float64]) -> tuple[NDArray[np.float64], NDArray[np.float64] | None]:
    """The area nearest to each node and the normal of the plane that fits best."""
    if len(points) == 1:
        return np.ones(1), None
    centred = points - points.mean(axis=0)
    axes = np.linalg.svd(centred, full_matrices=False)[2]
    flat = centred @ axes[:2].T if len(axes) > 1 else centred @ axes[:1].T
    if is_line(points):
        return _lengths(flat[:, 0]), None
    try:
        corners = Delaunay(flat).simplices
    except QhullError as error:  # cannot happen to points that are no line
        raise ValueError(f"the face cannot be meshed: {error}") from error
    areas = np.zeros(len(points))
    np.add.at(areas, corners, _cells(points[corners]))
    return areas, axes[2] if len(axes) > 2 else np.cross(axes[0], axes[1])


def _cells(corners: NDArray[np.float64]) -> NDArray[np.float64]:
    """The part of each triangle that belongs to each corner, (t, 3), of corners (t, 3, 3).

    It is what lies nearest to the corner; of a triangle with an obtuse angle half belongs to that corner, a
    quarter to each other (Meyer, Desbrun, Schröder, Barr 2003, Discrete differential-geometry operators).
    """
    edges = np.roll(corners, -1, axis=1) - np.roll(corners, 1, axis=1)  # edge i lies opposite corner i
    squares = (edges**2).sum(axis=2)
    double = np.linalg.norm(np.cross(edges[:, 0], edges[:, 1]), axis=1)
    # Twice the area times the cotangent of the angle at each corner is the product of its two edges.
    cosines = -(np.roll(edges, -1, axis=1) * np.roll(edges, 1, axis=1)).sum(axis=2)
    beside = squares * cosines
    parts = (np.roll(beside, -1, axis=1) + np.roll(beside, 1, axis=1)) / (8.0 * double)[:, None]
    obtuse = cosines < 0.0
    halves = 0.125 * double[:, None] * np.where(obtuse, 2.0, 1.0)
    found: NDArray[np.float64] = np.where(obtuse.any(axis=1)[:, None], halves, parts)
    return found


def _lengths(along: NDArray[np.float64]) -> NDArray[np.float64]:
    """Half the distance to either neighbour on a line."""
    order = np.argsort(along)
    gaps = np.diff(along[order])
    lengths = np.empty(len(along))
    lengths[order] = 0.5 * (np.append(gaps, 0.0) + np.append(0.0, gaps))
    return lengths
