"""The table [structure] of a sector in a scene file: its boundaries become rows, a large model is reduced."""

from __future__ import annotations

import math
import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Annotated, Any

import numpy as np
from numpy.typing import NDArray
from scipy.sparse import csr_array

from solver.errors import UNSAID, Place, SceneError
from solver.matrices.decks.ansys import AnsysDeck
from solver.matrices.decks.deck import Deck as Deck
from solver.matrices.decks.deck import DeckFile, frames, positions
from solver.matrices.decks.keywords import KeywordDeck
from solver.matrices.decks.nastran import read_nastran
from solver.matrices.load_set import MatrixSet
from solver.matrices.readers.numbers_in_text import COMPONENTS, OWN_COMPONENTS, FormatError, Label
from solver.matrices.readers.reader_registry import MatrixFileError, Reader
from solver.matrices.sectors.elimination import Elimination, Group, elimination, rotation
from solver.matrices.sectors.outline import SectorOutline, outline_of
from solver.matrices.sectors.sector_parts import WHOLE
from solver.matrices.sectors.sector_reduction import ReducedSector, diameters_met, read_sector, reduce_sector
from solver.matrices.values import MOST_DOFS, DofTable, Matrix

_KEYWORDS = re.compile(r"\s*\*\s*(NODE|INCLUDE|PART)\s*(,|$)", re.IGNORECASE)
_ANSYS = re.compile(r"\s*(NBLOCK|N)\s*,", re.IGNORECASE)
_NASTRAN = re.compile(r"(GRID|INCLUDE)\b", re.IGNORECASE)


def read_deck(path: Path, *, elements: bool = False, alone: bool = False) -> Deck:
    """Read the nodes of a deck, their sets and frames, and the elements if they are asked for.

    Parameters
    ----------
    alone : whether the deck may not include other files, as a stranger's.

    Raises
    ------
    FormatError
        With the line that cannot be read, or a deck without nodes.
    OSError
        It cannot be read.
    """
    deck = Deck()
    try:
        file = DeckFile(path, alone)
        if any(map(_KEYWORDS.match, file.lines())):
            KeywordDeck(file, deck, elements=elements).read()
        elif any(map(_ANSYS.match, file.lines())):
            AnsysDeck(file, deck).read()
        elif any(map(_NASTRAN.match, file.lines())):
            read_nastran(file, deck)
    except FormatError:
        raise
    except (IndexError, ValueError, OverflowError) as error:
        raise FormatError(f"{path.name!r} is damaged or no deck: {error}") from error
    if not deck.nodes:
        raise FormatError(
            f"{path.name!r} has no nodes: *NODE (CalculiX, Abaqus), NBLOCK or N (Ansys) or GRID (Nastran)"
        )
    bad = next((node for node, place in deck.nodes.items() if not all(map(math.isfinite, place))), None)
    if bad is not None:
        raise FormatError(f"node {bad} must be at a finite place, got {deck.nodes[bad]}")
    return deck


def check_alone(path: Path) -> None:
    """Raise FormatError if a deck includes other files, which a stranger's may not, or cannot be read.

    Raises
    ------
    FormatError
        With the line.
    OSError
        It cannot be read.
    """
    read_deck(path, alone=True)


READERS = (
    Reader(
        name="a deck",
        suffixes=(".inp", ".cdb"),
        word="inp",
        help="CalculiX, Abaqus (`*NODE`, `*NSET`), Ansys (`NBLOCK`, `N`, `CMBLOCK`): positions, sets and "
        "frames of nodes, for the boundaries of a sector of a disk; Nastran (`GRID`) too, uploaded with "
        "`?format=inp`.",
        nodes=read_deck,
    ),
)


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


FILE_KEYS = ("low", "high", "nodes", "pair_by", "tolerance", "keep_modes")
MOST_SECTORS = 10_000
DEFAULT_AXIS = (0.0, 0.0, 1.0)


