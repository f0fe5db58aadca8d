"""The matrices of one structure from their files: rows brought together by their labels, in SI units.

Nastran (GRID, field CD), Ansys (rotated nodes) and Abaqus (``*TRANSFORM``) write matrices along the axes of
each node's own frame: u_global = R u_own with the axes of the node as columns of R, so K_global = T K Tᵀ with
the blocks R in T. CalculiX writes them along the global axes all the same and expresses what it holds in
other ones by equations.
"""

from __future__ import annotations

import re
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Annotated, Any

import numpy as np
from numpy.typing import NDArray
from scipy.sparse import coo_array, csr_array, diags_array, issparse

from solver.matrices.decks.deck import Deck, frames
from solver.matrices.readers import reader_registry as registry
from solver.matrices.readers.numbers_in_text import COMPONENTS, OWN_COMPONENTS, FormatError, Label
from solver.matrices.readers.numbers_in_text import label as parsed
from solver.matrices.readers.reader_registry import MOST_ROWS, ROLES, Labelled, Reader, reader_of, suffixes
from solver.matrices.readers.reader_registry import MatrixFileError as MatrixFileError
from solver.matrices.values import UNITS, NormalModes

_LABELS_OF_ONES_OWN = ".dof"


def read_matrix(path: Path, key: str) -> coo_array:
    """Read the matrix `key` (``M``, ``C`` or ``K``) from a file.

    A file of several arrays (.npz, .mat, .op4, DMIG) must hold one named `key`, or one alone; Nastran's names
    (KAAX, MAAX, BAAX) count too.

    Raises
    ------
    MatrixFileError
        No such file, an unknown suffix, a damaged file, or no real matrix in it.
    """
    return read_labelled(path, key).matrix


def read_labelled(path: Path, key: str) -> Labelled:
    """Read the matrix `key` as `read_matrix` does, with the labels of its rows if the file has them.

    Raises
    ------
    MatrixFileError
        As for `read_matrix`.
    """
    found = _read(path, lambda reader: _matrix(reader, path, key))
    if isinstance(found, Labelled):
        return Labelled(
            matrix=_checked(found.matrix, path), labels=found.labels, held=found.held, sized=found.sized
        )
    return Labelled(matrix=_checked(found if issparse(found) else np.asarray(found), path))


def _checked(array: Any, path: Path) -> coo_array:
    """A square matrix of finite real numbers."""
    if array.dtype.kind == "c" and not np.any(np.imag(array.data if issparse(array) else array)):
        array = array.real
    if array.dtype.kind not in "fiu":
        raise MatrixFileError(f"{str(path)!r} must hold real numbers, got {array.dtype}")
    if array.ndim != 2 or array.shape[0] != array.shape[1] or not array.shape[0]:
        shape = " x ".join(map(str, array.shape))
        raise MatrixFileError(f"{str(path)!r} must hold a square matrix, got {shape or 'a number'}")
    if array.shape[0] > MOST_ROWS:
        raise MatrixFileError(f"{str(path)!r} may hold {MOST_ROWS} rows, got {array.shape[0]}")
    matrix = coo_array(array, dtype=np.float64)
    bad = np.flatnonzero(~np.isfinite(matrix.data))
    if bad.size:
        at = bad[0]
        where = f"row {matrix.row[at]}, column {matrix.col[at]} (zero-based)"
        raise MatrixFileError(f"{str(path)!r} must hold finite numbers, got {matrix.data[at]} in {where}")
    return matrix


def array_names(path: Path) -> list[str]:
    """Names of the arrays in a file that may hold several; none for a file of one matrix.

    Matrices of Nastran are named M, K and C if their own names say so.

    Raises
    ------
    MatrixFileError
        No such file, an unknown suffix, or a damaged file.
    """
    names: list[str] = _read(path, lambda reader: [] if reader.names is None else reader.names(path))
    return names


def read_modes(path: Path) -> NormalModes:
    """Read modes from a file (.npz, .mat) with `modes`, `omega2` or `frequencies_hz`, maybe `damping_ratio`.

    Raises
    ------
    MatrixFileError
        No such file, a damaged one, or one without these arrays.
    """
    arrays = _read(path, lambda reader: _modes_arrays(reader, path))
    for name, array in arrays.items():
        if array.dtype.kind not in "fiu":
            raise MatrixFileError(f"{str(path)!r}: `{name}` must hold real numbers, got {array.dtype}")
    wanted = ("omega2" in arrays) != ("frequencies_hz" in arrays)
    if not wanted or "modes" not in arrays:
        raise MatrixFileError(
            f"{str(path)!r} must hold `modes` and one of `omega2` [rad²/s²] and `frequencies_hz`, got "
            + (", ".join(f"`{name}`" for name in arrays) or "none of them")
        )
    try:
        return NormalModes.of(arrays)
    except ValueError as error:
        raise MatrixFileError(f"{str(path)!r}: {error}") from error


