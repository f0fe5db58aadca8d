"""Binary files of Nastran's OUTPUT4: the records of `output4` between Fortran's record marks.

Each record stands between two equal marks with its length in bytes. The first has 24 bytes (integers of 4
bytes) or 48 (of 8), which also tells the byte order.
"""

from __future__ import annotations

import struct
from dataclasses import dataclass
from typing import Literal

import numpy as np
from numpy.typing import NDArray
from scipy.sparse import coo_array

from solver.matrices.readers.nastran.output4_records import Collector, Heading
from solver.matrices.readers.numbers_in_text import FormatError

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