@dataclass(frozen=True, slots=True, kw_only=True)
class Boundaries:
    """The boundaries of a sector as rows, and the axis."""

    low: Annotated[list[Group], "Groups of rows."]
    high: Annotated[list[Group], "Those paired with them."]
    axis: Annotated[tuple[float, float, float], "(3,)."]
    outline: Annotated[SectorOutline | None, "Of the mesh, where there is a deck."] = None
    drawn: Annotated[
        Any | None, "The motion of its points along the global axes by the rows, sparse (3 n_points, rows)."
    ] = None

    def elimination(self, n: int, sectors: int) -> Elimination:
        """How the high boundary of a sector of n rows follows."""
        return elimination(n, self.low, self.high, self.axis, sectors)

    def table(self) -> dict[str, object]:
        """As the scene keeps it."""
        return {
            "low_rows": [list(group) for group in self.low],
            "high_rows": [list(group) for group in self.high],
            "axis": list(self.axis),
        }


def boundaries(
    given: Mapping[str, Any], found: MatrixSet, sectors: int, folder: Path, metres: float = 1.0
) -> Boundaries:
    """The boundaries that a table [structure.cyclic] of a scene file names.

    Parameters
    ----------
    given : the table.
    found : the matrices with the labels of their rows.
    folder : where relative names of files begin.
    metres : the unit of the deck.

    Raises
    ------
    SceneError
        Sets or nodes that are not there, or do not match.
    """
    axis = given.get("axis", DEFAULT_AXIS)
    if not (isinstance(axis, list | tuple) and len(axis) == 3 and _is_direction(axis)):
        raise _refusal("axis", "must be a direction [x, y, z]", axis)
    pair_by, tolerance = given.get("pair_by", "position"), given.get("tolerance")
    if pair_by not in PAIR_BY:
        raise _refusal("pair_by", f"must be one of {', '.join(PAIR_BY)}", pair_by)
    if tolerance is not None and not (isinstance(tolerance, int | float) and tolerance > 0.0):
        raise _refusal("tolerance", "must be a distance > 0", tolerance)
    deck = found.deck or read_nodes(given.get("nodes"), folder)
    low, high = (_nodes(key, given.get(key), deck) for key in ("low", "high"))
    try:
        pairs = paired(deck, low, high, axis, sectors, pair_by=pair_by, tolerance=tolerance)
        ours, theirs = groups(pairs, found, rotation(axis, 2.0 * math.pi / sectors))
    except ValueError as error:
        raise _refusal("low", str(error), named=False) from error
    outline, drawn = (None, None) if deck is None else _outline(deck, pairs, found, metres)
    direction = (float(axis[0]), float(axis[1]), float(axis[2]))
    return Boundaries(low=ours, high=theirs, axis=direction, outline=outline, drawn=drawn)


def _outline(
    deck: Deck, pairs: Pairs, found: MatrixSet, metres: float
) -> tuple[SectorOutline, csr_array | None]:
    """The outline of a deck, and how the rows move its points where they are labelled."""
    try:
        outline, nodes = outline_of(deck, [one for one, _ in pairs], [other for _, other in pairs], metres)
    except ValueError as error:
        raise _refusal("nodes", f"`nodes`: {error}", named=False) from error
    return outline, None if found.labels is None else displacements(nodes, found.labels, deck)


def displacements(nodes: Sequence[int], labels: Sequence[Label], deck: Deck) -> csr_array:
    """How the rows of matrices move nodes along the global axes, sparse (3 nodes, rows)."""
    at = {node: 3 * i for i, node in enumerate(nodes)}
    entries: list[tuple[int, int, float]] = []
    for row, (node, component) in enumerate(labels):
        if node in at and component in COMPONENTS[:3]:
            entries.append((at[node] + COMPONENTS.index(component), row, 1.0))
        elif node in at and component in OWN_COMPONENTS[:3]:
            own = frames(deck, [node])[0][:, OWN_COMPONENTS.index(component)]
            entries += [(at[node] + i, row, float(own[i])) for i in range(3)]
    rows, columns, values = zip(*entries, strict=True) if entries else ((), (), ())
    return csr_array((values, (rows, columns)), shape=(3 * len(nodes), len(labels)))


def _is_direction(given: Sequence[object]) -> bool:
    numbers = [float(part) for part in given if isinstance(part, int | float) and not isinstance(part, bool)]
    return len(numbers) == len(given) and 0.0 < math.hypot(*numbers) < math.inf


