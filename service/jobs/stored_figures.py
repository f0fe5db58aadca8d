"""What is stored of results so that they can be asked for: their figures, each by its name.

A figure is a number, a truth (1 or 0) or a short word. Figures of a part of a result, such as a contact of a
sweep, have its name as their label; a word is its own label.
"""

from __future__ import annotations

import hashlib
import io
import math
import re
from collections.abc import Callable, Iterable, Iterator, Mapping
from dataclasses import dataclass, field, fields
from datetime import datetime
from functools import cache
from typing import (
    TYPE_CHECKING,
    Annotated,
    Any,
    ClassVar,
    NamedTuple,
    Self,
    TypeVar,
    cast,
    get_args,
    get_origin,
    get_type_hints,
)  # fmt: skip

from pydantic import BaseModel

from service.errors import DatabaseError

if TYPE_CHECKING:
    from numpy.typing import NDArray

SWEEP, DESIGN = "sweep", "design"
STATUS = "status"
_LONGEST = 200  # characters of the name of a figure
_WORD = re.compile(r"\S{1,64}")
_PEAK = {"value", "at"}
_F = TypeVar("_F", bound=Callable[..., Any])
_UNIT = re.compile(r"\[([^]]+)\]")


def _once(function: _F) -> _F:
    """`functools.cache`, whose types take no class of a frozen dataclass for one that can be hashed."""
    return cast("_F", cache(function))


class FigureValue(NamedTuple):
    """A figure as it is stored; of a word the value is 0."""

    name: str
    label: str
    value: float


class Quantity(NamedTuple):
    """What a figure is: bool, int, float or str; in words; its unit, empty if it has none."""

    kind: type
    words: str = ""

    @property
    def unit(self) -> str:
        """What stands in brackets in its words."""
        found = _UNIT.search(self.words)
        return "" if found is None else found[1]

    def of(self, value: float | str) -> Any:
        """Return a stored value in its own type."""
        return value if self.kind is str or isinstance(value, str) else self.kind(value)


def figures(table: Mapping[str, Any]) -> Iterator[FigureValue]:
    """Yield what stands alone in the JSON of a result: numbers, truths, single words, peaks, and its status.

    A peak is an object of a `value` and the place it is `at`; that has the figures ``peak`` and ``peak_at``.
    """
    for name, value in table.items():
        if name == "scene" or len(name) > _LONGEST:
            continue
        if isinstance(value, bool | int | float) and math.isfinite(value):
            yield FigureValue(name, "", float(value))
        elif isinstance(value, str) and (name == STATUS or _WORD.fullmatch(value)):
            yield FigureValue(name, value, 0.0)
        elif isinstance(value, Mapping) and value.keys() == _PEAK:
            yield from figures({name: value["value"], f"{name}_at": value["at"]})


_LONGEST_WORDS = 500
_DEEP = 3  # as the worst peak of a robust design lies


def alone(result: Mapping[str, Any]) -> dict[str, Any]:
    """Return the numbers, words and truths in a result that stand alone, by their keys joined by dots.

    Of lists of objects only how many they have, such as ``points.count``, and the one with the least peak,
    such as ``points.peak`` and ``points.at``; curves are no figures. They are stored beside the result: what
    sums it up or compares it with another one does not read it whole.
    """
    return dict(_alone("", result, 1))


def _alone(prefix: str, table: Mapping[str, Any], depth: int) -> Iterator[tuple[str, Any]]:
    for key, value in table.items():
        if isinstance(value, bool | int | float) or (isinstance(value, str) and len(value) <= _LONGEST_WORDS):
            yield f"{prefix}{key}", value
        elif isinstance(value, Mapping) and depth < _DEEP:
            yield from _alone(f"{prefix}{key}.", value, depth + 1)
        elif isinstance(value, list) and all(isinstance(row, Mapping) for row in value):
            yield f"{prefix}{key}.count", len(value)
            if peaks := [row for row in value if isinstance(row.get("peak"), int | float)]:
                least = min(peaks, key=lambda row: float(row["peak"]))
                yield from ((f"{prefix}{key}.{own}", least[own]) for own in ("peak", "at") if own in least)


