"""The outline of a sector's mesh, to be drawn: some places, edges between them, and the two boundaries."""

from __future__ import annotations

import base64
import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from typing import TYPE_CHECKING, Annotated, Any

import numpy as np
from numpy.typing import NDArray

from solver.arrays import Integer, Real
from solver.matrices.decks.deck import drawn_edges
from solver.matrices.values import ByContent

if TYPE_CHECKING:
    from scipy.sparse import csr_array

    from solver.matrices.decks.deck import Deck

MOST_POINTS = 10_000
MOST_EDGES = 20_000
MOST_MOVED = 9 * MOST_POINTS
KEYS = ("points", "edges", "low", "high")
MOVED = "moved"
_MOST_LOOSE = 1_500  # nodes of a mesh without elements
_MOST_OF_A_BOUNDARY = 400
_DIGITS = 5  # of a place, relative to the size of the sector: enough for a drawing


@dataclass(frozen=True, slots=True, eq=False)
class SectorOutline(ByContent):
    """What is drawn of a sector; nothing is computed with it. Equal to another with the same content."""

    points: Annotated[Real, "Places of nodes [m], read-only, (n, 3)."]
    edges: Annotated[
        Integer, "Pairs of points that a line joins, (m, 2); none where the deck tells no elements."
    ]
    low: Annotated[Integer, "Points of the boundary to the sector before, (k,)."]
    high: Annotated[Integer, "Of that to the next one, (k,)."]
    moved: Annotated[
        Real,
        "How the rows of the matrices move the points along the global axes: 3 × point + axis, row, factor, "
        "(e, 3); none of a reduced sector, whose coordinates are no rows.",
    ] = field(default_factory=lambda: np.zeros((0, 3)))
    digest: Annotated[str, "Hash of the content."] = field(init=False)

    def __post_init__(self) -> None:
        kept: dict[str, NDArray[Any]] = {}
        for key, kind, shape, most in (
            ("points", np.float64, (-1, 3), MOST_POINTS), ("edges", np.int64, (-1, 2), MOST_EDGES),
            ("low", np.int64, (-1,), MOST_POINTS), ("high", np.int64, (-1,), MOST_POINTS),
            (MOVED, np.float64, (-1, 3), MOST_MOVED),
        ):  # fmt: skip
            given = np.asarray(getattr(self, key))
            if given.size == 0:
                given = np.zeros([max(length, 0) for length in shape])
            if given.ndim != len(shape) or given.shape[1:] != shape[1:] or len(given) > most:
                row = "numbers" if len(shape) == 1 else f"rows of {shape[1]} numbers"
                raise ValueError(f"`{key}` of the outline must be at most {most} {row}")
            if kind is np.int64 and (given.dtype.kind not in "iuf" or np.any(given != np.floor(given))):
                raise ValueError(f"`{key}` of the outline must hold whole numbers")
            array = np.array(given, dtype=kind)
            if kind is np.float64 and not np.isfinite(array).all():
                raise ValueError(f"`{key}` of the outline must hold finite numbers")
            kept[key] = array
        self._hold(kept)
        named = kept[MOVED][:, :2]
        if (
            np.any(named != np.floor(named))
            or np.any(named < 0)
            or np.any(named[:, 0] >= 3 * len(self.points))
        ):
            raise ValueError(f"`{MOVED}` of the outline must name axes of its points, and rows from 0 on")
        for key in KEYS[1:]:
            rows = kept[key]
            if rows.size and not 0 <= rows.min() <= rows.max() < len(self.points):
                raise ValueError(f"`{key}` of the outline must name points from 0 to {len(self.points) - 1}")

    def __repr__(self) -> str:
        return f"SectorOutline({len(self.points)} points, {len(self.edges)} edges, {self.digest[:12]})"

    def arrays(self) -> dict[str, NDArray[Any]]:
        """The arrays of a file, under the names that `from_arrays` reads."""
        return {f"outline_{key}": getattr(self, key) for key in KEYS}

    @classmethod
    def from_arrays(cls, arrays: Mapping[str, Any]) -> SectorOutline | None:
        """The outline that a file has, if it has one.

        Raises
        ------
        ValueError
            Arrays that are none.
        """
        names = [f"outline_{key}" for key in KEYS]
        if not any(name in arrays for name in names):
            return None
        missing = next((name for name in names if name not in arrays), None)
        if missing is not None:
            raise ValueError(f"it has no array {missing!r} beside the others of the outline")
        return cls(*(arrays[name] for name in names))

    @classmethod
    def read(cls, data: object) -> SectorOutline:
        """Read a table of `points`, `edges`, `low`, `high`, and `moved` where it is known."""
        if isinstance(data, SectorOutline):
            return data
        if not isinstance(data, dict) or set(data) - {MOVED} != set(KEYS):
            got = ", ".join(map(str, data))[:200] if isinstance(data, dict) else type(data).__name__
            raise ValueError(f"`outline` must be a table with the keys {', '.join(KEYS)}, got {got}")
        return cls(**{key: _numbers(key, given) for key, given in data.items()})

    def write(self) -> dict[str, object]:
        """The table that `read` reads."""
        keys = (*KEYS, MOVED) if len(self.moved) else KEYS
        return {key: getattr(self, key).tolist() for key in keys}

    def moving(self, rows: int) -> csr_array:
        """How `rows` rows of matrices move the points, sparse (3 n_points, rows)."""
        from scipy.sparse import csr_array

        place, row, factor = self.moved.T
        at = (place.astype(np.int64), row.astype(np.int64))
        return csr_array((factor, at), shape=(3 * len(self.points), rows))

    def moved_by(self, motion: csr_array) -> SectorOutline:
        """The same, with how the rows move its points."""
        entries = motion.tocoo()
        return replace(self, moved=np.column_stack([*entries.coords, entries.data]))


