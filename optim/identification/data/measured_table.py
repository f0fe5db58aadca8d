"""A table of measured numbers in SI units, the units of columns, and the checks all kinds of data share.

Of motions units may be by a force, and RMS or peak to peak.
"""

from __future__ import annotations

import math
import re
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace
from enum import Enum
from itertools import pairwise
from typing import Annotated

import numpy as np

from optim.problem.checks import DataError
from optim.problem.variables import Real
from solver.errors import Place
from solver.jit.fourier import Integer
from solver.wording import listing

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


class Scaling(Enum):
    """What of an oscillation a number is; the value is the word behind a unit."""

    PEAK = "pk"
    RMS = "rms"
    PEAK_TO_PEAK = "pk-pk"

    @property
    def to_peak(self) -> float:
        """The amplitude of one harmonic over it."""
        return {Scaling.PEAK: 1.0, Scaling.RMS: math.sqrt(2.0), Scaling.PEAK_TO_PEAK: 0.5}[self]


@dataclass(frozen=True, slots=True, kw_only=True)
class Unit:
    """How a column becomes SI."""

    factor: Annotated[float, "Of its numbers, to Hz, m, deg, N or s and their derivatives."] = 1.0
    order: Annotated[int, "0 of a displacement, 1 of a velocity, 2 of an acceleration."] = 0
    per_force: Annotated[bool, "Whether it is a motion for each newton of excitation."] = False
    scaling: Annotated[Scaling | None, "What of the oscillation it says it is; of the factor as well."] = None


_PLAIN = {
    Dimension.FREQUENCY: {"Hz": 1.0, "kHz": 1e3, "rad/s": 0.5 / math.pi, "1/min": 1.0 / 60.0},
    Dimension.LENGTH: _LENGTHS,
    Dimension.ANGLE: {"deg": 1.0, "°": 1.0, "rad": 180.0 / math.pi},
    Dimension.FORCE: {"N": 1.0, "mN": 1e-3, "kN": 1e3, "lbf": 4.4482216152605},
    Dimension.TIME: {"s": 1.0, "ms": 1e-3, "us": 1e-6, "µs": 1e-6},
    Dimension.NUMBER: {"": 1.0, "1": 1.0},
}  # fmt: skip
_FORCES = _PLAIN[Dimension.FORCE]
_SPELLED = {
    "grad": "deg",
    "degree": "deg",
    "degrees": "deg",
    "upm": "1/min",
    "u/min": "1/min",
    "rpm": "1/min",
    "hz": "Hz",
}
_SCALINGS = (
    (
        re.compile(r"[\s_-]*\(?\b(?:pk|peak|p)[\s-]?(?:to|2)?[\s-]?(?:pk|peak|p)\b\)?$", re.IGNORECASE),
        Scaling.PEAK_TO_PEAK,
    ),
    (re.compile(r"[\s_-]*\(?\b(?:rms|eff)\b\)?$", re.IGNORECASE), Scaling.RMS),
    (re.compile(r"[\s_-]*\(?\b(?:0[\s-]?)?(?:pk|peak)\b\)?$", re.IGNORECASE), Scaling.PEAK),
)
_OF_NO_MOTION = (
    (re.compile(r"(?:²|\^?2|rms2?)\)?\s*/\s*\(?Hz|/\s*(?:sqrt\(|√)\s*Hz", re.I), "a spectral density"),
    (re.compile(r"dB", re.IGNORECASE), "a level in decibels"),
    (re.compile(r"^\(?[µμumcn]?(?:m|g|in)(?:²|\^?2)(?:[/)]|$)|^\(.*\)(?:²|\^?2)$"), "the square of a motion"),
    (re.compile(r"^(\(?(?:g|[µμumcn]?m/s.*?)\)?)/\1$"), "a transmissibility, a motion over a motion"),
)  # fmt: skip


def known_units(dimension: Dimension) -> tuple[str, ...]:
    """Return the units a column of this dimension may name; of motions by a force, some of them."""
    if dimension is Dimension.MOTION:
        return (*_LENGTHS, "m/s", "mm/s", "m/s2", "mm/s2", "g", "m/N", "mm/kN", "m/s2/N", "g/N", "in/lbf")
    return tuple(_PLAIN[dimension])


