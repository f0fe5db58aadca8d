"""Words and numbers of a description, checked; what is refused names its field."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from enum import Enum
from numbers import Integral
from typing import Literal, TypeGuard, TypeVar

from solver.errors import Issue, Place, SettingError


class DesignError(SettingError):
    """A design problem that cannot be posed; the message names the argument and what would be right.

    Parameters
    ----------
    name : the argument, or the keys and indices that lead to a part of it: ``("cases", 0, "band")`` is called
        ``cases[0].band``.
    value : what was given.
    wanted : what would be right.
    place : where that stands, if not where the name says.
    """

    def __init__(self, name: str | Place, value: object, wanted: str, *, place: Place | None = None) -> None:
        super().__init__(name, value, wanted)
        self.place = self.issue.subject if place is None else place
        self.args = (self.issue.said(self.name),)


class DataError(DesignError):
    """Measured data that cannot be used; the message names the file, the line and what would be right.

    Parameters
    ----------
    source : the file, or the place in a description.
    value : what stands there.
    wanted : what would be right.
    line : of the file, counted from 1.
    column : its name.
    place : where the run stands in a description, ``("data", 0)``.
    """

    def __init__(
        self, source: str, value: object, wanted: str, *, line: int | None = None, column: str = "",
        place: Place = ("data",),
    ) -> None:  # fmt: skip
        where = source + (f", line {line}" if line is not None else "") + (f", `{column}`" if column else "")
        super().__init__("data", value, wanted, place=place)
        self.source, self.line, self.column = source, line, column
        self.issue = Issue(place, f"{where}: {wanted}", value, named=False)
        self.args = (self.issue.said(),)


MethodWord = Literal["auto", "tracked", "minimax", "ipopt", "performance-curve"]
ScalingWord = Literal["auto", "linear", "logarithmic"]
AimWord = Literal["worst-case", "mean", "quantile"]


class Method(Enum):
    """How the optimum is searched; the value is the word users write."""

    AUTO = "auto"
    TRACKED = "tracked"
    MINIMAX = "minimax"
    IPOPT = "ipopt"
    PERFORMANCE_CURVE = "performance-curve"


class Scaling(Enum):
    """Whether equal steps or equal ratios of a variable count equally; AUTO chooses by the bounds."""

    AUTO = "auto"
    LINEAR = "linear"
    LOGARITHMIC = "logarithmic"


class Aim(Enum):
    """Over the uncertainty, what is minimised; the value is the word users write."""

    WORST_CASE = "worst-case"
    MEAN = "mean"
    QUANTILE = "quantile"


Chosen = TypeVar("Chosen", bound=Enum)


def is_number(value: object) -> TypeGuard[float]:
    """Return whether a value is a finite number."""
    return isinstance(value, (int, float)) and not isinstance(value, bool) and math.isfinite(value)


def number_pair(name: str | Place, pair: object) -> tuple[float, float]:
    """Return two finite numbers.

    Raises
    ------
    DesignError
        Anything else.
    """
    if not isinstance(pair, Sequence) or isinstance(pair, str) or len(pair) != 2:
        raise DesignError(name, pair, "must be two numbers, low and high")
    for value in pair:
        if not is_number(value):
            raise DesignError(name, pair, "must be two finite numbers, low and high")
    return float(pair[0]), float(pair[1])


def range_above_zero(name: str | Place, pair: object, unit: str = "") -> tuple[float, float]:
    """Return two numbers with 0 < low < high.

    Raises
    ------
    DesignError
        Anything else.
    """
    low, high = number_pair(name, pair)
    if not 0.0 < low < high:
        raise DesignError(name, pair, f"must have 0 < low < high{unit}")
    return low, high


def share(name: str | Place, value: object) -> float:
    """Return a number between 0 and 1.

    Raises
    ------
    DesignError
        Anything else.
    """
    if not is_number(value) or not 0.0 < value < 1.0:
        raise DesignError(name, value, "must be a number between 0 and 1")
    return float(value)


def word(name: str | Place, value: object, words: type[Chosen]) -> Chosen:
    """Return the member of an enum that a word, or itself, stands for.

    Raises
    ------
    DesignError
        Anything else.
    """
    known = [one.value for one in words]
    if not isinstance(value, words) and value not in known:
        raise DesignError(name, value, f"must be one of {', '.join(known)}")
    return words(value)


def whole(name: str | Place, value: object, *, least: int, most: int | None = None, more: str = "") -> int:
    """Return a whole number from `least` on, up to `most`.

    Raises
    ------
    DesignError
        Anything else; `more` says what it is.
    """
    found = int(value) if isinstance(value, Integral) and not isinstance(value, bool) else None
    if found is None or found < least or (most is not None and found > most):
        wanted = f">= {least}" if most is None else f"from {least} to {most}"
        raise DesignError(name, value, f"must be a whole number {wanted}{more}")
    return found


def positive(name: str | Place, value: object) -> float:
    """Return a finite number above 0.

    Raises
    ------
    DesignError
        Anything else.
    """
    if not is_number(value) or value <= 0.0:
        raise DesignError(name, value, "must be a number > 0")
    return float(value)


def positive_of_each(
    key: str, given: object, known: Sequence[str], all_of_them: Sequence[str], what: str
) -> Mapping[str, float]:
    """Return a positive number for every name in a table; a single number is that of `all_of_them`.

    Raises
    ------
    DesignError
        A name that is not known, of what `what` says, or no positive number.
    """
    if not isinstance(given, Mapping):
        return dict.fromkeys(all_of_them, positive(key, given))
    for name in given:
        if name not in known:
            raise DesignError(key, name, f"must name {what}: {', '.join(known)}", place=(key, name))
    return {name: positive((key, name), value) for name, value in given.items()}
