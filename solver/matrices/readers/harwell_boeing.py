"""Matrices in the Harwell-Boeing and Rutherford-Boeing exchange formats.

I. S. Duff, R. G. Grimes, J. G. Lewis, Users' Guide for the Harwell-Boeing Sparse Matrix Collection (Release
I), 1992: four or five header lines in fixed columns, then column pointers, row indices and values in the
Fortran formats the header names. Symmetric matrices (RSA) hold one triangle. The Rutherford-Boeing format
(1997) leaves out what concerns right-hand sides. Ansys writes it by HBMAT, and names the rows in a file of
the ending ``.mapping``.

Some programs write other columns than their header names: SciPy's `hb_write` says 3E25.16 and writes 24
characters a number. Where the columns hold no numbers but every line shows as many as it should, written out
with a decimal point or an exponent, these are the values. No number is ever read both ways with two results:
characters that columns would cut off a number stay in the field before it, which then is no number.
"""

from __future__ import annotations

import contextlib
import re
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.sparse import csc_array

from solver.matrices.readers.numbers_in_text import (
    LARGEST,
    FormatError,
    Label,
    ascii_lines,
    component,
    distinct,
    node_number,
)
from solver.matrices.readers.reader_registry import Reader

_INTEGERS = re.compile(r"\(?\s*(\d*)\s*I\s*(\d+)(?:\.\d+)?\s*\)?")
_REALS = re.compile(
    r"\(?\s*(?:([+-]?\d+)\s*P\s*,?)?\s*(\d*)\s*\(?\s*[EDFG]\s*(\d+)\s*\.\s*(\d+)(?:E\d+)?\s*\)*"
)
_EXPONENT = re.compile(r"([+-]?[\d.]+)(?:[ED]\s*([+-]?\d+)|([+-]\d+))?")
# A number that needs no columns: with a point, and an exponent with a sign or a letter if it has one.
_WRITTEN_OUT = re.compile(r"\s*([+-]?(?:\d+\.\d*|\.\d+)(?:[ED][+-]?\d+|[+-]\d+)?)(?=[\s+-]|$)\s*")
_SHAPES = "SURHZ"  # symmetric, unsymmetric, rectangular, Hermitian, skew symmetric


@dataclass(frozen=True, slots=True, kw_only=True)
class _Format:
    """A Fortran format: numbers a line, characters a number, decimals and power of ten if none is written."""

    count: int
    width: int
    decimals: int = 0
    power: int = 0


@dataclass(frozen=True, slots=True, kw_only=True)
class _Header:
    kind: str
    rows: int
    columns: int
    entries: int
    pointer_lines: int
    index_lines: int
    value_lines: int
    pointers: _Format
    indices: _Format
    values: _Format
    first_line: int  # of the data, counted from 0


def read_harwell_boeing(path: Path) -> csc_array:
    """Read a real assembled matrix, symmetric or not.

    Raises
    ------
    FormatError
        With the line (counted from 1) where the file leaves the format.
    OSError
        The file cannot be read.
    """
    lines = ascii_lines(path, "a Harwell-Boeing file")
    header = _header(lines)
    cursor = header.first_line
    pointers = _integers(lines, cursor, header.pointer_lines, header.pointers, header.columns + 1, "pointer")
    cursor += header.pointer_lines
    indices = _integers(lines, cursor, header.index_lines, header.indices, header.entries, "row index")
    cursor += header.index_lines
    values = _reals(lines, cursor, header.value_lines, header.values, header.entries)
    first = header.first_line
    falls = np.flatnonzero(np.diff(pointers) < 0)
    if pointers[0] != 1 or pointers[-1] != header.entries + 1 or falls.size:
        at = 0 if pointers[0] != 1 else int(falls[0]) + 1 if falls.size else pointers.size - 1
        raise FormatError(
            f"line {first + at // header.pointers.count + 1}: "
            f"pointers must rise from 1 to {header.entries + 1}, got {pointers[at]} for column {at + 1}"
        )
    bad = np.flatnonzero((indices < 1) | (indices > header.rows))
    if bad.size:
        line = first + header.pointer_lines + int(bad[0]) // header.indices.count + 1
        raise FormatError(f"line {line}: a row index must be from 1 to {header.rows}, got {indices[bad[0]]}")
    shape = (header.rows, header.columns)
    stored = csc_array((values, indices - 1, pointers - 1), shape=shape)
    if header.kind[1] not in "SZ":
        return stored
    entries = stored.tocoo()
    off = entries.row != entries.col
    sign = -1.0 if header.kind[1] == "Z" else 1.0
    row = np.concatenate([entries.row, entries.col[off]])
    column = np.concatenate([entries.col, entries.row[off]])
    return csc_array((np.concatenate([entries.data, sign * entries.data[off]]), (row, column)), shape=shape)


