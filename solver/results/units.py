"""How numbers are written for people, with the unit and the digits that fit, and read from them."""

from __future__ import annotations

import math
import re
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

_LBF, _INCH, _RAD = 4.4482216152605, 0.0254, 180.0 / math.pi
LENGTHS = {"m": 1.0, "cm": 1e-2, "mm": 1e-3, "um": 1e-6, "µm": 1e-6, "μm": 1e-6, "nm": 1e-9, "in": _INCH}
FORCES = {"N": 1.0, "mN": 1e-3, "kN": 1e3, "lbf": _LBF}
FREQUENCIES = {"Hz": 1.0, "kHz": 1e3, "rad/s": 0.5 / math.pi, "1/min": 1.0 / 60.0}
TIMES = {"s": 1.0, "ms": 1e-3, "us": 1e-6, "µs": 1e-6}
STRESS_UNITS = {"Pa": 1.0, "kPa": 1e3, "MPa": 1e6, "GPa": 1e9, "N/mm2": 1e6, "N/mm²": 1e6}
"""Units that stresses may have [Pa]."""
SUFFIXES: Mapping[str, Mapping[str, float]] = {
    "m": LENGTHS, "N": FORCES, "Pa": STRESS_UNITS, "s": TIMES, "Hz": FREQUENCIES, "1/s": {"1/s": 1.0},
    "kg": {"kg": 1.0, "g": 1e-3, "t": 1e3}, "rad": {"rad": 1.0, "deg": 1.0 / _RAD, "°": 1.0 / _RAD},
    "N/m": {"N/m": 1.0, "N/mm": 1e3, "N/µm": 1e6, "N/um": 1e6, "kN/m": 1e3, "kN/mm": 1e6, "MN/m": 1e6,
            "lbf/in": _LBF / _INCH},
    "N s/m": {"N s/m": 1.0, "N s/mm": 1e3, "kN s/m": 1e3}, "1/min": {"1/min": 1.0, "Hz": 60.0, "1/s": 60.0},
    "kg m²": {"kg m²": 1.0, "kg mm²": 1e-6, "g mm²": 1e-9}, "m/s": {"m/s": 1.0, "mm/s": 1e-3},
    "J": {"J": 1.0, "mJ": 1e-3, "kJ": 1e3}, "W": {"W": 1.0, "mW": 1e-3, "kW": 1e3}, "": {"%": 0.01},
}  # fmt: skip
"""By the unit that a number has, those it may be given in, with how many of it they are."""
SPELLED = {
    "grad": "deg", "degree": "deg", "degrees": "deg", "upm": "1/min", "u/min": "1/min", "rpm": "1/min",
    "hz": "Hz",
}  # fmt: skip
_SUFFIXED = re.compile(
    r"\s*([-+]?(?:\d++\.?\d*+|\.\d++)(?:[eE][-+]?\d++)?+)\s*([^\s\d.,:;+-][^,:;]*?|1/\w+)\s*"
)


def has_suffix(text: str) -> bool:
    """Whether a text is a number with a unit behind it."""
    return _SUFFIXED.fullmatch(text) is not None


def read(text: str, unit: str) -> float:
    """Return a number, which may have a unit behind it, ``"35 deg"``, in the unit that is meant.

    Raises
    ------
    ValueError
        It is none, or has a unit of something else: what would be right.
    """
    found = _SUFFIXED.fullmatch(text)
    if found is None:
        try:
            return float(text)
        except ValueError:
            raise ValueError("must be a number") from None
    known = {_plain(name): factor for name, factor in {unit: 1.0, **SUFFIXES.get(unit, {})}.items()}
    factor = known.get(_plain(SPELLED.get(found[2].lower(), found[2])))
    if factor is None:
        # Of several spellings of one the first is named.
        spelled = {size: name for name, size in reversed([*SUFFIXES.get(unit, {unit: 1.0}).items()])}
        *others, last = reversed([*spelled.values()])
        named = f"{', '.join(others)} or {last}" if others else last
        raise ValueError(f"must be in {named}" if unit else "must be a number without a unit, or in %")
    return float(found[1]) * factor


def _plain(name: str) -> str:
    return re.sub(r"[\s*·^]", "", name).replace("²", "2").replace("μ", "µ")


