"""What text and binary files of OUTPUT4 have in common: headings, words, strings, columns put together."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray
from scipy.sparse import coo_array

from solver.matrices.readers.numbers_in_text import FormatError
from solver.matrices.readers.triplets import MOST_ROWS, mirrored

SQUARE, RECTANGULAR, SYMMETRIC = 1, 2, 6
_FORMS = {3: "diagonal", 4: "lower triangular", 5: "upper triangular", 8: "identity", 7: "row"}
_STRING = 65536


@dataclass(frozen=True, slots=True, kw_only=True)
class Heading:
    """The first record of a matrix.

    Attributes
    ----------
    double, complex : bool
        What a number is.
    words : int
        Words a real number has.
    """

    name: str
    columns: int
    rows: int
    form: int
    bigmat: bool
    double: bool
    complex: bool
    words: int

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
