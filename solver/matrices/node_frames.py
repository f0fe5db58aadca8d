"""Matrices whose rows are along the axes of each node's own frame, turned into the global one.

Nastran (GRID, field CD), Ansys (rotated nodes) and Abaqus (``*TRANSFORM``) write matrices in those axes:
u_global = R u_own with the axes of the node as columns of R, so K_global = T K Tᵀ with the blocks R in T.
CalculiX writes them along the global axes all the same and expresses what it holds in other ones by
equations.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from numpy.typing import NDArray
from scipy.sparse import coo_array, csr_array

from solver.matrices.decks.deck import Deck, frames
from solver.matrices.labels import COMPONENTS, OWN_COMPONENTS, Label
from solver.matrices.load_set import MatrixSet

_ALIGNED = 1e-9  # component of a unit vector that counts as none
Rows = dict[int, int]  # component 0, 1, 2 of a vector: its row


def in_global(found: MatrixSet, deck: Deck | None) -> MatrixSet:
    """The matrices with their rows along the global axes, as far as the deck gives nodes other ones.

    Where a boundary condition holds a node along an axis of its own, what is left of the vector may span no
    global axes: those rows stay, as components U1 to U3 (UR1 to UR3).

    Raises
    ------
    ValueError
        The rows have no names, or the axes of a node are not known.
    """
    if deck is None or not deck.systems or not found.matrices:
        return replace(found, deck=deck)
    if found.labels is None:
        raise ValueError(
            f"node {min(deck.systems)} of the deck moves along axes of its own, and the files do not tell "
            "the nodes of their rows: give a file of labels (`mapping`)"
        )
    vectors = _vectors(found.labels, deck)
    nodes = [label // 2 for label in vectors]
    axes = frames(deck, nodes)
    labels = list(found.labels)
    entries: list[tuple[int, int, float]] = []
    kept: set[int] = set()
    spans = [_span(R, sorted(rows), lost=found.global_rows)
             for rows, R in zip(vectors.values(), axes, strict=True)]  # fmt: skip
    # Where one node of a system cannot be turned its partner on the other boundary must stay as well.
    whole = {id(deck.systems[node]) for node, span in zip(nodes, spans, strict=True) if span is None}
    for (key, rows), R, span in zip(vectors.items(), axes, spans, strict=True):
        node, about = divmod(key, 2)
        here = sorted(rows)
        if span is None or (len(here) < 3 and id(deck.systems[node]) in whole):
            kept.add(node)
            for i in here:
                labels[rows[i]] = Label(node, OWN_COMPONENTS[3 * about + i])
        elif not found.global_rows:
            for at, i in zip(here, span, strict=True):
                labels[rows[at]] = Label(node, COMPONENTS[3 * about + i])
                entries += [(rows[at], rows[j], float(R[i, j])) for j in here]
    remarks = (*found.remarks, *_remarks(found, sorted(set(nodes)), sorted(kept)))
    matrices, parts = found.matrices, found.parts
    if entries:
        T = _turn(entries, len(labels))
        matrices, parts = (
            {key: coo_array(T @ csr_array(matrix) @ T.T) for key, matrix in given.items()}
            for given in (found.matrices, found.parts)
        )
    return replace(found, matrices=matrices, parts=parts, labels=tuple(labels), deck=deck, remarks=remarks)


def _vectors(labels: tuple[Label, ...], deck: Deck) -> dict[int, Rows]:
    """Rows of each vector in a frame of its own, by twice its node, and one more for rotations."""
    vectors: dict[int, Rows] = {}
    for row, label in enumerate(labels):
        if label.node in deck.systems and label.component in COMPONENTS:
            at = COMPONENTS.index(label.component)
            vectors.setdefault(2 * label.node + at // 3, {})[at % 3] = row
    return vectors


def _span(R: NDArray[np.float64], here: list[int], *, lost: bool) -> list[int] | None:
    """The components along global axes that span the motions of some rows; None: there are none.

    Parameters
    ----------
    lost : whether the rows are along the global axes already; then those that are left out are looked at.
    """
    if len(here) == 3:
        return here
    if lost:
        away = [i for i in range(3) if i not in here]
        used = np.flatnonzero((np.abs(R[away]) > _ALIGNED).any(axis=0))
        return here if used.size == len(away) else None
    used = np.flatnonzero((np.abs(R[:, here]) > _ALIGNED).any(axis=1))
    return used.tolist() if used.size == len(here) else None


def _turn(entries: list[tuple[int, int, float]], size: int) -> csr_array:
    """T of its blocks, 1 on the diagonal of all other rows."""
    rows, columns, values = (np.array(part) for part in zip(*entries, strict=True))
    rest = np.setdiff1d(np.arange(size), rows)
    data = np.concatenate([values, np.ones(rest.size)])
    places = (np.concatenate([rows, rest]), np.concatenate([columns, rest]))
    return csr_array(coo_array((data, places), shape=(size, size)))


def _remarks(found: MatrixSet, nodes: list[int], kept: list[int]) -> list[str]:
    if not nodes:
        return []
    one = nodes[0] if not kept or nodes[0] != kept[0] else nodes[-1]
    if found.global_rows:
        said = [
            f"the deck gives {len(nodes)} nodes axes of their own; CalculiX stores matrices along the global "
            "ones all the same, and they are read so"
        ]
    else:
        said = [
            f"{len(nodes)} nodes move along axes of their own in the files; their rows are turned: "
            f"{one}.UX is along the global x"
        ]
    if kept:
        said.append(
            f"{len(kept)} nodes are held along an axis of their own; their rows stay as they are, "
            f"{kept[0]}.U1 to {kept[0]}.U3"
        )
    return said
