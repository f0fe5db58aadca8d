"""The contacts of a scene as rows of the time march."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from solver.contacts.fields import End
from solver.contacts.laws.base import AnyContact
from solver.contacts.laws.parts import Row

_Pair = tuple[End, End]


def rows(contacts: tuple[AnyContact, ...]) -> tuple[Row, ...]:
    """Return the rows of all contacts; a square limit in two directions is two of them.

    Raises
    ------
    SettingError
        A contact has a law that the march does not follow, such as a circular limit.
    """
    return tuple(row for contact in contacts for row in contact.rows())


def columns(found: tuple[Row, ...], index: dict[str, int]) -> dict[str, NDArray[Any]]:
    """Return the arrays of `solver.marching.kernels.state.System` that belong to the contacts."""
    first, second = _places([row.ends for row in found], index)
    ground = (End(None, False), End(None, False))
    normal_first, normal_second = _places([row.normal_ends or ground for row in found], index)
    degree = max((len(row.powers) for row in found), default=0)
    powers = np.zeros((len(found), max(degree, 1)))
    for i, row in enumerate(found):
        powers[i, : len(row.powers)] = row.powers
    scalars = ("kt", "mu", "N0", "N1", "N1_phase", "kn", "rest", "presses", "gap")
    numbers = {name: np.array([getattr(row, name) for row in found], dtype=np.float64) for name in scalars}
    return {
        **numbers, "law": np.array([row.follows.value for row in found], dtype=np.int64), "first": first,
        "second": second, "normal_first": normal_first, "normal_second": normal_second, "powers": powers,
    }  # fmt: skip


def _places(pairs: list[_Pair], index: dict[str, int]) -> tuple[NDArray[np.int64], NDArray[np.int64]]:
    """Return the DOF of both ends of every pair; -1 is the ground."""
    places = [[-1 if end.dof is None else index[end.dof] for end in pair] for pair in pairs]
    first, second = np.array(places, dtype=np.int64).reshape(-1, 2).T
    return first.copy(), second.copy()
