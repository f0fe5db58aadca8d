"""Universal files: responses over the frequency in data sets 58 and 58b, as modal analysers write them.

Fields and units after the descriptions of data sets 58, 58b and 164 of the University of Cincinnati
(SDRL, https://www.ceas3.uc.edu/sdrluff/). A label of units goes before the units of data set 164, by whose
factors numbers are divided to be SI; without either they are SI. Record 10 with type 0 says that the ordinate
has no denominator. A function along −X is turned round to be along +X.
"""

from __future__ import annotations

import re
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Annotated

import numpy as np

from optim.identification.data.measured_table import Dimension, Table, Unit, unit_of, wanted_unit
from optim.identification.readers.data_readers import DataFormat, complex_apart, read_head, table_of
from optim.identification.readers.text_layout import decoded
from optim.problem.checks import DataError
from optim.problem.variables import Real
from solver.jit.fourier import Complex

_FUNCTIONS = (
    "general or unknown", "time response", "auto spectrum", "cross spectrum", "frequency response function",
    "transmissibility", "coherence", "auto correlation", "cross correlation", "power spectral density",
    "energy spectral density", "probability density", "spectrum", "cumulative frequency distribution",
    "peaks and valleys", "stress over cycles", "strain over cycles", "orbit", "mode indicator function",
    "force pattern", "partial power", "partial coherence", "eigenvalue", "eigenvector",
    "shock response spectrum",
    "finite impulse response filter", "multiple coherence", "order function",
)  # fmt: skip
_GENERAL, _RESPONSE, _SPECTRUM = 0, 4, 12
_FREQUENCY, _FORCE, _NOT_USED = 18, 13, 0  # specific data types of an axis
_AXES = {
    0: "unknown", 1: "general", 2: "stress", 3: "strain", 5: "temperature", 6: "heat flux", 8: "displacement",
    9: "reaction force", 11: "velocity", 12: "acceleration", 13: "excitation force", 15: "pressure",
    16: "mass",
    17: "time", 18: "frequency", 19: "rpm", 20: "order",
}  # fmt: skip
_ORDERS = {8: 0, 11: 1, 12: 2}
_UNKNOWN, _LAST_TRANSLATION = (0, 1), 3
_DIRECTIONS = ("scalar", "X", "Y", "Z", "RX", "RY", "RZ")
_REAL, _COMPLEX, _SINGLE = (2, 4), (5, 6), (2, 5)
_END = b"    -1"
_HEADS = 11  # records before the numbers
_NUMBER = re.compile(r"[+-]?(?:\d+\.?\d*|\.\d+)(?:[eEdD][+-]?\d+)?")


@dataclass(frozen=True, slots=True, kw_only=True)
class _Axis:
    kind: Annotated[int, "Specific data type."]
    unit: Annotated[str, "Label of its unit; empty if there is none."]


@dataclass(frozen=True, slots=True, kw_only=True)
class _Function:
    """A function of data set 58."""

    source: str
    titles: Annotated[dict[int, str], "Its five lines."]
    function: int
    node: int
    direction: int
    reference: tuple[int, int]
    abscissa: _Axis
    ordinate: _Axis
    denominator: _Axis
    frequency: Real
    data: Real | Complex
    system: Annotated[tuple[float, float] | None, "Lengths and forces of data set 164 in one of SI."]

    def refusal(self, value: object, wanted: str, column: str) -> DataError:
        """Return the refusal of what stands in a column."""
        return DataError(self.source, value, wanted, column=column)

    @property
    def place(self) -> dict[str, str]:
        """What tells it from others of a file, in the words that choose it."""
        node, direction = self.reference
        return {
            "function": _name(self.function), "node": str(self.node), "direction": _along(self.direction),
            "reference": f"{node} {_along(direction)}",
        }  # fmt: skip


def _name(function: int) -> str:
    return _FUNCTIONS[function] if 0 <= function < len(_FUNCTIONS) else f"type {function}"


def _along(direction: int) -> str:
    return _DIRECTIONS[abs(direction)] if abs(direction) < len(_DIRECTIONS) else str(direction)


