"""The contacts of a scene as rows of the time march."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from solver.errors import SettingError
from solver.marching.kernels import state as kernel
from solver.scene.scene import (
    AnyContact,
    ElasticNormalContact,
    End,
    FrictionContact,
    GapSpring,
    PlanarContact,
    PolynomialSpring,
)

_Pair = tuple[End, End]


@dataclass(frozen=True, slots=True, kw_only=True)
class Row:
    """One contact as the march sees it; the fields are those of `solver.marching.kernels.state.System`."""

    name: str
    ends: _Pair
    law: int = kernel.COULOMB
    kt: float = 0.0
    mu: float = 0.0
    N0: float = 0.0
    N1: float = 0.0
    N1_phase: float = 0.0
    normal_ends: _Pair | None = None
    kn: float = 0.0
    rest: float = 0.0
    presses: float = 1.0
    gap: float = 0.0
    powers: tuple[float, ...] = ()


def rows(contacts: tuple[AnyContact, ...]) -> tuple[Row, ...]:
    """Return the rows of all contacts; a square limit in two directions is two of them.

    Raises
    ------
    SettingError
        A contact has a circular limit, which the march does not follow.
    """
    return tuple(row for contact in contacts for row in _rows(contact))


def _rows(contact: AnyContact) -> tuple[Row, ...]:
    ends = contact.pair_ends
    name = contact.name
    if isinstance(contact, GapSpring):
        return (Row(name=name, ends=ends[0], law=kernel.GAP, kt=contact.k, gap=contact.gap),)
    if isinstance(contact, PolynomialSpring):
        powers = contact.coefficients
        stiffness = abs(powers[0])
        return (Row(name=name, ends=ends[0], law=kernel.POLYNOMIAL, kt=stiffness, powers=powers),)
    if not isinstance(contact, FrictionContact):
        raise SettingError("scene", name, "has a contact of a law that cannot be marched in time")
    given: dict[str, Any] = {
        "kt": contact.kt, "mu": contact.mu, "N0": contact.N0, "N1": contact.N1_value,
        "N1_phase": contact.N1_phase,
    }  # fmt: skip
    if isinstance(contact, ElasticNormalContact):
        rest = max(contact.N0, 0.0) if contact.prestressed else 0.0
        law = kernel.ELASTIC_NORMAL
        return (
            Row(name=name, ends=ends[0], law=law, normal_ends=ends[1], kn=contact.kn, rest=rest, **given),
        )
    if isinstance(contact, PlanarContact):
        if contact.limit != "box":
            raise SettingError(
                "scene", name, 'has a contact with a circular limit, which is not marched: try limit = "box"'
            )
        second = f"{name} (second)"
        return (Row(name=name, ends=ends[0], **given), Row(name=second, ends=ends[1], **given))
    return (Row(name=name, ends=ends[0], **given),)


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
        **numbers, "law": np.array([row.law for row in found], dtype=np.int64), "first": first,
        "second": second, "normal_first": normal_first, "normal_second": normal_second, "powers": powers,
    }  # fmt: skip


def _places(pairs: list[_Pair], index: dict[str, int]) -> tuple[NDArray[np.int64], NDArray[np.int64]]:
    """Return the DOF of both ends of every pair; -1 is the ground."""
    places = [[-1 if end.dof is None else index[end.dof] for end in pair] for pair in pairs]
    first, second = np.array(places, dtype=np.int64).reshape(-1, 2).T
    return first.copy(), second.copy()