def read_nodes(name: object, folder: Path, place: Place = ("cyclic",)) -> Deck | None:
    """The deck that `nodes` at a place of a structure names; None without one.

    Raises
    ------
    SceneError
        It cannot be read.
    """
    if name is None:
        return None
    if not isinstance(name, str):
        raise SceneError.of(("structure", *place, "nodes"), "must be the name of a deck", name)
    try:
        return read_deck(folder / name, elements=True)
    except (FormatError, OSError) as error:
        why = f" cannot be read: {error.strerror or error}" if isinstance(error, OSError) else f": {error}"
        said = f"`nodes`: {name!r}{why}"
        raise SceneError.of(("structure", *place, "nodes"), said, named=False) from error


def _nodes(key: str, given: object, deck: Deck | None) -> list[int] | None:
    """The nodes of a boundary: a list of them, or the name of a set of the deck."""
    if given is None:
        return None
    if isinstance(given, list) and given and all(type(node) is int for node in given):
        return list(dict.fromkeys(given))
    if not isinstance(given, str):
        raise _refusal(key, "must be the name of a set or a list of nodes", given)
    if deck is None:
        raise _refusal("nodes", f"is missing: the deck that has the set {given!r}")
    name = given.strip().strip('"').upper()
    if name not in deck.sets:
        known = ", ".join(sorted(deck.sets)[:20]) or "none"
        said = f"`{key}`: there is no set {given!r} of nodes in the deck; known: {known}"
        raise _refusal(key, said, named=False)
    return list(dict.fromkeys(deck.sets[name]))


def sector_kept(
    tables: dict[str, Any], found: MatrixSet, folder: Path, orders: list[int], metres: float = 1.0
) -> tuple[dict[str, Any], ReducedSector | None]:
    """The tables of a sector with its files read, as the scene keeps them, and the reduction if there is one.

    Parameters
    ----------
    tables : of [structure], its labels already rows.
    orders : engine orders of the excitation.
    metres : the unit of length of the files.

    Raises
    ------
    SceneError
        Anything that cannot be used; the pointer is that of the key.
    """
    sectors, joined = tables["sectors"], tables.get("cyclic") or {}
    whole = isinstance(sectors, int) and not isinstance(sectors, bool)
    if not whole or not 1 <= sectors <= MOST_SECTORS or not isinstance(joined, dict):
        return tables, None  # what is wrong is said with the rest of the scene
    if isinstance(tables.get("diameters"), str):
        if found.matrices:
            given = ", ".join(found.matrices)
            said = f"stands in place of {given}: remove one or the other"
            raise SceneError.of(("structure", "diameters"), said)
        return _from_file(tables, folder), None
    if not found.matrices:
        return tables, None
    _check_sizes(found)
    check_part_sizes(found)
    kept = {key: value for key, value in joined.items() if key not in FILE_KEYS}
    if "low_rows" in joined or "high_rows" in joined:
        return {**tables, **_dense(found), "cyclic": kept}, None
    ends, keep = boundaries(joined, found, sectors, folder, metres), joined.get("keep_modes")
    drawn = tables if ends.outline is None else {**tables, "outline": ends.outline}
    if keep is None:
        if ends.outline is not None and ends.drawn is not None:
            drawn["outline"] = ends.outline.moved_by(ends.drawn)
        return {**drawn, **_dense(found), "cyclic": {**kept, **ends.table()}}, None
    if isinstance(keep, bool) or not isinstance(keep, int) or not 0 <= keep <= MOST_DOFS:
        raise _refusal("keep_modes", f"must be a whole number from 0 to {MOST_DOFS}", keep)
    _refuse_unreduced(tables, found)
    reduced = _reduced(tables, found, ends, keep, orders)
    was = {"dofs": reduced.full, "modes": reduced.modes, "highest_hz": reduced.highest_hz}
    rest = {key: value for key, value in drawn.items() if key not in found.matrices and key != "parts"}
    return {
        **rest, "diameters": reduced.matrices, "dofs": reduced.rows,
        "cyclic": {**kept, "axis": list(ends.axis)}, "reduction": was,
    }, reduced  # fmt: skip


