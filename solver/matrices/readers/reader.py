"""What a reader of matrix files says of itself: names, endings, contents, and how to read them."""

from __future__ import annotations

import re
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

from solver.wording import documented

if TYPE_CHECKING:
    from solver.matrices.labels import Label

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
        "`array_parts.Labelled` with the node and component of each row. It may raise "
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
        "Reads positions and sets of nodes, a `solver.matrices.sectors.decks.Deck`.",
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
