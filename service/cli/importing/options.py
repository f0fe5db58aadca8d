"""The options of `stickslip import`."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Annotated

import typer

from service.cli.options.inputs import amount, count, text
from service.cli.options.shared import Json
from service.rendering.tables.text import print_pairs

_Texts = list[str] | None


def _print_formats(wanted: bool) -> None:
    if wanted:
        from solver.matrices.readers.registry import readers

        print_pairs("Files", [(", ".join(one.suffixes), one.help.replace("`", "")) for one in readers()])
        raise typer.Exit


_FILES = (
    "M K [C], in this order or named so; or one file with M, K, C or modes; and maybe a file that names the "
    "rows."
)
_DOF = "A DOF in use and its row, zero-based, or its node and component (tip=1203.UX); repeatable."
_KEEP = "Let the scene refer to the full matrices and reduce them whenever it is loaded."
_REDUCE = "Reduce a large model once, onto the DOFs in use and modes of the rest."
_LOW = "Nodes of the boundary to the sector before: a set of the deck, or numbers with commas."
_HIGH = (
    "Those of the boundary to the next sector: where the low one comes by the right-hand turn about the "
    "axis. Both left out: found by position."
)
_ORDER = "Of the force; 1 if left out. --reduce builds the nodal diameters that its harmonics meet."
_CONTACT = (
    "A contact of two DOFs, or of one and ground, with its numbers: "
    "shroud=tip:ground,kt=1e6,mu=0.3,N0=100; repeatable."
)
_PATCH = (
    "Two faces that lie on each other: sets of the deck, or a set and ground, with numbers of the face: "
    "root=BLADE:DISK,normal=y,kt=1e8,kn=2e8,mu=0.3,N0=900; repeatable."
)
_MISTUNE = (
    "With --sectors --reduce: what mistuning may scale: K or M of the whole sector, or the stiffness of a "
    "part of it (blade=blade-K.mtx), rows as in K; repeatable. Builds every nodal diameter."
)
_FORMATS = typer.Option(
    "--formats", callback=_print_formats, is_eager=True, help="Print the formats that can be read."
)


@dataclass(frozen=True, slots=True, kw_only=True)
class ImportOptions:
    """What was given, in the order in which help lists it."""

    files: Annotated[list[str], typer.Argument(metavar="FILES", help=_FILES)]
    out: Annotated[str, text("--out", "SCENE.toml", "The scene to write.")]
    dofs: Annotated[_Texts, text("--dof", "NAME=ROW", _DOF)] = None
    excite: Annotated[
        str | None, text("--excite", "NAME", "DOF of the force; the first --dof if left out.")
    ] = None
    observe: Annotated[
        str | None, text("--observe", "NAME", "DOF to observe; that of the force if left out.")
    ] = None
    start: Annotated[float | None, amount("--from", "HZ", "Start of the band of interest.")] = None
    stop: Annotated[float | None, amount("--to", "HZ", "End of the band of interest.")] = None
    keep_modes: Annotated[int | None, count("--keep-modes", "N", _KEEP)] = None
    reduce_once: Annotated[bool, typer.Option("--reduce", help=_REDUCE)] = False
    modes: Annotated[int | None, count("--modes", "N", "With --reduce: modes of the rest to keep.")] = None
    up_to: Annotated[float | None, amount("--up-to", "HZ", "With --reduce: keep all modes up to here.")] = (
        None
    )
    reduced: Annotated[str | None, text("--reduced", "F", "Where the reduced model goes (.npz, .mat).")] = (
        None
    )
    units: Annotated[
        str, text("--units", "U", "Units of the files: SI, mm (mm, t, N, s), in (in, lbf, s).")
    ] = "SI"
    mapping: Annotated[str | None, text("--mapping", "F", "A file that names the rows.")] = None
    sectors: Annotated[
        int | None, count("--sectors", "N", "The files are one of so many sectors of a disk.")
    ] = None
    low: Annotated[str | None, text("--low", "SET", _LOW)] = None
    high: Annotated[str | None, text("--high", "SET", _HIGH)] = None
    nodes: Annotated[str | None, text("--nodes", "DECK", "The input deck with the nodes and their sets.")] = (
        None
    )
    axis: Annotated[str | None, text("--axis", "A", "Axis of the disk: x, y, z or 0,0,1; z if left out.")] = (
        None
    )
    pair_by: Annotated[str, text("--pair-by", "HOW", "Nodes are paired by position, or by their order.")] = (
        "position"
    )
    tolerance: Annotated[
        float | None, amount("--tolerance", "D", "Nodes this near are one place, in units of the deck.")
    ] = None
    engine_order: Annotated[int | None, count("--engine-order", "E", _ORDER)] = None
    contacts: Annotated[_Texts, text("--contact", "NAME=A:B,…", _CONTACT)] = None
    forces: Annotated[
        _Texts, text("--force", "DOF=N", "A force [N] on a DOF, instead of --excite; repeatable.")
    ] = None
    patches: Annotated[_Texts, text("--patch", "NAME=A:B,…", _PATCH)] = None
    mistune: Annotated[_Texts, text("--mistune", "NAME[=FILE]", _MISTUNE)] = None
    formats: Annotated[bool, _FORMATS] = False
    as_json: Json = False
