"""Readers of files: what one is, which formats there are, and which of them a file has.

To add a format, write a module with `READERS` and name it in `SHIPPED`; one from outside the package is named
by `solver.extensions`, or registered for one process.
"""

from __future__ import annotations

import re
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Annotated, Any, Literal

import numpy as np
from numpy.typing import NDArray
from scipy.sparse import coo_array

from solver.extensions import Kinds
from solver.matrices.readers.numbers_in_text import Label
from solver.wording import documented

_SUFFIX = re.compile(r"\.[a-z0-9]{1,12}")
_WORD = re.compile(r"[a-z0-9]{1,12}")
ROLES = ("M", "K", "C")


class MatrixFileError(ValueError):
    """A file that holds no usable matrix; the message names the file and where it is damaged."""


@documented
@dataclass(frozen=True, slots=True, kw_only=True)
class Reader:
    """A format of files that hold matrices, modes, the labels of rows, or nodes.

    Commands, uploads, the page, error messages and the table in docs/matrices.md follow from it.

    Raises
    ------
    ValueError
        An ending or word of the wrong form, or a reader that reads nothing.
    """

    name: Annotated[str, "What people call the format."]
    suffixes: Annotated[
        tuple[str, ...], "Endings of its files, lower case, with their dots; several readers may share one."
    ]
    help: Annotated[str, "What the files hold and which program writes them, a sentence of Markdown."]
    word: Annotated[
        str,
        "Of ``?format=`` of an upload; an ending without its dot, that of a file whose name tells no format.",
    ]
    media: Annotated[tuple[str, ...], "Content types that tell the format of an upload."] = ()
    recognises: Annotated[
        Callable[[bytes], bool] | None,
        "Whether a file that begins with these bytes (200 at most) has the format. It tells readers that "
        "share an ending apart and names the format of a file with a wrong ending; None where nothing "
        "tells.",
    ] = None
    matrix: Annotated[
        Callable[[Path, str], Any] | None,
        "Reads the matrix of a key (``M``, ``K``, ``C``) from a file: an array, a sparse array, or a "
        "`Labelled` with the node and component of each row. It may raise "
        "any error whose message says where the file is damaged.",
    ] = None
    names: Annotated[
        Callable[[Path], list[str]] | None,
        "Names of the arrays of a file that may hold several; None for a format of one matrix.",
    ] = None
    modes: Annotated[
        Callable[[Path], dict[str, Any]] | None,
        "Reads the arrays ``modes``, ``omega2`` or ``frequencies_hz``, and maybe ``damping_ratio``.",
    ] = None
    labels: Annotated[
        Callable[[Path], tuple[Label, ...]] | None, "Reads the labels of all rows, in order."
    ] = None
    nodes: Annotated[
        Callable[[Path], Any] | None,
        "Reads positions and sets of nodes, a `solver.matrices.sectors.loading.Deck`.",
    ] = None
    global_rows: Annotated[
        bool, "Whether rows are along the global axes whatever frames a deck gives to nodes, as in CalculiX."
    ] = False
    roles: Annotated[
        Mapping[str, str],
        "Ending to ``M``, ``K`` or ``C``, where the ending tells which matrix a file holds.",
    ] = field(default_factory=dict)

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
    "solver.matrices.decks.keywords",
    "solver.matrices.readers.output4",
    "solver.matrices.decks.nastran",
    "solver.matrices.sectors.loading",
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


MOST_ROWS = 10_000_000


@dataclass(frozen=True, slots=True, kw_only=True)
class Labelled:
    """A matrix of a file."""

    matrix: Annotated[coo_array, "Sparse (n, n)."]
    labels: Annotated[tuple[Label, ...] | None, "Node and component of each row, where the file tells."] = (
        None
    )
    held: Annotated[frozenset[Label], "Rows that a boundary condition holds, which are no DOFs."] = (
        frozenset()
    )
    sized: Annotated[
        bool, "Whether the file tells how many rows there are; else empty ones at the end do not show."
    ] = True


def mirrored(
    rows: NDArray[np.int64], columns: NDArray[np.int64], values: NDArray[np.float64], size: int
) -> coo_array:
    """The symmetric matrix of which a file holds one triangle, or some entries on one side only.

    Entries whose mirror image is in the file too stay as they are; entries at the same place add up.
    """
    place = rows * size + columns
    other = columns * size + rows
    alone = ~np.isin(other, place)
    return coo_array(
        (
            np.concatenate([values, values[alone]]),
            (np.concatenate([rows, columns[alone]]), np.concatenate([columns, rows[alone]])),
        ),
        shape=(size, size),
    )


# What names of matrices begin with in Nastran and elsewhere, for each of ours.
_NAMES = {"M": ("M",), "K": ("K", "STIF"), "C": ("C", "B", "DAMP")}


def wanted(names: Sequence[str], key: str, path: Path) -> str:
    """The name `key`, or that of an array that stands alone.

    Raises
    ------
    MatrixFileError
        There is neither.
    """
    if key in names or len(names) == 1:
        return key if key in names else names[0]
    known = ", ".join(f"`{name}`" for name in names[:20]) or "nothing"
    raise MatrixFileError(
        f"{str(path)!r} must hold an array named `{key}`, or one array alone; it holds {known}"
    )


def chosen(arrays: Mapping[str, Any], key: str, path: Path) -> Any:
    """The array of a name, or the one that stands alone; raises as `wanted` does."""
    return arrays[wanted(list(arrays), key, path)]


def chosen_by_initials(arrays: Mapping[str, Any], key: str, path: Path) -> Any:
    """A matrix by Nastran's names, of the square ones: loads and recovery matrices stand beside them.

    Raises
    ------
    MatrixFileError
        As for `wanted`.
    """
    shapes = {name: getattr(found, "matrix", found).shape for name, found in arrays.items()}
    square = {name: found for name, found in arrays.items() if shapes[name][0] == shapes[name][1]}
    arrays = square or arrays
    alike = _alike(list(arrays), key)
    return arrays[alike[0]] if len(alike) == 1 else chosen(arrays, key, path)


def named_by_role(names: Sequence[str]) -> list[str]:
    """Names with M, K or C in place of those that say so (KAAX, MAAX, BAAX)."""
    roles = {name: key for key in _NAMES for name in _alike(names, key)}
    return [roles.get(name, name) for name in names]


def _alike(names: Sequence[str], key: str) -> list[str]:
    """The names that begin as those of the matrix `key` do (K4…: structural damping); none for other keys."""
    starts = _NAMES.get(key, ())
    return [name for name in names if name.upper().startswith(starts) and not name.upper().startswith("K4")]
