"""The registry of readers: which formats there are, and which of them a file has.

To add a format, write a module with `READERS` and name it in `SHIPPED`; one from outside the package is named
by `solver.extensions`, or registered for one process.
"""

from __future__ import annotations

from pathlib import Path
from typing import Literal

from solver.extensions import Kinds
from solver.matrices.readers.reader import MatrixFileError, Reader

SHIPPED = (
    "solver.matrices.readers.array_files",
    "solver.matrices.readers.matrix_market",
    "solver.matrices.readers.harwell_boeing",
    "solver.matrices.readers.abaqus",
    "solver.matrices.readers.output4",
    "solver.matrices.readers.dmig",
    "solver.matrices.sectors.decks",
)
_START = 200
READERS: Kinds[Reader] = Kinds(Reader, "reader", lambda reader: (reader.name,), SHIPPED, "READERS")
readers, register, unregister = READERS.every, READERS.register, READERS.unregister


def suffixes(holding: Literal["matrix", "modes", "labels", "nodes"]) -> tuple[str, ...]:
    """Endings of files whose readers read a matrix, modes, the names of rows, or nodes."""
    fitting = [reader for reader in readers() if getattr(reader, holding) is not None]
    return tuple(dict.fromkeys(suffix for reader in fitting for suffix in reader.suffixes))


def role_of_suffix(suffix: str) -> str | None:
    """Which of M, K and C an ending tells; None where it tells none."""
    return next((reader.roles[suffix] for reader in readers() if suffix in reader.roles), None)


def words() -> tuple[str, ...]:
    """The words of ``?format=``."""
    return tuple(dict.fromkeys(reader.word for reader in readers()))


def word_of(name: str, content_type: str) -> str | None:
    """The word of the format that the ending of a name tells, or else a content type; None if neither."""
    suffix = Path(name).suffix.lower()
    by_suffix = (reader.word for reader in readers() if suffix in reader.suffixes)
    by_media = (reader.word for reader in readers() if content_type in reader.media)
    return next(by_suffix, None) or next(by_media, None)


def media() -> tuple[str, ...]:
    """Every content type that tells a format."""
    return tuple(dict.fromkeys(one for reader in readers() for one in reader.media))


def reader_of(path: Path) -> Reader:
    """The reader of a file of matrices or modes.

    Raises
    ------
    MatrixFileError
        No reader has the ending; the message says which there are, and what the content looks like.
    OSError
        The file cannot be read.
    """
    suffix = path.suffix.lower()
    fitting = [reader for reader in readers() if suffix in reader.suffixes and reader.matrix is not None]
    if not fitting:
        known = ", ".join(suffixes("matrix"))
        raise MatrixFileError(f"{str(path)!r} must end in {known}, got {suffix!r}{_looks_like(path)}")
    if len(fitting) == 1:
        return fitting[0]
    with path.open("rb") as file:
        start = file.read(_START)
    sure = (reader for reader in fitting if reader.recognises is not None and reader.recognises(start))
    # What none recognises is read by the one that recognises nothing, whose messages say what is missing.
    return next(sure, None) or next((r for r in fitting if r.recognises is None), fitting[-1])


def _looks_like(path: Path) -> str:
    """What a file of an unknown ending seems to be, as the end of a sentence."""
    try:
        with path.open("rb") as file:
            start = file.read(_START)
    except OSError:
        return ""
    found = next((r for r in readers() if r.recognises is not None and r.recognises(start)), None)
    return "" if found is None else f": it begins as {found.name}, so let it end in {found.suffixes[0]}"
