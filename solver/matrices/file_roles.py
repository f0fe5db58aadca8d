"""Which of several files is M, K or C, and which names the rows: by their names, suffixes and contents."""

from __future__ import annotations

import re
from collections.abc import Sequence
from pathlib import Path

from solver.matrices.files import MatrixFileError, array_names
from solver.matrices.readers import registry
from solver.matrices.readers.reader import ROLES

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
    naming = registry.label_suffixes()
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
