"""Faces whose meshes do not match: each node of one moves against a weighted sum of nodes of the other.

The faces are laid on each other along the normal. With the shape functions N of the second face and functions
ψ dual to those of the first, ∫ψ_i N_j = δ_ij ∫N_i, integrated over every overlap of two facets, node i of the
first face has the area D_i = ∫N_i and touches the second at Σ_k w_ik x_k, w_ik = ∫ψ_i N_k / D_i (B. I.
Wohlmuth, SIAM J. Numer. Anal. 38 (2000) 989, doi:10.1137/S0036142999350929; dual functions of facets that are
covered in part as A. Popp, A. Seitz, M. W. Gee, W. A. Wall, Comput. Methods Appl. Mech. Eng. 264 (2013) 67).
As Σψ = 1 the weights of a node sum to 1, and a pressure that is even presses every node of the second face by
its own ∫N_k: it is transmitted without error. Motions linear over a plane face do not open it.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Sequence
from dataclasses import dataclass
from functools import lru_cache
from typing import Annotated

import numpy as np
from numpy.typing import NDArray
from scipy.spatial import Delaunay, QhullError, cKDTree

from solver.arrays import Integer, Real
from solver.matrices.decks.deck import Deck, faces_of, positions

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


_LEAST = 1e-6  # share of a facet below which what covers it is rounding: decks have some six digits
_SMALL = 1e-12  # of the largest weight
_STEPS = 30  # of Newton's method for a place in a quadrangle

_EXACT = 3  # points of Gauss along a line
_FINE = 9  # where the shape functions are no polynomials: on distorted quadrangles
_DISTORTED = 1e-9  # of its size, how far a quadrangle is from a parallelogram


@dataclass(frozen=True, slots=True, kw_only=True)
class MortarPair:
    """What the nodes of a face touch of another whose mesh does not match."""

    nodes: Annotated[list[int], "Nodes of the first face that the second lies over."]
    weights: Annotated[list[dict[int, float]], "Of each: nodes of the second face, the weights sum to 1."]
    places: Annotated[Real, "Their positions, in the units of the deck, (n, 3)."]
    areas: Annotated[Real, "Area that belongs to each, seen along the normal; of lines lengths, (n,)."]
    gaps: Annotated[Real, "Distance to the second face along the normal, below 0 where they overlap, (n,)."]


def mortar(
    deck: Deck, first: Sequence[int], second: Sequence[int], normal: Sequence[float],
    turn: Real | None = None,
) -> MortarPair:  # fmt: skip
    """Join two faces of any meshes along a normal.

    Facets are those of the elements of the deck, of first order, if it has any; else the nodes are joined by
    triangles, or in turn where they lie along a line. Where a face is no convex area that needs elements.

    Parameters
    ----------
    deck : with the positions.
    first, second : nodes of the faces.
    normal : direction from the first face to the second; of any length.
    turn : (3, 3) rotation that brings the second face to where it touches; or None.

    Raises
    ------
    ValueError
        Nodes that are not in the deck, twice in a face, or inside the edges of elements of second order, a
        normal of no length, a single node, a line on an area, or faces that do not lie over each other.
    """
    along = np.asarray(normal, dtype=np.float64)
    if along.shape != (3,) or not 0.0 < np.linalg.norm(along) < np.inf:
        raise ValueError(f"the normal must be three numbers, not all 0, got {list(normal)}")
    along = along / np.linalg.norm(along)
    here, there = (positions(deck, checked_nodes(nodes)) for nodes in (first, second))
    there = there if turn is None else there @ turn.T
    axes = np.linalg.svd(along[None, :])[2][1:]
    if min(len(here), len(there)) < 2:
        raise ValueError("a face of a single node has no area to join: pair the nodes, or give a larger set")
    lines = is_line(here @ axes.T)
    if lines != is_line(there @ axes.T):
        raise ValueError("of two faces either both lie along a line, as in a plane, or neither")
    if lines:
        axes = axes.T @ np.linalg.svd((here - here.mean(axis=0)) @ axes.T)[2][0]
        axes = axes[None, :]
    flat = [points @ axes.T for points in (here, there)]
    facets = [_facets(deck, nodes, places) for nodes, places in zip((first, second), flat, strict=True)]
    D, M = _integrals(flat, facets, lines=lines)
    kept = np.flatnonzero(D > 0.0)
    if not kept.size:
        raise ValueError("the faces do not lie over each other along the normal: look at its direction")
    W = M[kept] / D[kept, None]
    return MortarPair(
        nodes=[first[int(i)] for i in kept], places=here[kept], areas=D[kept],
        weights=[{second[int(k)]: float(row[k]) for k in _seen(row)} for row in W],
        gaps=(W @ there - here[kept]) @ along,
    )  # fmt: skip


def _seen(row: Real) -> Integer:
    return np.flatnonzero(np.abs(row) > _SMALL * np.abs(row).max())


def _facets(deck: Deck, nodes: Sequence[int], flat: Real) -> list[Integer]:
    """The facets of a face as rows of its nodes, two, three or four each."""
    if flat.shape[1] == 1:
        order = np.argsort(flat[:, 0])
        return [order[i : i + 2] for i in range(order.size - 1)]
    if not deck.elements:
        return list(np.asarray(Delaunay(flat).simplices, np.int64))
    row = {node: i for i, node in enumerate(nodes)}
    found = [np.array([row[node] for node in each]) for each in faces_of(deck.elements, row)]
    alone = set(range(len(nodes))) - {int(i) for each in found for i in each}
    if alone:
        raise ValueError(
            f"node {nodes[min(alone)]} is no corner of a face of elements between nodes of its set: give a "
            "set of whole faces of elements of first order, or a deck without elements"
        )
    return found


def _integrals(
    flat: Sequence[Real], facets: Sequence[Sequence[Integer]], *, lines: bool
) -> tuple[Real, Real]:
    """∫N_i over the first face where the second lies over it, and ∫ψ_i N_k."""
    D, M = np.zeros(len(flat[0])), np.zeros((len(flat[0]), len(flat[1])))
    boxes = [
        np.array([(points[each].min(axis=0), points[each].max(axis=0)) for each in own])
        for points, own in zip(flat, facets, strict=True)
    ]
    for each, box in zip(facets[0], boxes[0], strict=True):
        corners = flat[0][each]
        near = np.flatnonzero(((boxes[1][:, 0] < box[1]) & (boxes[1][:, 1] > box[0])).all(axis=1))
        parts = []
        for other in (facets[1][int(m)] for m in near):
            points, shares = _overlap(corners, flat[1][other], lines=lines)
            if shares.size:
                parts.append((other, _shapes(corners, points), _shapes(flat[1][other], points), shares))
        covered = sum(float(shares.sum()) for *_, shares in parts)
        if covered <= _LEAST * _size(corners):
            continue
        mass = sum((own.T * shares) @ own for _, own, _, shares in parts)
        whole = np.sum(mass, axis=1)
        dual = whole[:, None] * np.linalg.inv(mass)
        D[each] += whole
        for other, own, theirs, shares in parts:
            M[np.ix_(each, other)] += dual @ ((own.T * shares) @ theirs)
    return D, M


def _size(corners: Real) -> float:
    """Length of a line, or area of a polygon."""
    if corners.shape[1] == 1:
        return float(np.ptp(corners))
    x, y = corners.T
    return 0.5 * abs(float(x @ np.roll(y, -1) - y @ np.roll(x, -1)))


@lru_cache(maxsize=4)
def _gauss(count: int) -> tuple[Real, Real, Real, Real]:
    """Points on a unit line with weights, and barycentric ones on a triangle with weights, of the product."""
    points, weights = np.polynomial.legendre.leggauss(count)
    x, w = 0.5 + 0.5 * points, 0.5 * weights
    across, along = (each.ravel() for each in np.meshgrid(x, x))
    inside = np.stack([1.0 - along, along * (1.0 - across), along * across], axis=1)
    return x, w, inside, 2.0 * along * np.outer(w, w).ravel()


def _overlap(one: Real, other: Real, *, lines: bool) -> tuple[Real, Real]:
    """Points of integration (q, d) in what two facets have in common, and their weights (q,)."""
    plain = not any(_is_distorted(each) for each in (one, other))
    points, weights, inside, shares = _gauss(_EXACT if plain else _FINE)
    if lines:
        low, high = max(one.min(), other.min()), min(one.max(), other.max())
        if high <= low:
            return np.zeros((0, 1)), np.zeros(0)
        return (low + (high - low) * points)[:, None], (high - low) * weights
    cut = _clipped(one, other)
    if len(cut) < 3:
        return np.zeros((0, 2)), np.zeros(0)
    fan = np.array([(cut[0], cut[i], cut[i + 1]) for i in range(1, len(cut) - 1)])
    areas = np.array([_size(each) for each in fan])
    return np.einsum("qb,tbd->tqd", inside, fan).reshape(-1, 2), np.outer(areas, shares).ravel()


def _is_distorted(corners: Real) -> bool:
    """Whether it is a quadrangle and no parallelogram."""
    apart = corners[0] - corners[1] + corners[2] - corners[3] if len(corners) == 4 else np.zeros(1)
    return bool(np.abs(apart).max() > _DISTORTED * np.ptp(corners))


def _clipped(one: Real, other: Real) -> list[Real]:
    """The corners of what two convex polygons have in common (I. Sutherland, G. W. Hodgman, 1974)."""
    x, y = other.T
    ends = other if x @ np.roll(y, -1) > y @ np.roll(x, -1) else other[::-1]
    found = list(one)
    for a, b in zip(ends, np.roll(ends, -1, axis=0), strict=True):
        side = [(b[0] - a[0]) * (p[1] - a[1]) - (b[1] - a[1]) * (p[0] - a[0]) for p in found]
        kept: list[Real] = []
        for i, (point, inside) in enumerate(zip(found, side, strict=True)):
            before, was = found[i - 1], side[i - 1]
            if inside * was < 0.0:
                kept.append(before + was / (was - inside) * (point - before))
            if inside >= 0.0:
                kept.append(point)
        found = kept
    return found


def _shapes(corners: Real, points: Real) -> Real:
    """The shape functions of a facet at points on it, (q, corners)."""
    if len(corners) == 2:
        s = (points[:, 0] - corners[0, 0]) / (corners[1, 0] - corners[0, 0])
        return np.stack([1.0 - s, s], axis=1)
    if len(corners) == 3:
        edges = (corners[1:] - corners[0]).T
        s, t = np.linalg.solve(edges, (points - corners[0]).T)
        return np.stack([1.0 - s - t, s, t], axis=1)
    return _bilinear(corners, points)


def _bilinear(corners: Real, points: Real) -> Real:
    """Those of a quadrangle, whose places are found by Newton's method."""
    a = corners[0]
    b, c = corners[1] - a, corners[3] - a
    d = corners[2] - corners[1] - corners[3] + a
    s = np.full((len(points), 2), 0.5)
    for _ in range(_STEPS):
        left = a + s[:, :1] * b + s[:, 1:] * c + s[:, :1] * s[:, 1:] * d - points
        slope = np.stack([b + s[:, 1:] * d, c + s[:, :1] * d], axis=2)
        step = np.linalg.solve(slope, left[:, :, None])[:, :, 0]
        s = s - step
        if np.abs(step).max() < 1e-14:
            break
    x, y = s.T
    return np.stack([(1.0 - x) * (1.0 - y), x * (1.0 - y), x * y, (1.0 - x) * y], axis=1)