def _read(path: Path, read: Callable[[Reader], Any]) -> Any:
    """Read with the reader of the file, every failure as a MatrixFileError that names the file."""
    suffix = path.suffix.lower()
    try:
        return read(registry.reader_of(path))
    except MatrixFileError:
        raise
    except OSError as error:
        reason = error.strerror or str(error)
        raise MatrixFileError(f"{str(path)!r} cannot be read: {reason}") from error
    except MemoryError as error:
        raise MatrixFileError(f"{str(path)!r} holds more than fits into memory") from error
    except Exception as error:
        reason = str(error).strip().rstrip(".") or type(error).__name__
        raise MatrixFileError(f"{str(path)!r} is damaged or not a {suffix} file: {reason[:300]}") from error


def _matrix(reader: Reader, path: Path, key: str) -> Any:
    if reader.matrix is None:
        raise TypeError(f"{reader.name} holds no matrices")
    return reader.matrix(path, key)


def _modes_arrays(reader: Reader, path: Path) -> dict[str, Any]:
    if reader.modes is None:
        known, suffix = " and ".join(registry.suffixes("modes")), path.suffix.lower()
        raise MatrixFileError(f"{str(path)!r}: modes are read from {known} files, got {suffix!r}")
    return reader.modes(path)


def read_labels(path: Path) -> tuple[Label, ...]:
    """Read the labels of all rows from a file that names them; one of an unknown ending as `.dof`.

    Raises
    ------
    FormatError
        With the line that holds no label, or one of another row again.
    OSError
        The file cannot be read.
    """
    suffix = path.suffix.lower()
    suffix = suffix if suffix in registry.suffixes("labels") else _LABELS_OF_ONES_OWN
    read = next(one.labels for one in registry.readers() if one.labels is not None and suffix in one.suffixes)
    return read(path)


def labels_beside(path: Path) -> Path | None:
    """The file of labels that stands beside a matrix under the same name, if there is one."""
    for suffix in registry.suffixes("labels"):
        for name in (path.with_suffix(suffix), path.with_suffix(suffix.upper())):
            if name.is_file():
                return name
    return None


MODES, MAPPING = "modes", "mapping"
_WORDS = {
    "M": ("M", "MASS", "MASSE"),
    "K": ("K", "STIF", "STIFF", "STIFFNESS"),
    "C": ("C", "DAMP", "DAMPING", "DMPV"),
}


def sorted_files(files: Sequence[Path], mapping: Path | None = None) -> dict[str, Path]:
    """The file of each of ``M``, ``K``, ``C`` or of ``modes``, and ``mapping`` if one names the rows.

    Several files are told by a word of their names or their suffix, else they come in the order M, K, C.

    Parameters
    ----------
    mapping : a file that names the rows, beside `files`.

    Raises
    ------
    MatrixFileError
        Too many files, none, or a single one without M and K.
    """
    naming = registry.suffixes("labels")
    labels = [path for path in files if path.suffix.lower() in naming]
    matrices = [path for path in files if path not in labels]
    rows = [*labels, *([] if mapping is None else [mapping])]
    if len(rows) > 1:
        raise MatrixFileError(f"one file names the rows, got {', '.join(map(str, rows))}")
    if not 0 < len(matrices) <= len(ROLES):
        raise MatrixFileError(f"M, K and maybe C are wanted, got {len(matrices)} files")
    found = _assigned(matrices) if len(matrices) > 1 else dict.fromkeys(_held_by(matrices[0]), matrices[0])
    return found if not rows else {**found, MAPPING: rows[0]}


def _assigned(files: Sequence[Path]) -> dict[str, Path]:
    """Files by their role: as the last word that tells, or the suffix; else in the order M, K, C."""
    told = [_role(path) for path in files]
    known = [role for role in told if role is not None]
    if len(set(known)) == len(files) and {"M", "K"} <= set(known):
        return dict(zip(known, files, strict=True))
    return dict(zip(ROLES, files, strict=False))