@dataclass(frozen=True, slots=True, kw_only=True)
class StoredRecord:
    """What of a result can be asked for. Every further field is a figure; those of parts are tuples.

    Attributes
    ----------
    of : what is stored: a sweep, a design, or the kind of the job.
    number, id, job_id, position, owner, created
        Where it is stored, and whose; given there.
    """

    PART: ClassVar[str] = ""
    """What a part is called."""
    PART_TYPE: ClassVar[type[Any] | None] = None

    of: str
    scene_name: str | None
    scene_hash: str | None
    status: str
    number: int = 0
    id: str = ""
    job_id: str = ""
    position: int = 0
    owner: str = ""
    created: datetime | None = None

    def figures(self) -> Iterator[FigureValue]:
        """Yield the figures to store."""
        for name, value in ((one.name, getattr(self, one.name)) for one in _own(type(self))):
            if isinstance(value, str):
                yield FigureValue(name, value, 0.0)
                continue
            if not isinstance(value, tuple):
                yield from figures({name: value})
                continue
            for position, part in enumerate(value):
                yield FigureValue(self.PART, part.name, float(position))
                for key in part_names(type(self)):
                    if (number := getattr(part, key)) is not None:
                        yield FigureValue(key, part.name, number)

    @classmethod
    def stored(cls, head: Mapping[str, Any], found: Iterable[tuple[str, str, float]]) -> Self:
        """Return what was stored: the fields of every record, and its figures; None for one that is not."""
        parts: dict[str, dict[str, Any]] = {}
        values: dict[str, Any] = {}
        inside = {cls.PART, *part_names(cls)}
        for name, label, value in found:
            if label and name in inside:
                parts.setdefault(label, dict.fromkeys(part_names(cls)))[name] = value
            else:
                values[name] = label or value
        known = quantities_of_record(cls)
        given: dict[str, Any] = {
            name: None if name not in values else quantity.of(values[name])
            for name, quantity in known.items()
        }
        if cls.PART_TYPE is not None:
            in_order = sorted(parts.items(), key=lambda item: item[1].pop(cls.PART))
            given[f"{cls.PART}s"] = tuple(cls.PART_TYPE(name=name, **one) for name, one in in_order)
        return cls(**head, **given)


@dataclass(frozen=True, slots=True, kw_only=True)
class KindRecord(StoredRecord):
    """The figures of the result of a job, of whatever kind."""

    values: tuple[FigureValue, ...] = ()

    def figures(self) -> Iterator[FigureValue]:
        """Yield the figures to store."""
        yield from self.values

    @classmethod
    def stored(cls, head: Mapping[str, Any], found: Iterable[tuple[str, str, float]]) -> Self:
        """Return what was stored."""
        return cls(**head, values=tuple(FigureValue(*one) for one in found))


@dataclass(frozen=True, slots=True, kw_only=True)
class ContactValues:
    """The values of a contact during a sweep; None where the value is swept or its law has none."""

    name: str
    kt: Annotated[float | None, "Tangential stiffness [N/m]."]
    mu: Annotated[float | None, "Friction coefficient."]
    N0: Annotated[float | None, "Mean normal load [N]."]
    N1: Annotated[float | None, "Amplitude of the normal load [N]."]
    N1_phase: Annotated[float | None, "Phase of the normal load [rad]."]


@dataclass(frozen=True, slots=True, kw_only=True)
class StoredArray:
    """An array as it is stored: NumPy's npy bytes, never pickle, and their SHA-256 in hexadecimal.

    Of one outside of the database a row has the `size` [bytes] in place of the bytes.
    """

    sha256: str
    data: bytes
    size: int | None = None

    @classmethod
    def of_bytes(cls, data: bytes) -> Self:
        """Return bytes with their checksum."""
        return cls(sha256=hashlib.sha256(data).hexdigest(), data=data)

    @classmethod
    def of(cls, array: NDArray[Any]) -> Self:
        """Return an array of numbers as bytes; one of objects is an error of the program (ValueError)."""
        import numpy as np

        buffer = io.BytesIO()
        np.save(buffer, np.ascontiguousarray(array), allow_pickle=False)
        return cls.of_bytes(buffer.getvalue())

    def array(self) -> NDArray[Any]:
        """Return the array (DatabaseError if the bytes are not those that were stored)."""
        import numpy as np

        if hashlib.sha256(self.data).hexdigest() != self.sha256:
            raise DatabaseError("a stored array does not match its checksum: the database is damaged")
        found: NDArray[Any] = np.load(io.BytesIO(self.data), allow_pickle=False)
        return found