def _reduced(
    tables: Mapping[str, Any], found: MatrixSet, ends: Boundaries, keep: int, orders: list[int]
) -> ReducedSector:
    """The sector at the nodal diameters that its engine orders meet, or all where parts may be mistuned."""
    sectors, matrices = tables["sectors"], {key: csr_array(each) for key, each in found.matrices.items()}
    try:
        dofs = DofTable.read(tables.get("dofs")).write()
        gone = ends.elimination(matrices["M"].shape[0], sectors)
        parts = parts_to_reduce(tables.get("mistuning"), found)
        met = tuple(range(sectors // 2 + 1)) if parts else diameters_met(orders, sectors)
        return reduce_sector(matrices, gone, dofs, keep, met, sectors, parts, ends.drawn)
    except ValueError as error:
        raise SceneError.of(("structure", "dofs"), str(error), named=False) from error


def parts_to_reduce(mistuning: object, found: MatrixSet) -> dict[str, Any]:
    """The matrices that mistuning may scale: all parts, and K or M where the table names them."""
    of = mistuning.get("of") if isinstance(mistuning, Mapping) else None
    whole = [key for key in WHOLE if isinstance(of, list | tuple) and key in of]
    matrices = {key: found.matrices[key] for key in whole} | found.parts
    return {key: csr_array(matrix) for key, matrix in matrices.items()}


def _check_sizes(found: MatrixSet) -> None:
    """Raise SceneError unless all matrices have as many rows."""
    sizes = {key: int(matrix.shape[0]) for key, matrix in found.matrices.items()}
    first = next(iter(sizes))
    odd = next((key for key in sizes if sizes[key] != sizes[first]), None)
    if odd is not None:
        rows = f"`{odd}` has {sizes[odd]} rows, {first} has {sizes[first]}"
        raise SceneError.of(("structure", odd), f"{rows}: export all matrices from one analysis", named=False)


def check_part_sizes(found: MatrixSet) -> None:
    """Raise SceneError unless parts have the rows of M and K."""
    rows = found.size
    for name, matrix in found.parts.items():
        if matrix.shape[0] != rows:
            raise SceneError.of(
                ("structure", "parts", name),
                f"`parts`: {name!r} must have {rows} rows like M and K, got {matrix.shape[0]}",
                named=False,
            )


def _refuse_unreduced(tables: Mapping[str, Any], found: MatrixSet) -> None:
    """Refuse what a reduction of a sector does not carry along, and matrices without M or K."""
    missing = next((key for key in "MK" if key not in found.matrices), None)
    if missing is not None:
        raise SceneError.of(
            ("structure", missing),
            "must come from a file too: `keep_modes` of a sector reduces M and K together",
        )
    keys: list[str] = [key for key in ("G", "K_omega2") if key in found.matrices]
    keys += ["symmetric"] if tables.get("symmetric") is False else []
    for key in keys[:1]:
        raise SceneError.of(
            ("structure", key),
            "does not go with `keep_modes` of a sector, which reduces symmetric M, K and C: leave "
            "`keep_modes` out, or give such terms as [[couplings]] of the DOFs in use",
        )


def _from_file(tables: dict[str, Any], folder: Path) -> dict[str, Any]:
    try:
        matrices, was, outline = read_sector(folder / tables["diameters"])
    except MatrixFileError as error:
        raise SceneError.of(("structure", "diameters"), f"`diameters`: {error}", named=False) from error
    drawn = {} if outline is None else {"outline": outline}
    return {**tables, **drawn, "diameters": matrices, "reduction": was}


def _dense(found: MatrixSet) -> dict[str, object]:
    for key, matrix in found.matrices.items():
        if matrix.shape[0] > MOST_DOFS:
            raise SceneError.of(
                ("structure", key),
                f"has {matrix.shape[0]} rows, {MOST_DOFS} are the most without reduction: `stickslip "
                "import --sectors … --reduce` reduces them once; `keep_modes` = 40 (say) in "
                "[structure.cyclic] does it whenever the scene is loaded",
            )
    dense: dict[str, object] = {key: Matrix(matrix.toarray()) for key, matrix in found.matrices.items()}
    if found.parts:
        dense["parts"] = {name: Matrix(matrix.toarray()) for name, matrix in found.parts.items()}
    return dense


def _refusal(key: str, wanted: str, got: object = UNSAID, *, named: bool = True) -> SceneError:
    return SceneError.of(("structure", "cyclic", key), wanted, got, named=named)