def _role(path: Path) -> str | None:
    told = registry.role_of_suffix(path.suffix.lower())
    if told is not None:
        return told
    words = [word.upper() for word in reversed(re.findall("[A-Za-z]+", path.stem))]
    roles = (role for word in words for role, known in _WORDS.items() if word in known)
    return next(roles, None)


def _held_by(path: Path) -> tuple[str, ...]:
    """What a single file holds: matrices under their names, or modes."""
    names = array_names(path)
    if {"M", "K"} <= set(names):
        return tuple(role for role in ROLES if role in names)
    if MODES in names:
        return (MODES,)
    held = ", ".join(f"`{name}`" for name in names[:20]) or "nothing with a name"
    raise MatrixFileError(
        f"{str(path)!r} alone must hold M and K, or modes; it holds {held}: give the "
        "file of the other one too, in the order M K C"
    )


PART = "parts/"  # begins the key of a part of the structure, such as a blade, beside M, K and C


@dataclass(frozen=True, slots=True, kw_only=True)
class MatrixSet:
    """M, K and maybe C of a structure."""

    matrices: Annotated[dict[str, coo_array], "Sparse, by their keys."]
    labels: Annotated[tuple[Label, ...] | None, "Node and component of each row."] = None
    held: Annotated[int, "Rows left out because a boundary condition holds them."] = 0
    parts: Annotated[dict[str, coo_array], "Stiffness of parts of the structure, sparse, by their names."] = (
        field(default_factory=dict)
    )
    global_rows: Annotated[
        bool, "Whether the rows are along the global axes, whatever frames a deck gives to nodes."
    ] = False
    deck: Annotated[
        Deck | None, "Where the nodes are, if it was given; displacements have been turned out of its frames."
    ] = None
    remarks: Annotated[tuple[str, ...], "What was done to the rows and should be known."] = ()

    def row(self, label: Label) -> int | None:
        """The row of a label (zero-based); None if there is none."""
        return None if self.labels is None or label not in self.labels else self.labels.index(label)

    @property
    def size(self) -> int:
        """How many rows the matrices have; 0 without any."""
        return next((int(matrix.shape[0]) for matrix in self.matrices.values()), 0)

    @property
    def inner(self) -> NDArray[np.bool_]:
        """The rows of elements alone, as of incompatible modes: their nodes are none of the deck's."""
        known = None if self.deck is None else self.deck.nodes
        return np.array([known is not None and label.node not in known for label in self.labels or ()], bool)

    @property
    def counted(self) -> str:
        """How many rows there are."""
        own = int(self.inner.sum())
        return f"{self.size} rows" + (
            f" ({own} of them elements' own, such as incompatible modes)" if own else ""
        )

    def name(self, row: int) -> str:
        """A row by its number and, where it is known, its label."""
        return f"row {row}" if self.labels is None else f"row {row} ({self.labels[row]})"

    def no_row(self, given: str) -> str:
        """Why `given` names no row, and what would: the end of a sentence."""
        if self.labels is None:
            return (
                f"is {given[:40]!r}, but the files do not tell the nodes of their rows: give the row, or a "
                f"file of labels ({', '.join(f'name{s}' for s in suffixes('labels'))}) beside the matrices"
            )
        wanted = parsed(given)
        if wanted is None:
            return f"must be a row or a label such as {self.labels[0]}, got {given[:40]!r}"
        there = [label for label in self.labels if label.node == wanted.node]
        if there:
            return f"is {given}, but node {wanted.node} has the DOFs {', '.join(map(str, there[:12]))}"
        nodes = f"{self.labels[0].node} to {max(label.node for label in self.labels)}"
        return f"is {given}, but there is no node {wanted.node} in use (nodes {nodes})"


def read_set(paths: Mapping[str, Path], mapping: Path | None = None) -> MatrixSet:
    """Read the matrices of a structure.

    Rows that files label (Abaqus, DMIG) are brought together by their labels; a file of labels, given or
    found beside a matrix under its name, names the rows as they stand.

    Parameters
    ----------
    paths : file of each of M, K and C, and of parts (`PART` and a name).
    mapping : a file of labels.

    Raises
    ------
    MatrixFileError
        A file that cannot be used, or files that do not belong together.
    """
    return put_together({key: read_labelled(path, key) for key, path in paths.items()}, paths, mapping)


def put_together(
    parts: Mapping[str, Labelled], paths: Mapping[str, Path], mapping: Path | None = None
) -> MatrixSet:
    """The structure of matrices that were read from `paths`, as `read_set` makes it.

    Raises
    ------
    MatrixFileError
        A file of labels that cannot be used.
    """
    own = all(reader_of(path).global_rows for path in paths.values())
    return replace(_joined(parts, paths, mapping), global_rows=own)