@dataclass(frozen=True, slots=True, kw_only=True)
class SweepRecord(StoredRecord):
    """A branch to be stored. Its `error_estimate` and `peaks_known` are None of earlier versions."""

    PART, PART_TYPE = "contact", ContactValues

    of: str = SWEEP
    scene_name: str
    scene_hash: str
    parameter: Annotated[str, "Path of the parameter that was swept."]
    from_value: Annotated[float, "Its first value."]
    to_value: Annotated[float, "Its last value."]
    frequency_hz: Annotated[float | None, "Excitation frequency [Hz], if another parameter was swept."]
    excitation_amplitude: Annotated[float | None, "Amplitude of the excitation [N]."]
    harmonics: Annotated[int, "Highest harmonic kept."]
    points: Annotated[int, "Points of the branch."]
    peak: Annotated[float | None, "Highest amplitude [m]."]
    peak_at: Annotated[float | None, "Value of the parameter there."]
    limit: Annotated[float | None, "Amplitude that bounds the resonance band [m]."]
    band_hz: Annotated[float | None, "Width of the resonance band [Hz]."]
    newton_iterations: Annotated[int, "Newton iterations."]
    rejected_steps: Annotated[int, "Steps that were taken back."]
    seconds: Annotated[float, "Time to compute it [s]."]
    completed: Annotated[bool, "Whether it came to its end."]
    error_estimate: Annotated[float | None, "Estimated error of the highest peak [m]."] = None
    peaks_known: Annotated[bool | None, "Whether no higher peak hides between two points."] = None
    intermediate: Annotated[bool, "Whether it was computed on the way to another result."] = False
    contacts: tuple[ContactValues, ...] = ()
    arrays: Mapping[str, StoredArray] = field(default_factory=dict)


@dataclass(frozen=True, slots=True, kw_only=True)
class VariableValues:
    """A variable of a design: its best value (None if no design could be computed) and its bounds."""

    name: str
    value: Annotated[float | None, "Best value."]
    low: Annotated[float, "Lower bound."]
    high: Annotated[float, "Upper bound."]


@dataclass(frozen=True, slots=True, kw_only=True)
class DesignRecord(StoredRecord):
    """A design to be stored."""

    PART, PART_TYPE = "variable", VariableValues

    of: str = DESIGN
    scene_name: str
    scene_hash: str
    method: Annotated[str, "Method of the search."]
    robust: Annotated[bool, "Whether it is the best in the worst case of uncertain parameters."]
    reached: Annotated[bool, "Whether the goal was reached."]
    feasible: Annotated[bool, "Whether it keeps every limit."]
    objective: Annotated[float | None, "What was minimised."]
    peak: Annotated[float | None, "Highest peak [m]."]
    peak_at: Annotated[float | None, "Its frequency [Hz]."]
    limit: Annotated[float | None, "Amplitude that bounds the resonance band [m]."]
    band_hz: Annotated[float | None, "Width of the resonance band [Hz]."]
    harmonics: Annotated[int, "Highest harmonic kept."]
    evaluations: Annotated[int, "Designs that were computed."]
    work: Annotated[float | None, "What the search cost, in frequency responses."]
    seconds: Annotated[float, "Time to compute it [s]."]
    variables: tuple[VariableValues, ...] = ()


RECORDS: Mapping[str, type[StoredRecord]] = {SWEEP: SweepRecord, DESIGN: DesignRecord}
"""What is stored in records of its own; of other kinds the figures of the result."""


@_once
def _own(record: Any) -> list[Any]:
    shared = {one.name for one in fields(StoredRecord)}
    return [one for one in fields(record) if one.name not in shared and one.name != "arrays"]


@_once
def quantities_of_record(record: Any) -> dict[str, Quantity]:
    """Return the figures of a kind of records, or of a part of one, by name."""
    hints = get_type_hints(record, include_extras=True)
    return {
        name: Quantity(_plain(get_args(hint)[0]), get_args(hint)[1])
        for name, hint in hints.items()
        if get_origin(hint) is Annotated
    }  # fmt: skip


@_once
def part_names(record: Any) -> tuple[str, ...]:
    """Return the names of the figures of its parts."""
    return () if record.PART_TYPE is None else tuple(quantities_of_record(record.PART_TYPE))


@_once
def quantities_of_model(model: type[BaseModel] | None) -> dict[str, Quantity]:
    """Return the figures that a model of results declares, by name; of several models in one all of them."""
    found: dict[str, Quantity] = {}
    for name, given in () if model is None else model.model_fields.items():
        words = given.description or ""
        if (kind := _plain(given.annotation)) in (bool, int, float, str):
            found[name] = Quantity(kind, words)
            continue
        for one in _members(given.annotation):
            if isinstance(one, type) and issubclass(one, BaseModel):
                if one.model_fields.keys() == _PEAK:
                    found |= {name: Quantity(float, words), f"{name}_at": Quantity(float)}
                elif name == "root":
                    found |= quantities_of_model(one)
    return found


def _members(hint: Any) -> tuple[Any, ...]:
    """The members of a union; of anything else itself."""
    args = get_args(hint)
    return args if args and get_origin(hint) not in (list, dict, tuple, Annotated) else (hint,)


def _plain(hint: Any) -> Any:
    """A type that may be None, without that; nothing if it may be several."""
    rest = [one for one in _members(hint) if one is not type(None)]
    return rest[0] if len(rest) == 1 else float if {int, float} == set(rest) else None
