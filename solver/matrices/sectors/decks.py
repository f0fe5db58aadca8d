"""Positions, sets and frames of nodes from the input deck of a finite-element program, whichever it is."""

from __future__ import annotations

import math
import re
from pathlib import Path

from solver.matrices.decks.ansys import AnsysDeck
from solver.matrices.decks.deck import Deck as Deck
from solver.matrices.decks.deck import DeckFile
from solver.matrices.decks.deck import positions as positions
from solver.matrices.decks.keywords import KeywordDeck
from solver.matrices.decks.nastran import read_nastran
from solver.matrices.readers.numbers_in_text import FormatError
from solver.matrices.readers.reader_registry import Reader

_KEYWORDS = re.compile(r"\s*\*\s*(NODE|INCLUDE|PART)\s*(,|$)", re.IGNORECASE)
_ANSYS = re.compile(r"\s*(NBLOCK|N)\s*,", re.IGNORECASE)
_NASTRAN = re.compile(r"(GRID|INCLUDE)\b", re.IGNORECASE)


def read_deck(path: Path, *, elements: bool = False, alone: bool = False) -> Deck:
    """Read the nodes of a deck, their sets and frames, and the elements if they are asked for.

    Parameters
    ----------
    alone : whether the deck may not include other files, as a stranger's.

    Raises
    ------
    FormatError
        With the line that cannot be read, or a deck without nodes.
    OSError
        It cannot be read.
    """
    deck = Deck()
    try:
        _fill(deck, DeckFile(path, alone), elements=elements)
    except FormatError:
        raise
    except (IndexError, ValueError, OverflowError) as error:
        raise FormatError(f"{path.name!r} is damaged or no deck: {error}") from error
    if not deck.nodes:
        raise FormatError(
            f"{path.name!r} has no nodes: *NODE (CalculiX, Abaqus), NBLOCK or N (Ansys) or GRID (Nastran)"
        )
    bad = next((node for node, place in deck.nodes.items() if not all(map(math.isfinite, place))), None)
    if bad is not None:
        raise FormatError(f"node {bad} must be at a finite place, got {deck.nodes[bad]}")
    return deck


def check_alone(path: Path) -> None:
    """Raise FormatError if a deck includes other files, which a stranger's may not, or cannot be read.

    Raises
    ------
    FormatError
        With the line.
    OSError
        It cannot be read.
    """
    read_deck(path, alone=True)


def _fill(deck: Deck, file: DeckFile, *, elements: bool) -> None:
    if any(map(_KEYWORDS.match, file.lines())):
        KeywordDeck(file, deck, elements=elements).read()
    elif any(map(_ANSYS.match, file.lines())):
        AnsysDeck(file, deck).read()
    elif any(map(_NASTRAN.match, file.lines())):
        read_nastran(file, deck)


READERS = (
    Reader(
        name="a deck",
        suffixes=(".inp", ".cdb"),
        word="inp",
        help="CalculiX, Abaqus (`*NODE`, `*NSET`), Ansys (`NBLOCK`, `N`, `CMBLOCK`): positions, sets and "
        "frames of nodes, for the boundaries of a sector of a disk; Nastran (`GRID`) too, uploaded with "
        "`?format=inp`.",
        nodes=read_deck,
    ),
)
