"""Which node of the high boundary is which of the low one, and their rows."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from solver.matrices.decks.deck import Deck, frames, positions
from solver.matrices.labels import COMPONENTS, OWN_COMPONENTS, Label
from solver.matrices.sectors.elimination import Group, rotation

if TYPE_CHECKING:
    from solver.matrices.load_set import MatrixSet

Pairs = list[tuple[int, int]]
PAIR_BY = ("position", "order")
NEAR = 0.01  # share of the least distance of two nodes within which they are one place
_FEW = 10
_SAME = 1e-4  # between frames, the sine of an angle that comes of rounded places


def paired(
    deck: Deck | None,
    low: Sequence[int] | None,
    high: Sequence[int] | None,
    axis: Sequence[float],
    sectors: int,
    *,
    pair_by: str = "position",
    tolerance: float | None = None,
) -> Pairs:
    """Pairs of nodes (low, high): the high one lies where the low one comes when turned by the pitch.

    Parameters
    ----------
    deck : with the positions; needed unless nodes are paired by their order.
    low, high : nodes of the boundaries; both None: found among all nodes of the deck by their positions.
    tolerance : distance within which two nodes are one place, in the units of the deck.

    Raises
    ------
    ValueError
        Nodes without a partner, each named; or boundaries that look exchanged.
    """
    if pair_by == "order":
        if low is None or high is None or len(low) != len(high):
            count = "none" if low is None or high is None else f"{len(low)} and {len(high)}"
            raise ValueError(f"`pair_by` = 'order' needs as many nodes in `low` as in `high`, got {count}")
        return list(zip(low, high, strict=True))
    if deck is None:
        raise ValueError("`nodes` is missing: the deck with the positions of the nodes, to pair them by")
    from scipy.spatial import cKDTree

    every = sorted(deck.nodes)
    ours, theirs = list(low) if low else every, list(high) if high else every
    here, there = positions(deck, ours), positions(deck, theirs)
    near = _near(here if low else there) if tolerance is None else tolerance
    turned = here @ rotation(axis, 2.0 * math.pi / sectors).T
    distance, place = cKDTree(there).query(turned)
    found = [(node, theirs[i]) for node, i, d in zip(ours, place, distance, strict=True) if d <= near]
    if low is None or high is None:
        pairs = [(one, other) for one, other in found if one != other]
        _check_found(pairs, sectors)
        return pairs
    _check_all(found, ours, theirs, here, there, near, (axis, sectors))
    return found


def _near(points: NDArray[np.float64]) -> float:
    """The tolerance, of the least distance between two of some points."""
    from scipy.spatial import cKDTree

    if len(points) < 2:
        return NEAR * float(np.linalg.norm(points, axis=1).max(initial=1.0))
    return NEAR * float(cKDTree(points).query(points, k=2)[0][:, 1].min())


def _check_found(pairs: Pairs, sectors: int) -> None:
    if not pairs:
        raise ValueError(
            f"no node lies where another one comes by a turn of 1/{sectors}: name the boundaries with `low` "
            "and `high`, check `axis` and `sectors`, or give a `tolerance`"
        )
    both = {one for one, _ in pairs} & {other for _, other in pairs}
    if both:
        raise ValueError(f"node {min(both)} would be on both boundaries: name them with `low` and `high`")


def _check_all(
    found: Pairs,
    ours: list[int],
    theirs: list[int],
    here: NDArray[np.float64],
    there: NDArray[np.float64],
    near: float,
    turn: tuple[Sequence[float], int],
) -> None:
    alone = sorted(set(ours) - {one for one, _ in found}), sorted(set(theirs) - {other for _, other in found})
    if not any(alone) and len({other for _, other in found}) == len(found):
        return
    from scipy.spatial import cKDTree

    axis, sectors = turn
    back = cKDTree(there).query(here @ rotation(axis, -2.0 * math.pi / sectors).T)[0]
    if np.all(back <= near):
        raise ValueError(
            "`low` and `high` are exchanged, or `axis` points the other way: the high boundary must be where "
            "the low one comes when turned about the axis by the right-hand rule"
        )
    told = "; ".join(
        f"{len(nodes)} of `{key}`: {', '.join(map(str, nodes[:_FEW]))}{', …' if len(nodes) > _FEW else ''}"
        for key, nodes in zip(("low", "high"), alone, strict=True)
        if nodes
    )
    raise ValueError(
        f"nodes without a partner within {near:.3g} ({told or 'one for two'}): both boundaries need the same "
        "mesh; or give a larger `tolerance`"
    )


def groups(
    pairs: Pairs, found: MatrixSet, turn: NDArray[np.float64] | None = None
) -> tuple[list[Group], list[Group]]:
    """Rows of the pairs: the three displacements and, where there are any, the three rotations of each node.

    Rows along axes of the nodes' own are scalars, where those axes turn with the sector.

    Parameters
    ----------
    turn : (3, 3) rotation by the pitch; needed for such rows.

    Raises
    ------
    ValueError
        The rows are not labelled, or a node is held on one boundary alone.
    """
    if found.labels is None:
        raise ValueError(
            "the files do not tell the nodes of their rows: give a file of labels (`mapping`), or the rows "
            "themselves (`low_rows`, `high_rows`)"
        )
    rows = {label: row for row, label in enumerate(found.labels)}
    low: list[Group] = []
    high: list[Group] = []
    for pair in pairs:
        for about in (slice(0, 3), slice(3, 6)):
            own = [tuple(rows.get(Label(node, c), -1) for c in OWN_COMPONENTS[about]) for node in pair]
            one, other = (tuple(rows.get(Label(node, c), -1) for c in COMPONENTS[about]) for node in pair)
            if max(map(max, own)) >= 0:
                ours, theirs = _scalars(
                    pair,
                    [a if max(a) >= 0 else b for a, b in zip(own, (one, other), strict=True)],
                    found.deck,
                    turn,
                )
                low += ours
                high += theirs
                continue
            if max(one) < 0 and max(other) < 0:
                continue
            if max(one) < 0 or max(other) < 0:
                held, free = pair if max(one) < 0 else pair[::-1]
                raise ValueError(f"node {held} has no DOFs and its partner {free} has: hold both, or neither")
            low.append(one)
            high.append(other)
    if not low:
        raise ValueError("no node of the boundaries has a DOF in the matrices")
    return low, high


def _scalars(
    pair: tuple[int, int], rows: list[Group], deck: Deck | None, turn: NDArray[np.float64] | None
) -> tuple[list[Group], list[Group]]:
    """Rows of two nodes along axes of their own, each with that of its partner."""
    ours, theirs = rows
    if [row < 0 for row in ours] == [row < 0 for row in theirs] and deck is not None and turn is not None:
        low, high = frames(deck, pair)
        if np.abs(turn @ low - high).max() <= _SAME:
            kept = [i for i, row in enumerate(ours) if row >= 0]
            return [(ours[i],) for i in kept], [(theirs[i],) for i in kept]
    raise ValueError(
        f"node {pair[0]} of the boundaries or its partner {pair[1]} is held along an axis of its own, "
        "which does not turn with the sector: hold both in one cylindrical system about the axis of the "
        "disk, or along it"
    )