def read_universal(path: Path, paths: frozenset[str], words: Mapping[str, str] | None = None) -> list[Table]:
    """Read the responses of one place; conditions stand in the five title lines of each.

    Parameters
    ----------
    path, paths : of the file, and what its titles may set.
    words : which of several functions are meant, of the keys of `FORMAT.words`.

    Raises
    ------
    DataError
        No such function, functions of several places, or one that is no response in one DOF.
    """
    try:
        functions = list(_functions(path.name, path.read_bytes()))
    except OSError as error:
        raise DataError(path.name, str(error), "must be a universal file") from error
    if not functions:
        raise DataError(path.name, "none", "must be a universal file with a function of data set 58")
    chosen = [one for one in functions if all(_is(one, key, value) for key, value in (words or {}).items())]
    if not chosen:
        said = ",".join(f"{key}={value}" for key, value in (words or {}).items())
        raise DataError(path.name, said, f"must choose one of {_listed(functions)}")
    for key in FORMAT.words:
        several = dict.fromkeys(one.place[key] for one in chosen)
        if len(several) > 1:
            example = next((one.place for one in chosen if one.function == _RESPONSE), chosen[0].place)[key]
            wanted = (
                f"has functions that differ in `{key}`: choose one by {path.name}:{key}={example}; it has "
                f"{_listed(chosen)}"
            )
            raise DataError(path.name, ", ".join(several), wanted)
    return [_table(one, paths) for one in chosen]


def _is(one: _Function, key: str, value: str) -> bool:
    number = str(one.function) if key == "function" else str(one.reference[0]) if key == "reference" else ""
    short = {"frf": _name(_RESPONSE), "psd": _name(9)}.get(value.lower(), value.lower())
    return short in (one.place[key].lower(), number) or value.lower().lstrip("+-") == one.place[key].lower()


def _listed(functions: Sequence[_Function]) -> str:
    told = dict.fromkeys(", ".join(f"{key}={value}" for key, value in one.place.items()) for one in functions)
    return "; ".join([*told][:20]) + (f"; and {len(told) - 20} more" if len(told) > 20 else "")


def _functions(name: str, raw: bytes) -> Iterator[_Function]:
    """Yield the functions of a file, each in the units that were last said before it."""
    if b"\x00" in raw[:8]:  # in UTF-16 no data are binary
        raw = decoded(raw).encode()
    system, at, number = None, 0, 0
    while (opened := _next_end(raw, at)) is not None:
        at = opened
        first, at = _line(raw, at)
        kind = first[:6].strip()
        if kind == "58":
            number += 1
            one, at = _function(
                f"{name}, function {number}", raw, at, first[6:7].lower() == "b", first, system
            )
            yield one
        elif kind == "164":
            _, after = _line(raw, at)
            end = _next_end(raw, after)
            factors = _NUMBER.findall(raw[after:end].decode("ascii", "replace").partition("    -1")[0])
            length, force = (
                (float(text.upper().replace("D", "E")) for text in factors[:2])
                if len(factors) > 1
                else (0.0, 0.0)
            )
            if not (length > 0.0 and force > 0.0):
                raise DataError(f"{name}, data set 164", factors, "must have factors > 0 of length and force")
            system = (length, force)
        closed = _next_end(raw, at)
        at = len(raw) if closed is None else closed


def _next_end(raw: bytes, at: int) -> int | None:
    """Return where the line behind the next one with −1 begins."""
    while at < len(raw):
        text, after = _line(raw, at)
        if text.rstrip() == "    -1":
            return after
        at = after
    return None


def _line(raw: bytes, at: int) -> tuple[str, int]:
    end = raw.find(b"\n", at)
    end = len(raw) if end < 0 else end
    return decoded(raw[at:end].rstrip(b"\r")), end + 1


