"""The options of `stickslip import`."""

from __future__ import annotations

from typing import Annotated

import typer

from service.cli.options.numeric import amount, count
from service.rendering.tables.text import print_pairs

Files = Annotated[
    list[str],
    typer.Argument(
        metavar="FILES",
        help="M K [C], in this order or named so; or one file with M, K, C or modes; and maybe a file that "
        "names the rows.",
    ),
]
Out = Annotated[str, typer.Option("--out", metavar="SCENE.toml", help="The scene to write.")]
Dofs = Annotated[
    list[str] | None,
    typer.Option(
        "--dof", metavar="NAME=ROW",
        help="A DOF in use and its row, zero-based, or its node and component (tip=1203.UX); repeatable.",
    ),
]  # fmt: skip
Excite = Annotated[
    str | None,
    typer.Option("--excite", metavar="NAME", help="DOF of the force; the first --dof if left out."),
]
Observed = Annotated[
    str | None,
    typer.Option("--observe", metavar="NAME", help="DOF to observe; that of the force if left out."),
]
From = Annotated[float | None, amount("--from", "HZ", "Start of the band of interest.")]
To = Annotated[float | None, amount("--to", "HZ", "End of the band of interest.")]
Keep = Annotated[
    int | None,
    count(
        "--keep-modes", "N", "Let the scene refer to the full matrices and reduce them whenever it is loaded."
    ),
]
Reduce = Annotated[
    bool,
    typer.Option("--reduce", help="Reduce a large model once, onto the DOFs in use and modes of the rest."),
]
ModesKept = Annotated[
    int | None,
    count("--modes", "N", "With --reduce: modes of the rest to keep."),
]
UpTo = Annotated[
    float | None,
    amount("--up-to", "HZ", "With --reduce: keep all modes up to here."),
]
ReducedFile = Annotated[
    str | None,
    typer.Option("--reduced", metavar="F", help="Where the reduced model goes (.npz, .mat)."),
]
Units = Annotated[
    str,
    typer.Option("--units", metavar="U", help="Units of the files: SI, mm (mm, t, N, s), in (in, lbf, s)."),
]
Mapping = Annotated[
    str | None,
    typer.Option("--mapping", metavar="F", help="A file that names the rows."),
]


SectorCount = Annotated[
    int | None,
    count("--sectors", "N", "The files are one of so many sectors of a disk."),
]
Low = Annotated[
    str | None,
    typer.Option(
        "--low", metavar="SET",
        help="Nodes of the boundary to the sector before: a set of the deck, or numbers with commas.",
    ),
]  # fmt: skip
High = Annotated[
    str | None,
    typer.Option(
        "--high", metavar="SET",
        help="Those of the boundary to the next sector: where the low one comes by the right-hand turn about "
        "the axis. Both left out: found by position.",
    ),
]  # fmt: skip
Deck = Annotated[
    str | None,
    typer.Option("--nodes", metavar="DECK", help="The input deck with the nodes and their sets."),
]
Axis = Annotated[
    str | None, typer.Option("--axis", metavar="A", help="Axis of the disk: x, y, z or 0,0,1; z if left out.")
]
PairBy = Annotated[
    str, typer.Option("--pair-by", metavar="HOW", help="Nodes are paired by position, or by their order.")
]
Tolerance = Annotated[
    float | None,
    amount("--tolerance", "D", "Nodes this near are one place, in units of the deck."),
]
Mistune = Annotated[
    list[str] | None,
    typer.Option(
        "--mistune", metavar="NAME[=FILE]",
        help="With --sectors --reduce: what mistuning may scale: K or M of the whole sector, or the "
        "stiffness of a part of it (blade=blade-K.mtx), rows as in K; repeatable. Builds every nodal "
        "diameter.",
    ),
]  # fmt: skip
EngineOrder = Annotated[
    int | None,
    count(
        "--engine-order", "E",
        "Of the force; 1 if left out. --reduce builds the nodal diameters that its harmonics meet.",
    ),
]  # fmt: skip


def _print_formats(wanted: bool) -> None:
    if wanted:
        from solver.matrices.readers.registry import readers

        print_pairs("Files", [(", ".join(one.suffixes), one.help.replace("`", "")) for one in readers()])
        raise typer.Exit


Formats = Annotated[
    bool,
    typer.Option(
        "--formats", callback=_print_formats, is_eager=True, help="Print the formats that can be read."
    ),
]

Contacts = Annotated[
    list[str] | None,
    typer.Option(
        "--contact", metavar="NAME=A:B,…",
        help="A contact of two DOFs, or of one and ground, with its numbers: "
        "shroud=tip:ground,kt=1e6,mu=0.3,N0=100; repeatable.",
    ),
]  # fmt: skip
Forces = Annotated[
    list[str] | None,
    typer.Option("--force", metavar="DOF=N", help="A force [N] on a DOF, instead of --excite; repeatable."),
]
PatchTexts = Annotated[
    list[str] | None,
    typer.Option(
        "--patch", metavar="NAME=A:B,…",
        help="Two faces that lie on each other: sets of the deck, or a set and ground, with numbers of the "
        "face: root=BLADE:DISK,normal=y,kt=1e8,kn=2e8,mu=0.3,N0=900; repeatable.",
    ),
]  # fmt: skip