def _numbers(key: str, data: object) -> NDArray[Any]:
    """A list of numbers or of rows of them; texts and truth values are refused."""
    rows, most = data if isinstance(data, list | tuple) else None, MOST_MOVED if key == MOVED else MOST_EDGES
    if rows is None or len(rows) > most:
        raise ValueError(f"`{key}` of the outline must be a list of at most {most}")
    flat = [value for row in rows for value in (row if isinstance(row, list | tuple) else (row,))]
    if any(isinstance(value, bool) or not isinstance(value, int | float) for value in flat):
        raise ValueError(f"`{key}` of the outline must hold numbers")
    try:
        return np.array(rows, dtype=np.float64) if rows else np.zeros(0)
    except (ValueError, OverflowError) as error:
        raise ValueError(f"`{key}` of the outline must have rows of one length, finite") from error


def outline_of(
    deck: Deck, low: Sequence[int], high: Sequence[int], metres: float = 1.0
) -> tuple[SectorOutline, list[int]]:
    """The outline of the mesh of a deck, and the node of each point.

    Parameters
    ----------
    deck : with the places, and maybe the elements; without these some of the nodes stand for them.
    low, high : nodes of the boundaries.
    metres : the unit of the deck.

    Raises
    ------
    ValueError
        An element has a node without a place.
    """
    edges = drawn_edges(deck.elements, deck.nodes)[:MOST_EDGES]
    own = np.unique(edges) if edges.size else _some(sorted(deck.nodes), _MOST_LOOSE)
    ends = [_some(nodes, _MOST_OF_A_BOUNDARY) for nodes in (low, high)]
    ends = [np.array([node for node in each if node in deck.nodes], np.int64) for each in ends]
    room = MOST_POINTS - sum(each.size for each in ends)
    edges = edges[np.all(np.isin(edges, own[:room]), axis=1)]
    shown = np.unique(np.concatenate([own[:room], *ends]).astype(np.int64))
    points = metres * np.array([deck.nodes[int(node)] for node in shown]).reshape(-1, 3)
    if points.size and (size := float(np.ptp(points, axis=0).max())) > 0.0:
        points = np.round(points, _DIGITS - math.floor(math.log10(size)))
    lower, higher = (np.searchsorted(shown, each) for each in ends)
    return SectorOutline(points, np.searchsorted(shown, edges), lower, higher), shown.tolist()


def _some(nodes: Sequence[int], most: int) -> Integer:
    """Nodes, evenly chosen where there are too many."""
    listed = np.array(nodes, np.int64)
    if listed.size <= most:
        return listed
    return np.asarray(listed[np.linspace(0, listed.size - 1, most).round().astype(np.int64)])


_KEYS = ("patterns", "shares")
_FAINT = 1e-4  # singular values, of the largest, that no drawing shows
_MOST = 8_000_000  # numbers of either array
_MOST_LOOKED_AT = 8  # nodal diameters whose motions make the patterns
_KINDS = {"patterns": "<f2", "shares": "<c8"}