def _function(
    source: str, raw: bytes, at: int, binary: bool, first: str, system: tuple[float, float] | None
) -> tuple[_Function, int]:
    """Read a function from its first title line on; return it and where its numbers end."""
    records = []
    for _ in range(_HEADS):
        text, at = _line(raw, at)
        records.append(text)
    try:
        place, form = records[5].ljust(80), records[6].ljust(80)
        function, node, direction = int(place[:5]), int(place[41:51]), int(place[51:55])
        reference = int(place[66:76] or 0), int(place[76:80] or 0)
        kind, count, even = (int(form[i : i + 10]) for i in (0, 10, 20))
        start, step = float(form[30:43]), float(form[43:56])
        axes = [
            _Axis(kind=int(text[:10]), unit=unit if (unit := text.ljust(80)[47:67].strip()) != "NONE" else "")
            for text in records[7:10]
        ]
    except ValueError as error:
        raise DataError(source, str(error), "must have records 6 to 10 as data set 58 has them") from error
    if kind not in (*_REAL, *_COMPLEX):
        raise DataError(source, kind, "must have ordinates of the type 2, 4, 5 or 6")
    parts = 2 if kind in _COMPLEX else 1
    if binary:
        numbers, at = _binary(source, raw, at, first, count, parts, single=kind in _SINGLE, even=bool(even))
    else:
        end = at
        while end < len(raw) and _line(raw, end)[0].rstrip() != "    -1":
            end = _line(raw, end)[1]
        found = _NUMBER.findall(raw[at:end].decode("ascii", "replace"))
        numbers, at = np.array([float(text.upper().replace("D", "E")) for text in found]), end
    wide = parts + (not even)
    if count < 1 or numbers.size != count * wide:
        raise DataError(
            source, numbers.size, f"must have {count * wide} numbers, {count} of {wide}, as record 7 says"
        )
    rows = numbers.reshape(count, wide)
    x = start + step * np.arange(count) if even else rows[:, 0]
    y = rows[:, -parts:]
    one = _Function(
        source=source, titles=dict(enumerate(records[:5], start=1)), function=function, node=node,
        direction=direction, reference=reference, abscissa=axes[0], ordinate=axes[1], denominator=axes[2],
        frequency=np.asarray(x, np.float64), data=y[:, 0] + 1j * y[:, 1] if parts == 2 else y[:, 0],
        system=system,
    )  # fmt: skip
    return one, at


def _binary(
    source: str, raw: bytes, at: int, first: str, count: int, parts: int, *, single: bool, even: bool
) -> tuple[Real, int]:  # fmt: skip
    """Return numbers in binary and where they end: the length that a file says of them is wrong in many."""
    order, form = (first[7 + 6 * i : 13 + 6 * i].strip() for i in range(2))
    if form not in ("2", ""):
        raise DataError(
            source,
            form,
            "must have numbers of the floating point format 2 (IEEE 754): export them so, or as text",
        )
    byte = ">" if order == "2" else "<"
    ordinate = "f4" if single else "f8"
    for abscissa in dict.fromkeys((ordinate, "f4")):
        fields = [] if even else [("x", byte + abscissa)]
        whole = np.dtype([*fields, *((f"y{i}", byte + ordinate) for i in range(parts))])
        end = at + count * whole.itemsize
        if end <= len(raw) and raw[end : end + 8].lstrip(b"\r\n").startswith(_END):
            rows = np.frombuffer(raw, whole, count, at)
            return np.column_stack([rows[name].astype(np.float64) for name in whole.names or ()]).ravel(), end
    raise DataError(
        source, f"{count} values", "must have as many numbers in binary as record 7 says, then a line of -1"
    )


def _table(one: _Function, paths: frozenset[str]) -> Table:
    """Return a function as a table, if it is a response in one DOF."""
    if one.function not in (_GENERAL, _RESPONSE, _SPECTRUM):
        raise one.refusal(f"{_name(one.function)} ({one.function})", _RIGHT, "function")
    if one.abscissa.kind != _FREQUENCY:
        raise one.refusal(_axis(one.abscissa), "must be over the frequency (18)", "abscissa")
    if abs(one.direction) > _LAST_TRANSLATION:
        wanted = "must be a translation (0 to 3): no DOF here is an angle"
        raise one.refusal(_along(one.direction), wanted, "direction")
    below = one.denominator
    if below.kind in _ORDERS:
        wanted = (
            "must be an excitation force (13) or nothing (0): a motion over a motion is a transmissibility"
        )
        raise one.refusal(_axis(below), wanted, "denominator")
    if below.kind not in (_NOT_USED, _FORCE):
        wanted = "must be an excitation force (13) or nothing (0)"
        raise one.refusal(_axis(below), wanted, "denominator")
    if below.kind == _FORCE and abs(one.reference[1]) > _LAST_TRANSLATION:
        raise one.refusal(_along(one.reference[1]), "must be a force, not a moment", "reference")
    motion = _motion(one)
    hertz = unit_of(Dimension.FREQUENCY, one.abscissa.unit or None)
    if hertz is None:
        raise one.refusal(one.abscissa.unit, wanted_unit(Dimension.FREQUENCY, ""), "abscissa")
    data = one.data * motion.factor
    if np.iscomplexobj(data):
        data = (
            data * np.sign(one.direction or 1) * (np.sign(one.reference[1] or 1) if motion.per_force else 1.0)
        )
    unit = ("m", "m/s", "m/s2")[motion.order] + ("/N" if motion.per_force else "")
    head = read_head(one.source, one.titles, paths)
    heads, columns = complex_apart(
        one.source, ["frequency", f"amplitude [{unit}]"], [one.frequency * hertz.factor, data]
    )
    return table_of(one.source, heads, columns, head, paths)