def _header(lines: list[str]) -> _Header:
    if len(lines) < 4:
        raise FormatError(
            f"line {len(lines) + 1} is missing: the header has four lines, the file {len(lines)}"
        )
    cards = [_whole(lines[1][at : at + 14], 2, at, "number of lines") for at in range(0, 56, 14)]
    rhs_text = lines[1][56:70].strip()
    rhs = _whole(rhs_text, 2, 56, "number of lines") if rhs_text else 0
    kind = lines[2][:3].upper()
    _check_kind(kind)
    rows, columns, entries = (
        _whole(lines[2][at : at + 14], 3, at, what)
        for at, what in ((14, "number of rows"), (28, "number of columns"), (42, "number of entries"))
    )
    if not rows or not columns:
        raise FormatError(f"line 3: the matrix has {rows} rows and {columns} columns")
    formats = lines[3]
    return _Header(
        kind=kind, rows=rows, columns=columns, entries=entries,
        pointer_lines=cards[1], index_lines=cards[2], value_lines=cards[3],
        pointers=_integer_format(formats[:16]), indices=_integer_format(formats[16:32]),
        values=_value_format(formats[32:52], kind), first_line=5 if rhs > 0 else 4,
    )  # fmt: skip


def _check_kind(kind: str) -> None:
    refused = {"C": "complex", "P": "a pattern without values", "Q": "of supplementary data"}
    if len(kind) < 3 or kind[0] not in "RI" or kind[1] not in _SHAPES or kind[2] not in "AE":
        what = refused.get(kind[:1], "unknown")
        raise FormatError(f"line 3: the type must be RSA, RUA or RRA (real, assembled), got {kind!r}: {what}")
    if kind[2] == "E":
        raise FormatError(f"line 3: the type {kind!r} is a matrix of unassembled elements: assemble it first")
    if kind[1] == "H":
        raise FormatError(f"line 3: the type {kind!r} is Hermitian, a real matrix is symmetric: RSA")


def _integer_format(text: str) -> _Format:
    found = _INTEGERS.fullmatch(text.strip().upper())
    if not found or not int(found[2]) or found[1] == "0":
        raise FormatError(f"line 4: {text.strip()!r} is not a format of whole numbers such as (16I5)")
    return _Format(count=int(found[1] or 1), width=int(found[2]))


def _value_format(text: str, kind: str) -> _Format:
    """The format of the values: matrices of whole numbers (I) may be written in a format of these."""
    if kind[0] == "I" and _INTEGERS.fullmatch(text.strip().upper()):
        return _integer_format(text)
    found = _REALS.fullmatch(text.strip().upper())
    if not found or not int(found[3]) or found[2] == "0":
        raise FormatError(f"line 4: {text.strip()!r} is not a format of real numbers such as (5E16.8)")
    return _Format(
        count=int(found[2] or 1), width=int(found[3]), decimals=int(found[4]), power=int(found[1] or 0)
    )


def _whole(text: str, line: int, column: int, what: str) -> int:
    stripped = text.strip()
    if not re.fullmatch(r"\+?\d+", stripped) or int(stripped) > LARGEST:
        where = f"line {line}, column {column + 1}"
        raise FormatError(f"{where}: the {what} must be a whole number >= 0 in 14 characters, got {text!r}")
    return int(stripped)