def _joined(parts: Mapping[str, Labelled], paths: Mapping[str, Path], mapping: Path | None) -> MatrixSet:
    if all(part.labels is not None for part in parts.values()):
        return _together(parts)
    most = max(part.matrix.shape[0] for part in parts.values())
    matrices = {
        key: part.matrix if part.sized else _with_empty(part.matrix, most) for key, part in parts.items()
    }
    sizes = {key: matrix.shape[0] for key, matrix in matrices.items()}
    if len(set(sizes.values())) > 1:
        return _apart(matrices)
    found = mapping or next((name for name in map(labels_beside, paths.values()) if name), None)
    labels = next((part.labels for part in parts.values() if part.labels is not None), None)
    if found is not None:
        labels = labels_of(found)
        size = next(iter(sizes.values()))
        if len(labels) != size:
            twice = (
                ": the real and imaginary parts of a cyclic step; store the sector without *CYCLIC SYMMETRY"
                if size == 2 * len(labels)
                else ""
            )
            raise MatrixFileError(f"{str(found)!r} names {len(labels)} rows, the matrices have {size}{twice}")
    return _apart(matrices, labels)


def _with_empty(matrix: coo_array, size: int) -> coo_array:
    """The matrix with empty rows behind its own."""
    return coo_array((matrix.data, (matrix.row, matrix.col)), shape=(size, size))


def _apart(
    matrices: Mapping[str, coo_array], labels: tuple[Label, ...] | None = None, held: int = 0
) -> MatrixSet:
    """The set with parts of the structure under their names."""
    parts = {key.removeprefix(PART): each for key, each in matrices.items() if key.startswith(PART)}
    whole = {key: each for key, each in matrices.items() if not key.startswith(PART)}
    return MatrixSet(matrices=whole, labels=labels, held=held, parts=parts)


def labels_of(path: Path) -> tuple[Label, ...]:
    """Read a file of labels.

    Raises
    ------
    MatrixFileError
        It cannot be read, or names no rows.
    """
    try:
        return read_labels(path)
    except FormatError as error:
        raise MatrixFileError(f"{str(path)!r}: {error}") from error
    except OSError as error:
        raise MatrixFileError(f"{str(path)!r} cannot be read: {error.strerror or error}") from error


def _together(parts: Mapping[str, Labelled]) -> MatrixSet:
    """Matrices with a row for each label of any of them, those that are held left out."""
    every = {label for part in parts.values() for label in part.labels or ()}
    held = {label for part in parts.values() for label in part.held}
    labels = tuple(sorted(every - held, key=lambda label: label.place))
    if not labels:
        raise MatrixFileError("every DOF is held by a boundary condition: none is left")
    row = {label: i for i, label in enumerate(labels)}
    matrices = {}
    for key, part in parts.items():
        to = np.array([row.get(label, -1) for label in part.labels or ()])
        rows, columns = to[part.matrix.row], to[part.matrix.col]
        kept = (rows >= 0) & (columns >= 0)
        matrices[key] = coo_array(
            (part.matrix.data[kept], (rows[kept], columns[kept])), shape=(len(labels), len(labels))
        )
    return _apart(matrices, labels, len(held))


def in_si(found: MatrixSet, units: str) -> MatrixSet:
    """The same matrices in SI units.

    Parameters
    ----------
    units : of the files, a key of `UNITS`: ``mm`` is mm, t, N, s; ``in`` is in, lbf s²/in, lbf, s. Rotations
        are told by the labels; without any, every row is a displacement.
    """
    along, about = UNITS[units]
    if along == 1.0:
        return found
    turns = np.array([label.rotation for label in found.labels or ()] or [False] * found.size)
    scale = diags_array(np.sqrt(np.where(turns, about, along)))
    scaled, parts = (
        {key: coo_array(scale @ csr_array(matrix) @ scale) for key, matrix in given.items()}
        for given in (found.matrices, found.parts)
    )
    return replace(found, matrices=scaled, parts=parts)


_ALIGNED = 1e-9  # component of a unit vector that counts as none
Rows = dict[int, int]  # component 0, 1, 2 of a vector: its row


