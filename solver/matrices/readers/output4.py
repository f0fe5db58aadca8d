"""Matrices of Nastran's OUTPUT4, files ``.op4``, as text and binary.

The records, from the DMAP Programmer's Guide (module OUTPUT4, remarks): for each matrix a heading with
columns, rows (negative if BIGMAT), form, type, name and the format of the numbers; for each column that is
not zero its number, the first row (0: strings follow) and the number of words, then the words; at the end a
column past the last. A string begins with its length in words plus one and its row, or (not BIGMAT) with both
in one number, 65536 (words + 1) + row. A number of double precision is two words.

Each record of a binary file stands between two equal marks with its length in bytes. The first has 24 bytes
(integers of 4 bytes) or 48 (of 8), which also tells the byte order.
"""

from __future__ import annotations

import re
import struct
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Annotated, Literal

import numpy as np
from numpy.typing import NDArray
from scipy.sparse import coo_array

from solver.matrices.readers.numbers_in_text import FormatError, ascii_lines, fortran_real
from solver.matrices.readers.reader_registry import (
    MOST_ROWS,
    Reader,
    chosen_by_initials,
    mirrored,
    named_by_role,
)

SQUARE, RECTANGULAR, SYMMETRIC = 1, 2, 6
_FORMS = {3: "diagonal", 4: "lower triangular", 5: "upper triangular", 8: "identity", 7: "row"}
_STRING = 65536


@dataclass(frozen=True, slots=True, kw_only=True)
class Heading:
    """The first record of a matrix."""

    name: str
    columns: int
    rows: int
    form: int
    bigmat: bool
    double: Annotated[bool, "Whether a number is of double precision."]
    complex: Annotated[bool, "Whether it is complex."]
    words: Annotated[int, "Words a real number has."]

    @classmethod
    def of(cls, counts: Sequence[int], name: str, where: str, *, word: int = 4) -> Heading:
        """Check what a file says.

        Parameters
        ----------
        counts : columns, rows, form, type.
        word : bytes of a word.

        Raises
        ------
        FormatError
            A size, form or type that cannot be.
        """
        columns, rows, form, kind = counts
        if not 0 < columns <= MOST_ROWS or not 0 < abs(rows) <= MOST_ROWS:
            raise FormatError(
                f"{where}: a matrix has 1 to {MOST_ROWS} rows and columns, got {rows} {columns}"
            )
        if kind not in (1, 2, 3, 4):
            raise FormatError(f"{where}: the type of a matrix is 1 to 4, got {kind}")
        double = kind in (2, 4)
        return cls(
            name=name.strip(), columns=columns, rows=abs(rows), form=form, bigmat=rows < 0,
            double=double, complex=kind > 2, words=8 // word if double else 1,
        )  # fmt: skip

    def numbers(self, words: int, where: str) -> int:
        """How many real numbers are in so many words."""
        count, left = divmod(words, self.words * (2 if self.complex else 1))
        if words <= 0 or left:
            raise FormatError(f"{where}: {words} words are no whole number of values of this type")
        return count * (2 if self.complex else 1)

    def string(self, integers: Sequence[int]) -> tuple[int, int, int]:
        """Words, first row, and words used with its heading, of a string."""
        if self.bigmat:
            length, row = integers
            return length - 1, row, length + 1
        length, row = divmod(integers[0], _STRING)
        return length - 1, row, length


@dataclass(slots=True)
class Collector:
    """A matrix that is read column by column."""

    heading: Heading
    _rows: list[NDArray[np.int64]] = field(default_factory=list)
    _columns: list[NDArray[np.int64]] = field(default_factory=list)
    _values: list[NDArray[np.float64]] = field(default_factory=list)

    def add(self, column: int, row: int, numbers: NDArray[np.float64], where: str) -> None:
        """Take numbers from `row` (from 1) on in `column`.

        Raises
        ------
        FormatError
            They lie outside the matrix.
        """
        values = numbers[0::2] + 1j * numbers[1::2] if self.heading.complex else numbers
        if column < 1 or row < 1 or row - 1 + values.size > self.heading.rows:
            raise FormatError(
                f"{where}: rows {row} to {row - 1 + values.size} of column {column} lie outside a matrix of "
                f"{self.heading.rows} rows and {self.heading.columns} columns"
            )
        self._rows.append(np.arange(row - 1, row - 1 + values.size))
        self._columns.append(np.full(values.size, column - 1))
        self._values.append(values)

    def matrix(self) -> coo_array:
        """All that was taken; of a symmetric matrix both triangles.

        Raises
        ------
        FormatError
            A form that holds more than the entries say.
        """
        heading = self.heading
        if heading.form in _FORMS:
            raise FormatError(
                f"the matrix {heading.name!r} is {_FORMS[heading.form]}: write it as a square matrix"
            )
        if not self._values:
            return coo_array((heading.rows, heading.columns))
        rows, columns = np.concatenate(self._rows), np.concatenate(self._columns)
        values = np.concatenate(self._values)
        if heading.form == SYMMETRIC and heading.rows == heading.columns:
            return mirrored(rows, columns, values, heading.rows)
        return coo_array((values, (rows, columns)), shape=(heading.rows, heading.columns))


