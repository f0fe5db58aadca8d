"""How amplitudes and numbers are shown to people: in the unit that fits, with the digits that count."""

from __future__ import annotations

import math
from dataclasses import dataclass

STRESS_UNITS = {"Pa": 1.0, "kPa": 1e3, "MPa": 1e6, "GPa": 1e9, "N/mm2": 1e6, "N/mm²": 1e6}
"""Units that stresses may have [Pa]."""
_DIGITS = 4


@dataclass(frozen=True, slots=True)
class LengthUnit:
    """A unit of length: its name, and how many of it make a metre."""

    name: str
    per_metre: float

    def show(self, metres: float) -> str:
        """A length in this unit, ``"0.1016 mm"``."""
        return f"{number(metres * self.per_metre)} {self.name}"


_METRE = LengthUnit("m", 1.0)
_LENGTHS = ((0.1, _METRE), (1e-4, LengthUnit("mm", 1e3)), (1e-7, LengthUnit("µm", 1e6)))
_SMALLEST = LengthUnit("nm", 1e9)


def length_unit(largest: float) -> LengthUnit:
    """The unit in which `largest` [m] is a number from 0.1 to 100."""
    size = abs(largest)
    if not math.isfinite(size) or size == 0.0:
        return _METRE
    return next((unit for least, unit in _LENGTHS if size >= least), _SMALLEST)


def length(metres: float) -> str:
    """An amplitude [m] in the unit that fits."""
    return length_unit(metres).show(metres)


def number(value: float, digits: int = _DIGITS) -> str:
    """A number with so many significant digits, trailing zeros dropped."""
    return f"{value:.{digits}g}"


def duration(seconds: float) -> str:
    """A time in ms or s."""
    if not math.isfinite(seconds):
        return "an unknown time"
    return f"{seconds * 1e3:.3g} ms" if seconds < 1.0 else f"{seconds:.3g} s"
