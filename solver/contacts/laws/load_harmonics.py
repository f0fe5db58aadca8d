"""The normal load as a Fourier list, `load = [N0, {order, amplitude, phase}, …]`: harmonics and their paths.

N0, N1 and N1_phase are fields of their own; the list keeps the harmonics from the second on.
"""

from __future__ import annotations

import math
import re
from collections.abc import Mapping, Sequence
from numbers import Real as Number
from typing import Annotated, Any

from pydantic import Field

from solver.contacts.fields import Angle, Part, Signed
from solver.contacts.kernels.columns import wave_column
from solver.contacts.laws.contact_parts import LawQuantity

MOST_ORDER = 1000
_PATH = re.compile(r"N([1-9]\d{0,3})(_phase)?")

Order = Annotated[int, Field(strict=True, ge=1, le=MOST_ORDER)]


class LoadHarmonic(Part):
    """A harmonic of a normal load: amplitude * cos(order * omega t + phase)."""

    order: Annotated[Order, "Its multiple of the frequency."]
    amplitude: Annotated[Signed, "Amplitude [N]."]
    phase: Annotated[Angle, "Phase [rad]."] = 0.0

    def in_sector(self, turn: float, *, standing: bool) -> LoadHarmonic:
        """Return it in a sector that the wave's first harmonic reaches an angle later [rad]."""
        angle = self.order * turn
        changed = (
            {"amplitude": self.amplitude * math.cos(angle)} if standing else {"phase": self.phase + angle}
        )
        return self.model_copy(update=changed)

    def times(self, factor: float) -> LoadHarmonic:
        """Return it with its amplitude times a factor."""
        return self.model_copy(update={"amplitude": factor * self.amplitude})


def order_of(key: str) -> int | None:
    """Return the harmonic from the second on that a parameter such as ``N3`` or ``N3_phase`` is of."""
    found = _PATH.fullmatch(key)
    order = int(found[1]) if found else 0
    return order if 2 <= order <= MOST_ORDER else None


def is_phase(key: str) -> bool:
    """Return whether a parameter is the phase of a harmonic of the load."""
    return key.endswith("_phase") and (key == "N1_phase" or order_of(key) is not None)


def is_of_variation(key: str) -> bool:
    """Return whether a parameter is of the part of the load that varies."""
    return key in ("N1", "N1_ratio") or is_phase(key) or order_of(key) is not None


def higher_quantity(key: str) -> LawQuantity:
    """Return what amplitude or phase of a harmonic from the second on is."""
    order = order_of(key) or 0
    if key.endswith("_phase"):
        return LawQuantity(
            column=wave_column(order) + 1, unit="rad", wanted="must be a number from -1e4 to 1e4 [rad]",
            by_hand=False,
        )  # fmt: skip
    odd = bool(order % 2)
    return LawQuantity(
        column=wave_column(order), unit="N", wanted="must be a number from -1e15 to 1e15 [N]",
        unlike_half_waves="changes the variation of a normal load" if odd else "", breaks_symmetry=odd,
        varies_load=True, load_order=order, by_hand=False,
    )  # fmt: skip


def named_apart(data: Any) -> Any:
    """Return the keys of a contact with N0, N1 and N1_phase taken from the list of its load."""
    given = data.get("load") if isinstance(data, Mapping) else None
    if not isinstance(given, Sequence) or isinstance(given, str):
        return data
    found: dict[str, Any] = {}
    if given and _is_number(given[0]):
        found["N0"] = given[0]
    for each in given:
        if isinstance(each, Mapping) and each.get("order") == 1 and "N1" not in found:
            found |= {"N1": each.get("amplitude", 0.0), "N1_phase": each.get("phase", 0.0)}
    beside = ("N0", *(("N1", "N1_ratio", "N1_phase") if "N1" in found else ()))
    twice = [key for key in beside if data.get(key) is not None and (key != "N0" or "N0" in found)]
    if twice:
        raise ValueError(
            f"`load` of contact `{data.get('name')}` has what `{twice[0]}` says: leave out the key or the "
            f"entry, got {twice[0]} = {data[twice[0]]!r} and load = {list(given)!r}"
        )
    return {**data, **found}


def as_harmonics(given: Any) -> Any:
    """Return the list of a load with a harmonic of order 1 in the place of its mean: each keeps its place."""
    if not isinstance(given, Sequence) or isinstance(given, str):
        return given
    orders: set[object] = set()
    for i, each in enumerate(given):
        if _is_number(each) and i > 0:
            raise ValueError(
                f"`load` must have its mean first and then tables, got {each!r} in place {i + 1}"
            )
        order = each.get("order") if isinstance(each, Mapping) else getattr(each, "order", None)
        if order is not None and order in orders:
            raise ValueError(f"`load` must have one entry of each order, got order {order!r} twice")
        orders.add(order)
    return [{"order": 1, "amplitude": 0.0} if _is_number(each) else each for each in given]


def _is_number(value: object) -> bool:
    return isinstance(value, Number) and not isinstance(value, bool)