@dataclass(frozen=True, slots=True)
class ShownUnit:
    """A unit in which numbers are shown: its name, and how many of it make one in SI."""

    name: str
    per_one: float = 1.0

    def show(self, value: float, digits: int = 4) -> str:
        """A quantity in this unit, ``"0.1016 mm"``."""
        return f"{number(value * self.per_one, digits)} {self.name}".rstrip()


_LARGE = ((1e13, "", 1.0), (1e9, "G", 1e-9), (1e6, "M", 1e-6), (1e4, "k", 1e-3), (0.1, "", 1.0))
_SMALL = ((1e-4, "m", 1e3), (1e-7, "µ", 1e6))
_PREFIXES = {
    "m": (*_LARGE[-1:], *_SMALL, (1e-10, "n", 1e9)), "s": ((1.0, "", 1.0), (1e-3, "m", 1e3), _SMALL[1]),
    "g": ((100.0, "k", 1e-3), *_LARGE[-1:], *_SMALL), "Hz": _LARGE[-2:],
    **dict.fromkeys(("N", "N/m", "Pa", "J", "W"), (*_LARGE, *_SMALL)),
}  # fmt: skip


def shown_unit(largest: float, unit: str = "m") -> ShownUnit:
    """The unit with the prefix in which a quantity is a number of few digits: lengths from 0.1 to 100."""
    if unit == "kg":
        of_grams = shown_unit(1e3 * largest, "g")
        return ShownUnit(of_grams.name, 1e3 * of_grams.per_one) if largest else ShownUnit(unit)
    size = abs(largest)
    fitting = (one for one in _PREFIXES.get(unit, ()) if math.isfinite(size) and 0.0 < size >= one[0])
    _, name, per = next(fitting, (0.0, "", 1.0))
    return ShownUnit(name + unit, per)


def quantity(value: float, unit: str, error: float | None = None, digits: int = 4) -> str:
    """Write a number with its unit, whose prefix is chosen, and its error beside it, if that is known."""
    shown = shown_unit(value, unit)
    if error is None or not math.isfinite(error) or abs(error) < 1e-6 * abs(value):
        return shown.show(value, digits)
    if abs(error) < 1e-3 * abs(value):
        return f"{shown.show(value, digits)} ± {shown_unit(error, unit).show(error, 2)}"
    return f"{number(value * shown.per_one, digits)} ± {shown.show(error, 2)}"


def span(low: float, high: float, unit: str, digits: int = 4) -> str:
    """A range, ``"0.2 to 2.6 Hz"``: both ends in the unit that fits the larger one."""
    shown = shown_unit(max(abs(low), abs(high)), unit)
    return f"{number(low * shown.per_one, digits)} to {shown.show(high, digits)}"


def length(metres: float) -> str:
    """An amplitude [m] in the unit that fits."""
    return quantity(metres, "m")


def hertz(value: float) -> str:
    """A frequency [Hz]."""
    return quantity(value, "Hz")


def number(value: float, digits: int = 4) -> str:
    """A number with so many significant digits: plain, or with a power of ten where it has many zeros."""
    text = f"{value:.{digits}g}"
    if not math.isfinite(value) or 1e-4 <= abs(value) < 1e6 or value == 0.0:
        return f"{float(text):.17g}" if "e" in text else text
    mantissa, _, power = f"{value:.{digits - 1}e}".partition("e")
    return f"{float(mantissa):g}e{int(power)}"


BOUNDS = {
    "greater_than": ("gt", ">"), "greater_than_equal": ("ge", ">="), "less_than_equal": ("le", "<="),
    "less_than": ("lt", "below"),
}  # fmt: skip
"""By pydantic's name of an error, the key of the bound and how it is said."""


def bound_said(found: Mapping[str, Any], unit: str) -> str:
    """Say what pydantic wants of a number in a unit: ``must be below 1.5 rad (86°)``."""
    key, sign = BOUNDS.get(found["type"], ("", ""))
    if not sign:
        return str(found["msg"]).replace("Input should", "must")
    limit = found["ctx"][key]
    degrees = f" ({math.degrees(limit):.0f}°)" if unit == "rad" and limit else ""
    return f"must be {sign} {number(limit)} {unit}".rstrip() + degrees


def doubt_said(value: object, unit: str) -> str:
    """A hint behind an angle that is out of bounds, which may have been given in degrees."""
    return f': in rad, or "{value:g} deg"' if unit == "rad" and isinstance(value, int | float) else ""


def duration(seconds: float) -> str:
    """A time with three digits."""
    return quantity(seconds, "s", digits=3) if math.isfinite(seconds) else "an unknown time"
