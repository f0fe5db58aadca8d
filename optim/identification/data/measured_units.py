"""Units of measured columns, ``amplitude [mm/s2]``: to SI, with the time derivative they are of."""

from __future__ import annotations

import math
import re
from dataclasses import dataclass
from enum import Enum

_HEAD = re.compile(r"^\s*(?P<name>[^\[\]]*?)\s*(?:\[\s*(?P<unit>[^\[\]]*?)\s*\])?\s*$")
_LENGTHS = {"m": 1.0, "cm": 1e-2, "mm": 1e-3, "um": 1e-6, "µm": 1e-6, "μm": 1e-6, "nm": 1e-9, "in": 0.0254}
_STANDARD_GRAVITY = 9.80665


class Dimension(Enum):
    """What a column is of; the value is the unit it has if it names none."""

    FREQUENCY = "Hz"
    MOTION = "m"
    LENGTH = "m of a loop"
    ANGLE = "deg"
    FORCE = "N"
    TIME = "s"
    NUMBER = ""


@dataclass(frozen=True, slots=True, kw_only=True)
class Unit:
    """How a column becomes SI.

    Attributes
    ----------
    factor : float
        Of its numbers, to Hz, m, deg, N or s and their derivatives.
    order : int
        0 of a displacement, 1 of a velocity, 2 of an acceleration.
    per_force : bool
        Whether it is a motion for each newton of excitation.
    """

    factor: float = 1.0
    order: int = 0
    per_force: bool = False


_PLAIN = {
    Dimension.FREQUENCY: {"Hz": 1.0, "kHz": 1e3, "rad/s": 0.5 / math.pi, "1/min": 1.0 / 60.0},
    Dimension.LENGTH: _LENGTHS,
    Dimension.ANGLE: {"deg": 1.0, "°": 1.0, "rad": 180.0 / math.pi},
    Dimension.FORCE: {"N": 1.0, "mN": 1e-3, "kN": 1e3, "lbf": 4.4482216152605},
    Dimension.TIME: {"s": 1.0, "ms": 1e-3, "us": 1e-6, "µs": 1e-6},
    Dimension.NUMBER: {"": 1.0, "1": 1.0},
}  # fmt: skip


def known_units(dimension: Dimension) -> tuple[str, ...]:
    """Return the units a column of this dimension may name."""
    if dimension is Dimension.MOTION:
        return (*_LENGTHS, "m/s", "mm/s", "m/s2", "mm/s2", "g", "m/N", "m/s2/N", "g/N")
    return tuple(_PLAIN[dimension])


def unit_of(dimension: Dimension, text: str | None) -> Unit | None:
    """Return the unit that a column names, its own if it names none; None for an unknown one."""
    if text is None:
        return Unit()
    if dimension is not Dimension.MOTION:
        factor = _PLAIN[dimension].get(text)
        return None if factor is None else Unit(factor=factor)
    plain = text.replace("²", "2").replace("^", "")
    per_force = plain.endswith("/N")
    plain = plain.removesuffix("/N")
    if plain == "g":
        return Unit(factor=_STANDARD_GRAVITY, order=2, per_force=per_force)
    length, slash, time = plain.partition("/")
    orders = {"": 0, "s": 1, "s2": 2}
    if length not in _LENGTHS or time not in orders or (slash and not time):
        return None
    return Unit(factor=_LENGTHS[length], order=orders[time], per_force=per_force)


def split_head(text: str) -> tuple[str, str | None]:
    """Return name and unit of a column head, ``amplitude [mm]``; no unit is None."""
    match = _HEAD.match(text)
    if match is None:
        return text.strip(), None
    return match["name"], match["unit"]