def _fields(
    lines: list[str], first: int, n_lines: int, form: _Format, count: int, what: str
) -> Iterator[tuple[str, int, int]]:
    """The fields of a section with line and column, both from 1."""
    if -(-count // max(form.count, 1)) > n_lines:
        raise FormatError(
            f"line 2: {count} numbers of kind {what}, {form.count} a line, do not fit in {n_lines} lines"
        )
    for i in range(count):
        line, place = first + i // form.count, (i % form.count) * form.width
        if line >= len(lines):
            raise FormatError(f"line {line + 1} is missing: the file ends at {what} {i + 1} of {count}")
        yield lines[line][place : place + form.width], line + 1, place + 1


def _section(
    lines: list[str], first: int, n_lines: int, form: _Format, count: int, what: str,
    parse: Callable[[str], float], quick: Callable[[NDArray[np.bytes_]], NDArray[Any] | None],
) -> list[float] | NDArray[Any]:  # fmt: skip
    """The numbers of a section: all at once where `quick` can, else field by field, which names a bad one."""
    if (
        -(-count // form.count) <= n_lines
        and (fields := _quick_fields(lines, first, form, count)) is not None
    ):
        with contextlib.suppress(ValueError, OverflowError):
            found = quick(fields)
            if found is not None:
                return found
    numbers = []
    for text, line, column in _fields(lines, first, n_lines, form, count, what):
        try:
            numbers.append(parse(text))
        except (ValueError, OverflowError):
            raise FormatError(f"line {line}, column {column}: {text!r} is not a {what}") from None
    return numbers


def _integers(
    lines: list[str], first: int, n_lines: int, form: _Format, count: int, what: str
) -> NDArray[np.int64]:
    def quick(fields: NDArray[np.bytes_]) -> NDArray[np.int64] | None:
        numbers = fields.astype(np.int64)
        good = numbers.min(initial=0) >= 0 and numbers.max(initial=0) <= LARGEST
        return numbers if good else None

    return np.array(_section(lines, first, n_lines, form, count, what, _bounded, quick), dtype=np.int64)


def _quick_fields(lines: list[str], first: int, form: _Format, count: int) -> NDArray[np.bytes_] | None:
    """The fields of a section as one array; None if lines are short or missing, or characters are odd."""
    needed, width = -(-count // form.count), form.width
    chosen = lines[first : first + needed]
    text = "".join(line[: form.count * width] for line in chosen)[: count * width]
    full = all(len(line) >= form.count * width for line in chosen[:-1])
    if not full or len(chosen) < needed or len(text) != count * width or "\0" in text or "_" in text:
        return None
    return np.frombuffer(text.upper().replace("D", "E").encode("ascii"), dtype=f"S{width}")


def _bounded(text: str) -> int:
    value = int(text)
    if not 0 <= value <= LARGEST:
        raise ValueError(text)
    return value


def _reals(lines: list[str], first: int, n_lines: int, form: _Format, count: int) -> NDArray[np.float64]:
    def quick(fields: NDArray[np.bytes_]) -> NDArray[np.float64] | None:
        return fields.astype(np.float64) if _plain(fields) else None

    try:
        found = _section(lines, first, n_lines, form, count, "value", lambda text: _real(text, form), quick)
    except FormatError:
        written_out = _written_out(lines[first : first + n_lines], form, count)
        if written_out is None:
            raise
        return written_out
    return np.array(found, dtype=np.float64)


def _written_out(lines: list[str], form: _Format, count: int) -> NDArray[np.float64] | None:
    """The values of a section whatever its columns; None unless every line shows as many as it should."""
    numbers: list[str] = []
    for line in lines[: -(-count // form.count)]:
        at, expected = 0, min(form.count, count - len(numbers))
        for _ in range(expected):
            found = _WRITTEN_OUT.match(line.upper(), at)
            if found is None:
                return None
            at = found.end()
            numbers.append(found[1])
        if at < len(line):
            return None
    if len(numbers) != count:
        return None
    return np.array([_real(text, form) for text in numbers], dtype=np.float64)


def _plain(fields: NDArray[np.bytes_]) -> bool:
    """Whether every field has a decimal point and an exponent with its letter, so that no rule applies."""
    letters = fields.view("u1").reshape(fields.size, -1)
    pointed = (letters == ord(".")).any(axis=1)
    lettered = (letters == ord("E")).any(axis=1)
    return bool(pointed.all() and lettered.all())


def _real(text: str, form: _Format) -> float:
    """One field as Fortran reads it: D exponents, 1.5-3 for 1.5E-3, implied decimals, the P scale factor."""
    found = _EXPONENT.fullmatch(text.strip().upper())
    if not found:
        raise ValueError(text)
    power = found[2] or found[3]
    mantissa = found[1] if "." in found[1] else f"{found[1]}E{-form.decimals}"
    if power is not None:
        if "." in found[1]:
            return float(f"{mantissa}E{power}")
        return float(f"{found[1]}E{int(power) - form.decimals}")
    value = float(mantissa)
    return value / 10.0**form.power if form.power else value


def _mapping(path: Path) -> tuple[Label, ...]:
    """A heading, then equation, node and DOF a line, as HBMAT writes them with its last argument YES."""
    lines = ascii_lines(path, "a file of DOF labels")
    labels: list[Label] = []
    for number, line in enumerate(lines, start=1):
        words = line.split()
        if not words or (not labels and words[0].upper().startswith("MATRIX")):
            continue
        whole = all(re.fullmatch(r"-?\d{1,10}", word) for word in words[:2])
        if len(words) != 3 or not whole:
            raise FormatError(f"line {number} must hold equation, node and DOF, got {line.strip()[:80]!r}")
        if int(words[0]) != len(labels) + 1:
            raise FormatError(f"line {number} must be equation {len(labels) + 1}, got {words[0]}")
        labels.append(Label(node_number(words[1], number), component(words[2])))
    return distinct(labels, len(lines))


READERS = (
    Reader(
        name="Harwell-Boeing",
        suffixes=(
            ".hb", ".rb", ".rsa", ".rua", ".rra", ".psa", ".pua", ".rse", ".isa", ".iua", ".csa", ".cua",
        ),
        word="hb",
        media=("application/x-harwell-boeing",),
        help="Harwell-Boeing and Rutherford-Boeing, real assembled, symmetric or not.",
        matrix=lambda path, _key: read_harwell_boeing(path),
    ),
    Reader(
        name="Ansys HBMAT",
        suffixes=(".matrix",),
        word="hb",
        help="Ansys, `HBMAT` (`ASCII`): Harwell-Boeing under Ansys' usual ending; call the file so. "
        "`name.mapping` beside it names the rows.",
        matrix=lambda path, _key: read_harwell_boeing(path),
    ),
    Reader(
        name="Ansys mapping",
        suffixes=(".mapping",),
        word="mapping",
        help="Ansys, `HBMAT` with its last argument `YES`: names the rows (equation, node and DOF a line).",
        labels=_mapping,
    ),
)  # fmt: skip