Order = Literal["<", ">"]
_HEADINGS = {24: 4, 48: 8}  # bytes of the first record, bytes of a word


def binary_order(mark: bytes) -> Order | None:
    """The byte order of a file that begins with `mark`; None if it is text."""
    orders: tuple[Order, Order] = ("<", ">")
    for order in orders:
        if len(mark) == 4 and struct.unpack(f"{order}i", mark)[0] in _HEADINGS:
            return order
    return None


def read_binary(content: bytes, order: Order) -> dict[str, coo_array]:
    """Read all matrices, by name.

    Raises
    ------
    FormatError
        With the byte that leaves the format.
    """
    records = _Records(content, order)
    found: dict[str, coo_array] = {}
    while records.at < len(content):
        where = f"byte {records.at}"
        heading, word = _heading(records.take("the heading of a matrix"), order, where)
        if heading.name in found:
            raise FormatError(f"{where}: the file holds two matrices {heading.name!r}")
        found[heading.name] = _columns(records, heading, word)
    return found


@dataclass(slots=True)
class _Records:
    content: bytes
    order: Order
    at: int = 0

    def take(self, what: str) -> bytes:
        """The next record."""
        start = self.at
        length = self._mark(start, what)
        end = start + 4 + length
        if length < 0 or end + 4 > len(self.content):
            raise FormatError(
                f"byte {start}: a record of {length} bytes ({what}) goes past the end of the file"
            )
        if self._mark(end, what) != length:
            raise FormatError(f"byte {end}: the mark behind a record does not repeat the {length} before it")
        self.at = end + 4
        return self.content[start + 4 : end]

    def _mark(self, at: int, what: str) -> int:
        if at + 4 > len(self.content):
            raise FormatError(f"byte {at}: the file ends where {what} should be")
        return int(struct.unpack_from(f"{self.order}i", self.content, at)[0])


def _heading(record: bytes, order: Order, where: str) -> tuple[Heading, int]:
    word = _HEADINGS.get(len(record))
    if word is None:
        raise FormatError(f"{where}: the heading of a matrix has 24 or 48 bytes, got {len(record)}")
    counts = [int(n) for n in np.frombuffer(record, dtype=f"{order}i{word}", count=4)]
    name = record[4 * word :].decode("ascii", "replace").replace("\0", " ")
    return Heading.of(counts, name, where, word=word), word


def _columns(records: _Records, heading: Heading, word: int) -> coo_array:
    made = Collector(heading)
    order = records.order
    while True:
        where = f"byte {records.at}"
        record = records.take("a column")
        if len(record) < 3 * word:
            raise FormatError(f"{where}: the record of a column has {len(record)} bytes, at least {3 * word}")
        column, row, words = (int(n) for n in np.frombuffer(record, dtype=f"{order}i{word}", count=3))
        if column > heading.columns:
            return made.matrix()
        data = record[3 * word :]
        if words < 0 or words * word > len(data):
            raise FormatError(f"{where}: {words} words are announced, {len(data) // word} are there")
        data = data[: words * word]
        if row:
            heading.numbers(words, where)
            made.add(column, row, _values(data, heading, word, order), where)
        else:
            _strings(made, column, data, word, order, where)


def _strings(made: Collector, column: int, data: bytes, word: int, order: Order, where: str) -> None:
    """Add the strings of a column."""
    at, heading = 0, made.heading
    count = 2 if heading.bigmat else 1
    while at < len(data):
        if at + count * word > len(data):
            raise FormatError(f"{where}: the column ends within a string")
        integers = [int(n) for n in np.frombuffer(data, dtype=f"{order}i{word}", count=count, offset=at)]
        length, row, used = heading.string(integers)
        if length <= 0 or at + used * word > len(data):
            raise FormatError(f"{where}: a string of {length} words does not fit in its column")
        heading.numbers(length, where)
        start = at + count * word
        made.add(column, row, _values(data[start : at + used * word], heading, word, order), where)
        at += used * word


def _values(data: bytes, heading: Heading, word: int, order: Order) -> NDArray[np.float64]:
    size = 8 if heading.double else word
    return np.frombuffer(data, dtype=f"{order}f{size}").astype(np.float64)


_FORMAT = re.compile(r"\(?\s*(?:1P\s*,?)?\s*(\d+)\s*[EDF]\s*(\d+)\.\d+(?:E\d+)?\s*\)?")


