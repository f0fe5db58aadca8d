"""Matrices of Nastran's OUTPUT4 as text, files ``.op4``; the binary form is in `output4_binary`.

The records, from the DMAP Programmer's Guide (module OUTPUT4, remarks): for each matrix a heading with
columns, rows (negative if BIGMAT), form, type, name and the format of the numbers; for each column that is
not zero its number, the first row (0: strings follow) and the number of words, then the words; at the end a
column past the last. A string begins with its length in words plus one and its row, or (not BIGMAT) with both
in one number, 65536 (words + 1) + row. A number of double precision is two words.
"""

from __future__ import annotations

import re
from collections.abc import Iterator
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np
from scipy.sparse import coo_array

from solver.matrices.readers.choosing import chosen_by_initials, named_by_role
from solver.matrices.readers.nastran.output4_binary import binary_order, read_binary
from solver.matrices.readers.nastran.output4_records import Collector, Heading
from solver.matrices.readers.numbers_in_text import FormatError, ascii_lines, fortran_real
from solver.matrices.readers.reader import Reader

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
