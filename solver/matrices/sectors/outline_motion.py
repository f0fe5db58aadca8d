"""How the outline of a sector moves with the coordinates it was reduced onto, to be drawn.

The motion of all points is B S_d q at nodal diameter d. The patterns B are common to all diameters: the left
singular vectors of what unit coordinates move, each scaled to the same largest motion. They take few numbers,
as neighbouring nodal diameters move alike.
"""

from __future__ import annotations

import base64
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any

import numpy as np
from numpy.typing import NDArray

from solver.matrices.values import ByContent

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
