"""The formats of matrix files: what a reader says of itself, which there are, and which of them a file has.

To add a format, write a module with `READERS` and name it in `SHIPPED`; one from outside the package is named
by `solver.extensions`, or registered for one process.
"""

from __future__ import annotations

import re
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from functools import cache
from importlib import import_module
from pathlib import Path
from typing import TYPE_CHECKING, Any

from solver.extensions import extensions

if TYPE_CHECKING:
    from solver.matrices.labels import Label

_SUFFIX = re.compile(r"\.[a-z0-9]{1,12}")
_WORD = re.compile(r"[a-z0-9]{1,12}")
ROLES = ("M", "K", "C")


class MatrixFileError(ValueError):
    """A file that holds no usable matrix; the message names the file and where it is damaged."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Reader:
    """A format of files that hold matrices, modes, the labels of rows, or nodes.

    Commands, uploads, the page, error messages and the table in docs/matrices.md follow from it.

    Attributes
    ----------
    name : str
        What people call the format.
    suffixes : tuple of str
        Endings of its files, lower case, with their dots; several readers may share one.
    help : str
        What the files hold and which program writes them, a sentence of Markdown.
    word : str
        Of ``?format=`` of an upload; an ending without its dot, that of a file whose name tells no format.
    media : tuple of str
        Content types that tell the format of an upload.
    recognises : callable or None
        Whether a file that begins with these bytes (200 at most) has the format. It tells readers that share
        an ending apart and names the format of a file with a wrong ending; None where nothing tells.
    matrix : callable or None
        Reads the matrix of a key (``M``, ``K``, ``C``) from a file: an array, a sparse array, or a
        `solver.matrices.readers.arrays.Labelled` with the node and component of each row. It may raise any
        error whose message says where the file is damaged.
    names : callable or None
        Names of the arrays of a file that may hold several; None for a format of one matrix.
    modes : callable or None
        Reads the arrays ``modes``, ``omega2`` or ``frequencies_hz``, and maybe ``damping_ratio``.
    labels : callable or None
        Reads the labels of all rows, in order.
    nodes : callable or None
        Reads positions and sets of nodes, a `solver.matrices.sectors.decks.Deck`.
    global_rows : bool
        Whether rows are along the global axes whatever frames a deck gives to nodes, as in CalculiX.
    roles : mapping
        Ending to ``M``, ``K`` or ``C``, where the ending tells which matrix a file holds.

    Raises
    ------
    ValueError
        An ending or word of the wrong form, or a reader that reads nothing.
    """

    name: str
    suffixes: tuple[str, ...]
    help: str
    word: str
    media: tuple[str, ...] = ()
    recognises: Callable[[bytes], bool] | None = None
    matrix: Callable[[Path, str], Any] | None = None
    names: Callable[[Path], list[str]] | None = None
    modes: Callable[[Path], dict[str, Any]] | None = None
    labels: Callable[[Path], tuple[Label, ...]] | None = None
    nodes: Callable[[Path], Any] | None = None
    global_rows: bool = False
    roles: Mapping[str, str] = field(default_factory=dict)

    def __post_init__(self) -> None:
        wrong = [suffix for suffix in self.suffixes if not _SUFFIX.fullmatch(suffix)]
        if wrong or not self.suffixes:
            raise ValueError(f"`suffixes` of {self.name} must be such as '.mtx', got {self.suffixes!r}")
        if not _WORD.fullmatch(self.word):
            raise ValueError(f"`word` of {self.name} must be letters and digits, got {self.word!r}")
        odd = [role for role in self.roles.values() if role not in ROLES]
        if odd or not set(self.roles) <= set(self.suffixes):
            raise ValueError(f"`roles` of {self.name} must be its endings with {', '.join(ROLES)}")
        if self.matrix is None and self.labels is None and self.nodes is None:
            raise ValueError(f"the reader of {self.name} must have `matrix`, `labels` or `nodes`")

    @property
    def gives(self) -> tuple[str, ...]:
        """What its files may hold: ``matrix``, ``matrices``, ``modes``, ``labels``, ``nodes``."""
        kinds = {
            "matrix": self.matrix is not None and self.names is None,
            "matrices": self.names is not None,
            "modes": self.modes is not None,
            "labels": self.labels is not None,
            "nodes": self.nodes is not None,
        }
        return tuple(kind for kind, there in kinds.items() if there)


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
_added: list[Reader] = []


def readers() -> tuple[Reader, ...]:
    """Every reader: those that come with the package, then those from outside."""
    return (*_shipped(), *extensions(Reader), *_added)


@cache
def _shipped() -> tuple[Reader, ...]:
    """Loaded on first use: what only lists endings elsewhere does not need SciPy."""
    return tuple(reader for module in SHIPPED for reader in import_module(module).READERS)


def register(reader: Reader) -> Reader:
    """Add a reader in this process; what starts processes of its own, as the service does, needs extensions.

    Raises
    ------
    ValueError
        There is one of this name.
    """
    if any(other.name == reader.name for other in readers()):
        raise ValueError(f"there is a reader of {reader.name!r} already")
    _added.append(reader)
    return reader


def unregister(reader: Reader) -> None:
    """Take back what `register` added."""
    _added.remove(reader)


def matrix_suffixes() -> tuple[str, ...]:
    """Endings of files that hold matrices or modes."""
    return _suffixes(lambda reader: reader.matrix is not None)


def label_suffixes() -> tuple[str, ...]:
    """Endings of files that name the rows."""
    return _suffixes(lambda reader: reader.labels is not None)


def nodes_suffixes() -> tuple[str, ...]:
    """Endings of decks, which have positions and sets of nodes."""
    return _suffixes(lambda reader: reader.nodes is not None)


def modes_suffixes() -> tuple[str, ...]:
    """Endings of files that may hold modes."""
    return _suffixes(lambda reader: reader.modes is not None)


def _suffixes(fits: Callable[[Reader], bool]) -> tuple[str, ...]:
    return tuple(dict.fromkeys(suffix for reader in readers() if fits(reader) for suffix in reader.suffixes))


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
        known = ", ".join(matrix_suffixes())
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
