"""The text of a deck: its lines, the files it includes, numbers as Fortran writes them."""

from __future__ import annotations

import re
from dataclasses import dataclass
from pathlib import Path

from solver.matrices.readers.numbers_in_text import FormatError

_DEEPEST = 10  # files that include each other
_FORTRAN = re.compile(r"([+-]?(?:[0-9]+\.?[0-9]*|\.[0-9]+))(?:[eEdD]([+-]?[0-9]+)|([+-][0-9]+))")


@dataclass(frozen=True, slots=True)
class DeckFile:
    """A file of a deck.

    Attributes
    ----------
    path : Path
    alone : bool
        Whether it may not include other files, as a stranger's.
    depth : int
        How many files include it.
    """

    path: Path
    alone: bool = False
    depth: int = 0

    def lines(self) -> list[str]:
        """The lines of the file."""
        return self.path.read_text(encoding="latin-1").splitlines()

    def other(self, name: str, line: int) -> DeckFile:
        """The file that a line includes.

        Raises
        ------
        FormatError
            It may not, or files include each other.
        """
        if self.alone:
            raise FormatError(
                f"line {line} includes another file, which is not read here: put the nodes and sets into one "
                "deck"
            )
        if self.depth == _DEEPEST:
            raise FormatError(f"{self.path.name!r} includes {name!r} too deeply")
        return DeckFile(self.path.parent / name, self.alone, self.depth + 1)


def real(text: str) -> float:
    """A number, nothing being 0; also with the exponents of Fortran and Nastran: 1.5D-3, 1.5-3.

    Raises
    ------
    ValueError
        It is none.
    """
    text = text.strip()
    found = _FORTRAN.fullmatch(text)
    if found:
        return float(f"{found[1]}e{found[2] or found[3]}")
    return float(text) if text else 0.0