def in_global(found: MatrixSet, deck: Deck | None) -> MatrixSet:
    """The matrices with their rows along the global axes, as far as the deck gives nodes other ones.

    Where a boundary condition holds a node along an axis of its own, what is left of the vector may span no
    global axes: those rows stay, as components U1 to U3 (UR1 to UR3).

    Raises
    ------
    ValueError
        The rows have no names, or the axes of a node are not known.
    """
    if deck is None or not deck.systems or not found.matrices:
        return replace(found, deck=deck)
    if found.labels is None:
        raise ValueError(
            f"node {min(deck.systems)} of the deck moves along axes of its own, and the files do not tell "
            "the nodes of their rows: give a file of labels (`mapping`)"
        )
    vectors = _vectors(found.labels, deck)
    nodes = [label // 2 for label in vectors]
    axes = frames(deck, nodes)
    labels = list(found.labels)
    entries: list[tuple[int, int, float]] = []
    kept: set[int] = set()
    spans = [_span(R, sorted(rows), lost=found.global_rows)
             for rows, R in zip(vectors.values(), axes, strict=True)]  # fmt: skip
    # Where one node of a system cannot be turned its partner on the other boundary must stay as well.
    whole = {id(deck.systems[node]) for node, span in zip(nodes, spans, strict=True) if span is None}
    for (key, rows), R, span in zip(vectors.items(), axes, spans, strict=True):
        node, about = divmod(key, 2)
        here = sorted(rows)
        if span is None or (len(here) < 3 and id(deck.systems[node]) in whole):
            kept.add(node)
            for i in here:
                labels[rows[i]] = Label(node, OWN_COMPONENTS[3 * about + i])
        elif not found.global_rows:
            for at, i in zip(here, span, strict=True):
                labels[rows[at]] = Label(node, COMPONENTS[3 * about + i])
                entries += [(rows[at], rows[j], float(R[i, j])) for j in here]
    remarks = (*found.remarks, *_remarks(found, sorted(set(nodes)), sorted(kept)))
    matrices, parts = found.matrices, found.parts
    if entries:
        T = _turn(entries, len(labels))
        matrices, parts = (
            {key: coo_array(T @ csr_array(matrix) @ T.T) for key, matrix in given.items()}
            for given in (found.matrices, found.parts)
        )
    return replace(found, matrices=matrices, parts=parts, labels=tuple(labels), deck=deck, remarks=remarks)


def _vectors(labels: tuple[Label, ...], deck: Deck) -> dict[int, Rows]:
    """Rows of each vector in a frame of its own, by twice its node, and one more for rotations."""
    vectors: dict[int, Rows] = {}
    for row, label in enumerate(labels):
        if label.node in deck.systems and label.component in COMPONENTS:
            at = COMPONENTS.index(label.component)
            vectors.setdefault(2 * label.node + at // 3, {})[at % 3] = row
    return vectors


def _span(R: NDArray[np.float64], here: list[int], *, lost: bool) -> list[int] | None:
    """The components along global axes that span the motions of some rows; None: there are none.

    Parameters
    ----------
    lost : whether the rows are along the global axes already; then those that are left out are looked at.
    """
    if len(here) == 3:
        return here
    if lost:
        away = [i for i in range(3) if i not in here]
        used = np.flatnonzero((np.abs(R[away]) > _ALIGNED).any(axis=0))
        return here if used.size == len(away) else None
    used = np.flatnonzero((np.abs(R[:, here]) > _ALIGNED).any(axis=1))
    return used.tolist() if used.size == len(here) else None


def _turn(entries: list[tuple[int, int, float]], size: int) -> csr_array:
    """T of its blocks, 1 on the diagonal of all other rows."""
    rows, columns, values = (np.array(part) for part in zip(*entries, strict=True))
    rest = np.setdiff1d(np.arange(size), rows)
    data = np.concatenate([values, np.ones(rest.size)])
    places = (np.concatenate([rows, rest]), np.concatenate([columns, rest]))
    return csr_array(coo_array((data, places), shape=(size, size)))


def _remarks(found: MatrixSet, nodes: list[int], kept: list[int]) -> list[str]:
    if not nodes:
        return []
    one = nodes[0] if not kept or nodes[0] != kept[0] else nodes[-1]
    if found.global_rows:
        said = [
            f"the deck gives {len(nodes)} nodes axes of their own; CalculiX stores matrices along the global "
            "ones all the same, and they are read so"
        ]
    else:
        said = [
            f"{len(nodes)} nodes move along axes of their own in the files; their rows are turned: "
            f"{one}.UX is along the global x"
        ]
    if kept:
        said.append(
            f"{len(kept)} nodes are held along an axis of their own; their rows stay as they are, "
            f"{kept[0]}.U1 to {kept[0]}.U3"
        )
    return said
