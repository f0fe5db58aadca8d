"""What a criterion of a design says of itself: words, units, values with gradients, and limits.

The methods, problem files, REST bodies, options of the command, results, reports and the docs follow from
it. A module of a criterion imports what computes inside its functions: a service that only lists loads none
of it.
"""

from __future__ import annotations

import re
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from enum import Enum
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from optim.criteria.judged import Judged
    from optim.criteria.rows import Row
    from optim.problem.cases import Case
    from solver.scene.scene import Scene

Ranges = tuple[tuple[float, float], ...]
_KEY = re.compile(r"[a-z][a-z0-9_]*")
_FLAG = re.compile(r"--[a-z][a-z0-9-]*")


class Form(Enum):
    """How the option of a key is written."""

    NUMBER = "one number"
    RANGES = "LO HI, repeatable"
    NUMBER_OR_TABLE = "one number, or NAME=NUMBER, repeatable"
    NAMES = "NAME, repeatable"


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Key:
    """A key of problem files, REST bodies and `optim.design`, with its option of the command.

    Attributes
    ----------
    name : str
        The key.
    help : str
        What it means, with its unit; a sentence.
    annotation : type
        Its values in a body: a type that pydantic understands, without None.
    form : Form
        How the option is written.
    flag : str
        The option.
    metavar : str
        What stands behind the option in its help.
    option_help : str
        Help of the option; `help` if empty.
    word : str
        What each name of an option of `Form.NAMES` stands for in the table of the key.
    example : str
        Of the option's text.
    examples : tuple
        Values of the key.
    needs_limit : bool
        Whether it is refused without the key ``limit``.
    """

    name: str
    help: str
    annotation: Any
    form: Form
    flag: str
    metavar: str
    option_help: str = ""
    word: str = ""
    example: str = ""
    examples: tuple[Any, ...] = ()
    needs_limit: bool = False

    def __post_init__(self) -> None:
        if not _KEY.fullmatch(self.name):
            raise ValueError(f"`name` of a key must be such as max_peak, got {self.name!r}")
        if not _FLAG.fullmatch(self.flag):
            raise ValueError(f"`flag` of {self.name} must be such as --max-peak, got {self.flag!r}")


@dataclass(frozen=True, slots=True, kw_only=True)
class Asked:
    """What the keys of a criterion are read in.

    Attributes
    ----------
    scene : Scene
        What is designed.
    cases : tuple of Case
        The responses it is judged by.
    limit : float or None
        Amplitude [m] at which bands are measured.
    values : mapping
        The criterion's keys that were given.
    """

    scene: Scene
    cases: tuple[Case, ...]
    limit: float | None
    values: Mapping[str, object]


def _unscaled(_scene: Scene) -> float:
    return 1.0


def positive_limit(asked: Asked) -> object:
    """Read the one key of a criterion as a number above 0.

    Raises
    ------
    DesignError
        It is none.
    """
    from optim.problem.cases import positive

    ((name, value),) = asked.values.items()
    return positive(name, value)


@dataclass(frozen=True, slots=True, kw_only=True, eq=False, repr=False)
class Criterion:
    """A quantity that designs are judged by: minimised, limited, or both. Two are one if they are the same.

    Attributes
    ----------
    name : str
        The word in results and reports (``quantity`` of a row).
    unit : str
        Of its values.
    help : str
        What it is, a sentence of Markdown.
    rows : callable
        The rows of a response: each smooth number with its gradient, and its second derivatives if the
        solver has them. `Judged.row` makes them.
    smaller_is_better : bool
        If not, rows have its negative (they are kept from above), and it can be limited from below alone.
    weight : str
        The word in `weights` by which it is minimised; empty if it is only limited.
    keys : tuple of Key
        The keys of its limit.
    read : callable
        What its keys that were given come to, as its `rows` use it; raises DesignError.
    ranges : callable or None
        Frequencies [Hz] beyond the band of a case at which it is judged, from what was read; None for the
        response over the band.
    scale : callable
        What an excess over a limit of 0 is relative to, in a scene.
    always : bool
        Whether its rows are wanted if nobody asks: results show them.
    each_blade : bool
        Whether it is that of every blade of a mistuned disk.
    limit_name : str
        How results call its limit.
    with_place : bool
        Whether they say which row has the limit.
    on_a_front : bool
        Whether its limit may be given for a front of peak against band.
    """

    name: str
    unit: str
    help: str
    rows: Callable[[Judged], list[Row]]
    smaller_is_better: bool = True
    weight: str = ""
    keys: tuple[Key, ...] = ()
    read: Callable[[Asked], object] = positive_limit
    ranges: Callable[[Any, Case], Ranges] | None = None
    scale: Callable[[Scene], float] = _unscaled
    always: bool = False
    each_blade: bool = False
    limit_name: str = ""
    with_place: bool = True
    on_a_front: bool = True

    def __post_init__(self) -> None:
        if not self.keys and not self.weight:
            raise ValueError(f"the criterion {self.name!r} must have `keys` of a limit or a `weight`")
        if self.weight and not self.smaller_is_better:
            raise ValueError(f"the criterion {self.name!r} is minimised by its `weight`: smaller is better")
        if self.weight and not _KEY.fullmatch(self.weight):
            raise ValueError(f"`weight` of {self.name!r} must be a word such as peak, got {self.weight!r}")

    def __repr__(self) -> str:
        return f"Criterion({self.name})"

    def limit_words(self, row: Row) -> str:
        """Return the limit of a row in words."""
        bound = row.bound if row.bound is None or self.smaller_is_better else 0.0 - row.bound
        where = f" ({row.what})" if self.with_place else ""
        return f"{self.limit_name or f'{self.name} limit'} of {bound:g} {self.unit}{where}"