@dataclass(frozen=True, slots=True, eq=False)
class OutlineMotion(ByContent):
    """The motion of the points of an outline; equal to another with the same content.

    Attributes
    ----------
    patterns : (r, n_points, 3) array
        Of half precision, read-only.
    shares : (nd, r, n) array
        How much of each pattern each coordinate moves, complex, at each nodal diameter.
    digest : str
        Hash of the content.
    """

    patterns: NDArray[np.float16]
    shares: NDArray[np.complex64]
    digest: str = field(init=False)

    def __post_init__(self) -> None:
        patterns, shares = np.asarray(self.patterns), np.asarray(self.shares)
        fits = patterns.ndim == shares.ndim == 3 and patterns.shape[::2] == (shares.shape[1], 3)
        if not fits or max(patterns.size, shares.size) > _MOST:
            raise ValueError(
                "`patterns` of the motion of an outline must be r × points × 3 numbers, and `shares` "
                f"diameters × r × coordinates, at most {_MOST} each, got {patterns.shape}, {shares.shape}"
            )
        if not (np.isfinite(patterns).all() and np.isfinite(shares).all()):
            raise ValueError("`patterns` and `shares` of the motion of an outline must hold finite numbers")
        self._hold(
            {"patterns": patterns.astype(_KINDS["patterns"]), "shares": shares.astype(_KINDS["shares"])}
        )

    def __repr__(self) -> str:
        return f"OutlineMotion({len(self.patterns)} patterns, {self.points} points, {self.digest[:12]})"

    @property
    def points(self) -> int:
        """Number of points."""
        return int(self.patterns.shape[1])

    def at(self, which: int, coordinates: NDArray[np.complex128]) -> NDArray[np.complex128]:
        """Return the motions (points, 3) [m] of coordinates (n,) at a nodal diameter by its place."""
        share = self.shares[which] @ coordinates
        return np.asarray(np.tensordot(share, self.patterns.astype(np.float64), axes=1))

    def check(self, diameters: int, coordinates: int) -> None:
        """Raise ValueError unless it is of so many nodal diameters and coordinates."""
        if self.shares.shape[::2] != (diameters, coordinates):
            raise ValueError(
                f"`motion` of the outline must be of {diameters} nodal diameters and {coordinates} "
                f"coordinates, got {self.shares.shape[0]} and {self.shares.shape[2]}"
            )

    @classmethod
    def of(cls, moved: Sequence[NDArray[Any]]) -> OutlineMotion | None:
        """Return the motion of arrays (3 points, n) of the nodal diameters; None where it is too large."""
        largest = np.max([np.abs(each).max(axis=0) for each in moved], axis=0)
        scale = np.where(largest > 0.0, largest, 1.0)
        some = np.unique(np.linspace(0, len(moved) - 1, _MOST_LOOKED_AT).round().astype(int))
        even = np.concatenate([part(moved[i] / scale) for i in some for part in (np.real, np.imag)], axis=1)
        values, vectors = np.linalg.eigh(even.T @ even)
        kept = values > _FAINT**2 * values[-1]
        patterns = even @ (vectors[:, kept] / np.sqrt(values[kept]))
        shares = np.array([patterns.T @ each for each in moved])
        if max(patterns.size, shares.size) > _MOST:
            return None
        return cls(patterns.T.reshape(shares.shape[1], -1, 3), shares)

    def _named(self) -> dict[str, NDArray[Any]]:
        return {"patterns": self.patterns, "shares": self.shares}

    def arrays(self) -> dict[str, NDArray[Any]]:
        """The arrays of a file, under the names that `from_arrays` reads."""
        return {f"outline_{key}": array for key, array in self._named().items()}

    @classmethod
    def from_arrays(cls, arrays: Mapping[str, Any]) -> OutlineMotion | None:
        """The motion that a file has, if it has one; those written before there was one have none."""
        names = [f"outline_{key}" for key in _KEYS]
        return cls(*(arrays[name] for name in names)) if any(name in arrays for name in names) else None

    @classmethod
    def read(cls, data: object) -> OutlineMotion:
        """Read a table `patterns`, `shares` of tables `shape`, `base64`."""
        if isinstance(data, OutlineMotion):
            return data
        if not isinstance(data, dict) or set(data) != set(_KEYS):
            got = ", ".join(map(str, data))[:200] if isinstance(data, dict) else type(data).__name__
            raise ValueError(
                f"`motion` of the outline must be a table with the keys patterns, shares, got {got}"
            )
        return cls(*(_unpacked(key, data[key]) for key in _KEYS))

    def write(self) -> dict[str, object]:
        """The table that `read` reads."""
        return {
            key: {"shape": list(array.shape), "base64": base64.b64encode(array.tobytes()).decode()}
            for key, array in self._named().items()
        }


def _unpacked(key: str, data: Any) -> NDArray[Any]:
    """The array of a table `shape`, `base64`: numbers as they stand in memory, little-endian."""
    try:
        raw = base64.b64decode(data["base64"], validate=True)
        return np.frombuffer(raw, dtype=_KINDS[key]).reshape(data["shape"])
    except (TypeError, KeyError, ValueError) as error:
        raise ValueError(
            f"`{key}` of the motion of the outline must be a table `shape`, `base64` ({_KINDS[key]}): {error}"
        ) from error