def unit_of(dimension: Dimension, text: str | None) -> Unit | None:
    """Return the unit that a column names, its own if it names none; None for an unknown one.

    A motion may be by a force, ``mm/kN`` or ``(m/s²)/N``, and say that it is RMS or peak to peak, ``g rms``:
    of one harmonic √2 times and half of it are the amplitude.
    """
    if text is None:
        return Unit()
    if dimension is not Dimension.MOTION:
        factor = _PLAIN[dimension].get(_SPELLED.get(text.lower(), text))
        return None if factor is None else Unit(factor=factor)
    scaling = None
    for pattern, each in _SCALINGS:
        if match := pattern.search(text):
            text, scaling = text[: match.start()], each
            break
    found = _motion(text)
    if found is None or scaling is None:
        return found
    if found.per_force:  # a ratio is the same of amplitudes and of RMS values: it says that of one of both
        return None
    return Unit(
        factor=found.factor * scaling.to_peak, order=found.order, per_force=found.per_force, scaling=scaling
    )


def _motion(text: str) -> Unit | None:
    """Return the unit of a motion, or of one over a force."""
    plain = re.sub(r"\s+|\^|\*\*", "", text).replace("²", "2")
    # Of m/(s2·N) as of (m/s2)/N all that stands below a line divides.
    plain = re.sub(r"/\(([^()]*)\)", lambda match: "/" + re.sub(r"[·*./]", "/", match[1]), plain)
    first, *below = re.sub(r"[()]", "", plain).split("/")
    order = 2 if first == "g" else 0
    factor = _STANDARD_GRAVITY if first == "g" else _LENGTHS.get(first)
    if factor is None:
        return None
    forces = [_FORCES[part] for part in below if part in _FORCES]
    order += sum({"s": 1, "s2": 2}.get(part, 0) for part in below)
    known = all(part in _FORCES or part in ("s", "s2") for part in below)
    if (
        not known
        or len(forces) > 1
        or order > 2
        or (first == "g" and order == 2 and len(below) > len(forces))
    ):
        return None
    return Unit(factor=factor / (forces[0] if forces else 1.0), order=order, per_force=bool(forces))


def any_unit(text: str) -> bool:
    """Whether a text is a unit of any column."""
    return any(unit_of(dimension, text) for dimension in Dimension) or no_motion(text) is not None


def no_motion(text: str) -> str | None:
    """Return what a unit says that is not a motion: a spectral density, decibels; None of others."""
    return next((what for pattern, what in _OF_NO_MOTION if pattern.search(text.strip())), None)


def wanted_unit(dimension: Dimension, text: str | None) -> str:
    """Return what is wrong with a unit that is none of this dimension, and what would be right."""
    known = f"must be in {listing(known_units(dimension))}"
    if dimension is not Dimension.MOTION or not text or (what := no_motion(text)) is None:
        return known
    return f"is {what}, not a motion at a DOF: give displacements, velocities or accelerations; it {known}"


_HEAD = re.compile(r"^\s*(?P<name>[^\[\]]*?)\s*(?:\[\s*(?P<unit>[^\[\]]*?)\s*\])?\s*$")


def split_head(text: str) -> tuple[str, str | None]:
    """Return name and unit of a column head, ``amplitude [mm]``; no unit is None."""
    match = _HEAD.match(text)
    if match is None:
        return text.strip(), None
    return match["name"], match["unit"]


