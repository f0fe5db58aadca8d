"""Numbers of a description, checked; what is refused names its field."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from enum import Enum
from typing import TypeGuard, TypeVar

from optim.errors import DesignError
from solver.errors import Place

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


def whole(name: str | Place, value: object, *, least: int) -> int:
    """Return a whole number from `least` on.

    Raises
    ------
    DesignError
        Anything else.
    """
    if isinstance(value, bool) or not isinstance(value, int) or value < least:
        raise DesignError(name, value, f"must be a whole number >= {least}")
    return value


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
