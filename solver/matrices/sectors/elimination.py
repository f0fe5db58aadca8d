"""The high boundary of a sector expressed by the low one of the next sector, for each nodal diameter.

At nodal diameter n the next sector moves as this one does, e^{jnα} later, in axes turned by the pitch α. Its
low boundary is the high one of this sector, so that in the axes of this sector

    q_high = R(α) q_low e^{jnα},   q = P(n) q_kept,   K_n = P(n)ᴴ K P(n)

with the rotation R of each displacement and each small rotation: D. L. Thomas, Int. J. Numer. Meth. Eng. 14
(1979) 81, doi:10.1002/nme.1620140107. P(n) = P0 + P1 e^{jnα} is real but for the phase, and so is what is
left of a matrix: K_n = K0 + Kp e^{jnα} + Km e^{-jnα}.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Annotated, Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from solver.matrices.decks.deck import rotation as rotation

Group = tuple[int, ...]  # rows of a vector's three components (-1: held), or the one row of a scalar
_LEFT = 1e-9  # component of a turned displacement that counts as none where a boundary condition holds it


class Circulant(NamedTuple):
    """A matrix of the annulus: its blocks of a sector with itself, with the next and with the last one."""

    own: Any
    next: Any
    last: Any

    def at(self, diameter: int, sectors: int) -> Any:
        """The matrix at a nodal diameter: own + next e^{jnα} + last e^{-jnα}; real where the phase is."""
        turn = phase_factor(diameter, sectors)
        return (
            self.own + self.next * turn + self.last * (turn if isinstance(turn, float) else turn.conjugate())
        )


def phase_factor(diameter: int, sectors: int) -> complex | float:
    """e^{jnα} of a nodal diameter; ±1 without an imaginary part where it is real."""
    if 2 * diameter % sectors == 0:
        return 1.0 if diameter % sectors == 0 else -1.0
    angle = 2.0 * math.pi * (diameter % sectors) / sectors
    return complex(math.cos(angle), math.sin(angle))


@dataclass(frozen=True, slots=True, kw_only=True)
class Elimination:
    """P0 and P1, sparse (n, n_kept), and the rows kept."""

    kept: Annotated[
        NDArray[np.int64], "Rows of the sector that are not on its high boundary, ascending, (n_kept,)."
    ]
    here: Annotated[Any, "P0, sparse."]
    beyond: Annotated[Any, "P1, sparse."]

    def of(self, matrix: Any) -> Circulant:
        """What is left of a matrix of the sector, dense or sparse as it is."""
        right, ahead = matrix @ self.here, matrix @ self.beyond
        return Circulant(
            self.here.T @ right + self.beyond.T @ ahead, self.here.T @ ahead, self.beyond.T @ right
        )

    def row(self, row: int) -> int:
        """The place of a row of the sector among those kept."""
        return int(np.searchsorted(self.kept, row))


def elimination(
    n: int, low: Sequence[Group], high: Sequence[Group], axis: Sequence[float] | None, sectors: int
) -> Elimination:
    """Express the rows of the high boundary by those of the low one.

    Parameters
    ----------
    n : rows of the sector.
    low, high : pairs of groups: rows of the three components of one vector, -1 where a boundary condition
        holds it, or one row of a scalar, which does not turn.
    axis : of the disk; may be None where all groups are scalars.
    sectors : number of them; the pitch is 2 π / sectors.

    Raises
    ------
    ValueError
        Groups that do not fit; the message says which.
    """
    from scipy.sparse import coo_array

    check_groups(n, low, high, axis)
    turned = np.eye(3) if axis is None else rotation(axis, 2.0 * math.pi / sectors)
    away = np.array([row for group in high for row in group if row >= 0], dtype=np.int64)
    kept = np.setdiff1d(np.arange(n), away)
    place = np.full(n, -1)
    place[kept] = np.arange(kept.size)
    rows, columns, values = [], [], []
    for here, there in zip(low, high, strict=True):
        block = turned if len(here) == 3 else np.eye(1)
        for i, target in enumerate(there):
            for j, source in enumerate(here):
                if abs(block[i, j]) <= _LEFT or source < 0:
                    continue
                if target < 0:
                    raise ValueError(
                        f"component {i + 1} of the high boundary is held where row {source} of the low one "
                        "moves along it: the same directions must be held on both, turned with the sector"
                    )
                rows.append(target)
                columns.append(int(place[source]))
                values.append(float(block[i, j]))
    shape = (n, kept.size)
    ones = coo_array((np.ones(kept.size), (kept, np.arange(kept.size))), shape=shape).tocsr()
    return Elimination(kept=kept, here=ones, beyond=coo_array((values, (rows, columns)), shape=shape).tocsr())


def check_groups(n: int, low: Sequence[Group], high: Sequence[Group], axis: Sequence[float] | None) -> None:
    """Raise ValueError unless the boundaries are pairs of groups of rows, each row once."""
    if len(low) != len(high) or not low:
        raise ValueError(
            f"`low_rows` and `high_rows` must be pairs, at least one, got {len(low)} and {len(high)}"
        )
    for key, groups in (("low_rows", low), ("high_rows", high)):
        for group in groups:
            if len(group) not in (1, 3):
                raise ValueError(f"`{key}` must hold rows, or three rows of a vector, got {len(group)} rows")
            bad = next((row for row in group if not -1 <= row < n), None)
            if bad is not None:
                raise ValueError(f"`{key}` must hold rows from 0 to {n - 1}, got {bad}")
    pair = next((i for i, (a, b) in enumerate(zip(low, high, strict=True)) if len(a) != len(b)), None)
    if pair is not None:
        raise ValueError(f"`low_rows` and `high_rows` must have groups of one length, pair {pair} has not")
    used = [row for groups in (low, high) for group in groups for row in group if row >= 0]
    if len(set(used)) < len(used):
        twice = next(row for i, row in enumerate(used) if row in used[:i])
        raise ValueError(
            f"`low_rows` and `high_rows` name row {twice} twice: nodes on the axis of the disk, which belong "
            "to both boundaries, must be held"
        )
    if axis is None and any(len(group) == 3 for group in low):
        raise ValueError("`axis` is missing: vectors of the high boundary are turned about it")