def read_output4(path: Path) -> dict[str, coo_array]:
    """Read all matrices of a file, by name.

    Raises
    ------
    FormatError
        With the line, or the byte of a binary file, that leaves the format.
    OSError
        The file cannot be read.
    """
    with path.open("rb") as file:
        order = binary_order(file.read(4))
    if order is not None:
        return read_binary(path.read_bytes(), order)
    return _Text(ascii_lines(path, "an OUTPUT4 file")).matrices()


@dataclass(slots=True)
class _Text:
    """The lines of a file and the place in them."""

    lines: list[str]
    at: int = 0
    _found: dict[str, coo_array] = field(default_factory=dict)

    def matrices(self) -> dict[str, coo_array]:
        while any(line.strip() for line in self.lines[self.at : self.at + 3]):
            if not self.lines[self.at].strip():
                self.at += 1
                continue
            line = self.at + 1
            heading, per_line, width = self._heading()
            if heading.name in self._found:
                raise FormatError(f"line {line}: the file holds two matrices {heading.name!r}")
            self._found[heading.name] = self._columns(heading, per_line, width)
        if not self._found:
            raise FormatError("line 1 is missing: the file holds no matrix")
        return self._found

    def _take(self, what: str) -> str:
        if self.at >= len(self.lines):
            raise FormatError(f"line {self.at + 1} is missing: the file ends where {what} should be")
        self.at += 1
        return self.lines[self.at - 1]

    def _heading(self) -> tuple[Heading, int, int]:
        line = self._take("the heading of a matrix")
        for width in (8, 16):
            texts = [line[i * width : (i + 1) * width] for i in range(4)]
            rest = line[4 * width :]
            if all(re.fullmatch(r"\s*-?\d+\s*", text) for text in texts):
                break
        else:
            raise FormatError(
                f"line {self.at} must hold columns, rows, form and type of a matrix, got {line[:60]!r}"
            )
        columns, rows, form, kind = (int(text) for text in texts)
        found = _FORMAT.fullmatch(rest[8:].strip().upper())
        if found is None or not int(found[1]) or not int(found[2]):
            raise FormatError(f"line {self.at}: {rest[8:].strip()!r} is no format such as 1P,3E23.16")
        heading = Heading.of((columns, rows, form, kind), rest[:8], f"line {self.at}")
        return heading, int(found[1]), int(found[2])

    def _integers(self, count: int, what: str) -> list[int]:
        line = self._take(what)
        words = line.split()
        if len(words) != count or not all(re.fullmatch(r"-?\d{1,12}", word) for word in words):
            # Large numbers may touch: then the fields are of equal width.
            width = len(line.rstrip()) // count
            words = [line[i * width : (i + 1) * width] for i in range(count)]
            if not all(re.fullmatch(r"\s*-?\d{1,12}\s*", word) for word in words):
                raise FormatError(f"line {self.at} must hold {what}, got {line.strip()[:60]!r}")
        return [int(word) for word in words]

    def _columns(self, heading: Heading, per_line: int, width: int) -> coo_array:
        made = Collector(heading)
        while True:
            column, row, words = self._integers(3, "column, row and number of words")
            if column > heading.columns:
                self._take("the number behind the last column")
                return made.matrix()
            where = f"line {self.at}"
            if row:
                made.add(column, row, self._numbers(heading.numbers(words, where), per_line, width), where)
                continue
            for first, count in self._strings(heading, words):
                where = f"line {self.at}"
                made.add(column, first, self._numbers(count, per_line, width), where)

    def _strings(self, heading: Heading, words: int) -> Iterator[tuple[int, int]]:
        """First row and count of numbers of each string of a column."""
        left = words
        while left > 0:
            texts = self._integers(2 if heading.bigmat else 1, "the heading of a string")
            length, row, used = heading.string(texts)
            left -= used
            if left < 0:
                raise FormatError(f"line {self.at}: the strings are longer than the {words} words announced")
            yield row, heading.numbers(length, f"line {self.at}")

    def _numbers(self, count: int, per_line: int, width: int) -> np.ndarray:
        values: list[float] = []
        while len(values) < count:
            line = self._take("a number")
            for i in range(min(per_line, count - len(values))):
                text = line[i * width : (i + 1) * width]
                try:
                    values.append(fortran_real(text))
                except ValueError:
                    where = f"line {self.at}, column {i * width + 1}"
                    raise FormatError(f"{where}: {text!r} is not a number") from None
        return np.array(values)


READERS = (
    Reader(
        name="Nastran OUTPUT4",
        suffixes=(".op4",),
        word="op4",
        recognises=lambda start: binary_order(start[:4]) is not None,
        help="Nastran, `OUTPUT4` as text or binary, in either byte order, dense, sparse or `BIGMAT`: one "
        "matrix, or `K…`, `M…` and `B…`.",
        matrix=lambda path, key: chosen_by_initials(read_output4(path), key, path),
        names=lambda path: named_by_role(list(read_output4(path))),
    ),
)