@dataclass(frozen=True, slots=True, kw_only=True)
class Table:
    """Rows measured under conditions."""

    source: Annotated[str, "The file, or the place in a description; messages begin with it."]
    columns: Annotated[Mapping[str, Real], "Name to (n,) numbers, in Hz, m (or m/s, m/s²), deg, N, s."]
    units: Annotated[Mapping[str, Unit], "Name to what unit it had, of columns of a motion."] = field(
        default_factory=dict
    )
    path_units: Annotated[Mapping[str, str], "Unit that a column of a parameter path names."] = field(
        default_factory=dict
    )
    conditions: Annotated[
        Mapping[str, float],
        "Parameter path to the value it had for all rows; a column named as a path has a value for each row.",
    ] = field(default_factory=dict)
    words: Annotated[Mapping[str, str], "What else the head says: ``dof``, ``contact``, ``kind``."] = field(
        default_factory=dict
    )
    lines: Annotated[Integer, "Line of each row in the file, (n,); empty where there are no lines."] = field(
        default_factory=lambda: np.zeros(0, np.int64)
    )
    place: Annotated[Place, "Where it stands in a description."] = ("data",)

    def __len__(self) -> int:
        return len(next(iter(self.columns.values()), ()))

    def line(self, row: int) -> int | None:
        """Return the line of a row, if it has one."""
        return int(self.lines[row]) if row < self.lines.size else None

    def error(self, row: int, column: str, wanted: str, value: object = None) -> DataError:
        """Return the refusal of a number."""
        shown = float(self.columns[column][row]) if value is None else value
        source = self.source if self.lines.size else f"{self.source}, row {row}"
        return DataError(source, shown, wanted, line=self.line(row), column=column, place=self.place)

    def refusal(self, value: object, wanted: str, column: str = "") -> DataError:
        """Return the refusal of the whole, or of a column."""
        return DataError(self.source, value, wanted, column=column, place=self.place)

    def need(self, fewest: int, what: str) -> None:
        """Raise DataError unless there are so many rows."""
        if len(self) < fewest:
            raise self.refusal(f"{len(self)} rows", f"must have at least {fewest} {what}")

    def number(self, word: str, default: float) -> float:
        """Return a number of the head.

        Raises
        ------
        DataError
            It is no number > 0.
        """
        text = self.words.get(word)
        if text is None:
            return default
        try:
            value = float(text)
        except ValueError:
            value = math.nan
        if not (math.isfinite(value) and value > 0.0):
            raise self.refusal(text, f"`{word}` must be a number > 0")
        return value


def check_numbers(table: Table) -> None:
    """Raise DataError at the first number that is none, or infinite; and for no rows at all."""
    if not len(table):
        raise table.refusal("0 rows", "must have rows of numbers")
    for name, values in table.columns.items():
        if len(values) != len(table):
            wanted = f"must have {len(table)} numbers as the other columns"
            raise table.refusal(len(values), wanted, name)
        bad = np.flatnonzero(~np.isfinite(values))
        if bad.size:
            raise table.error(
                int(bad[0]), name, "must be a finite number: leave the whole row out if it is missing"
            )


def check_sign(table: Table, column: str, *, positive: bool) -> None:
    """Raise DataError at the first number below 0, or not above."""
    values = table.columns[column]
    bad = np.flatnonzero(values <= 0.0 if positive else values < 0.0)
    if bad.size:
        raise table.error(int(bad[0]), column, "must be > 0" if positive else "must be >= 0")


def check_monotone(table: Table, column: str) -> None:
    """Raise DataError where a column turns back or repeats itself."""
    steps = np.diff(table.columns[column])
    way = np.sign(steps[0]) if steps.size else 1.0
    bad = np.flatnonzero(steps * way <= 0.0) if way != 0.0 else np.zeros(1, np.int64)
    if bad.size:
        wanted = (
            "must go on upward or downward as the sweep did: sort the rows, average repeated ones, and put "
            "sweeps there and back into runs of their own"
        )
        raise table.error(int(bad[0]) + 1, column, wanted)


def runs_of(table: Table, paths: Sequence[str]) -> Iterator[Table]:
    """Yield the rows of each run: those that follow each other under the same conditions, columns `paths`."""
    if not paths:
        yield table
        return
    values = np.column_stack([table.columns[path] for path in paths])
    changes = np.flatnonzero(np.any(np.diff(values, axis=0) != 0.0, axis=1)) + 1
    ends = [0, *changes.tolist(), len(table)]
    for first, end in pairwise(ends):
        kept = {name: column[first:end] for name, column in table.columns.items() if name not in paths}
        here = {path: float(values[first, i]) for i, path in enumerate(paths)}
        yield replace(
            table, columns=kept, conditions={**table.conditions, **here}, lines=table.lines[first:end],
            source=table.source,
        )  # fmt: skip