_RIGHT = "must be a frequency response function (4), or a spectrum (12) whose unit says pk, rms or pk-pk"


def _axis(axis: _Axis) -> str:
    return f"{_AXES.get(axis.kind, 'type')} ({axis.kind})"


def _motion(one: _Function) -> Unit:
    """Return the unit of numerator and denominator together."""
    ordinate, below = one.ordinate, one.denominator
    label = unit_of(Dimension.MOTION, ordinate.unit) if ordinate.unit else None
    if ordinate.unit and label is None:
        wanted = wanted_unit(Dimension.MOTION, ordinate.unit)
        raise one.refusal(ordinate.unit, wanted, "ordinate")
    if ordinate.kind not in _ORDERS and (ordinate.kind not in _UNKNOWN or label is None):
        wanted = "must be a displacement (8), velocity (11) or acceleration (12)"
        raise one.refusal(_axis(ordinate), wanted, "ordinate")
    length, force = one.system or (1.0, 1.0)
    motion = label or Unit(factor=1.0 / length, order=_ORDERS[ordinate.kind])
    if motion.order != _ORDERS.get(ordinate.kind, motion.order):
        wanted = f"must be the unit of the type, {_AXES[ordinate.kind]}"
        raise one.refusal(ordinate.unit, wanted, "ordinate")
    if below.kind == _FORCE:
        motion = _over_force(one, motion, 1.0 / force)
    elif below.unit and not motion.per_force:
        raise one.refusal(below.unit, "must be of the type of a force (13)", "denominator")
    if one.function == _GENERAL and not (motion.per_force and np.iscomplexobj(one.data)):
        raise one.refusal(f"{_name(_GENERAL)} (0)", _RIGHT, "function")
    if one.function == _SPECTRUM and not motion.per_force and motion.scaling is None:
        raise one.refusal(ordinate.unit or "no unit", _RIGHT, "ordinate")
    return motion


def _over_force(one: _Function, motion: Unit, newtons: float) -> Unit:
    """Return a unit by that of the denominator, in `newtons` if it has no label."""
    label = one.denominator.unit or None
    force = unit_of(Dimension.FORCE, label)
    if force is None:
        raise one.refusal(label, wanted_unit(Dimension.FORCE, label), "denominator")
    if motion.scaling is not None:
        wanted = "must not be RMS or a peak alone: by a force it is the same of both"
        raise one.refusal(one.ordinate.unit, wanted, "ordinate")
    if not motion.per_force:
        factor = motion.factor / (newtons if label is None else force.factor)
        return Unit(factor=factor, order=motion.order, per_force=True)
    above = one.ordinate.unit.rpartition("/")[0]
    if label is not None and unit_of(Dimension.MOTION, f"{above}/{label}") != motion:
        raise one.refusal(label, f"must be as in the ordinate, {one.ordinate.unit}", "denominator")
    return motion


FORMAT = DataFormat(
    name="Universal file",
    suffixes=(".uff", ".unv", ".uf", ".58"),
    help="Frequency response functions and spectra of data set 58 or 58b; conditions in title lines. One "
    "place: `rig.uff:node=2,direction=X` chooses it where there are several.",
    read=read_universal,
    words={
        "function": "Its name or number in data set 58; `frf` is 4.",
        "node": "At which the response was measured.",
        "direction": "`X`, `Y`, `Z` or `scalar`.",
        "reference": "Node, or node and direction, of the force.",
    },
)
