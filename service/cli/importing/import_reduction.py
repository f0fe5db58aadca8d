"""`stickslip import --reduce`: a large pair of matrices becomes a small one in a file of its own."""

from __future__ import annotations

import time
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from service.cli.options.inputs import amount, count, new_file, relative, text
from service.cli.options.shared import Json
from service.errors import InputError
from service.rendering.text import print_pairs
from solver.results.files import whole

if TYPE_CHECKING:
    from solver.matrices.load_set import MatrixSet
    from solver.matrices.reduction.craig_bampton import Reduced


@dataclass(frozen=True, slots=True, kw_only=True)
class ReducedModel:
    """A reduced model in its file."""

    path: Path
    reduced: Reduced
    rows: dict[str, int]
    full: int
    seconds: float

    @property
    def good_to_hz(self) -> float:
        """Frequency up to which every frequency is exact to 0.1 % [Hz]."""
        return self.reduced.quality.good_to_hz

    def table(self, target: Path) -> dict[str, object]:
        """The table [structure] of a scene at `target`."""
        name = relative(self.path, target)
        return {"kind": "matrices", **dict.fromkeys(self.reduced.matrices, name)}

    def facts(self) -> dict[str, object]:
        """What the reduction kept, for programs."""
        quality = self.reduced.quality
        return {
            "file": str(self.path), "dofs": self.full, "modes": self.reduced.modes,
            "highest_hz": self.reduced.highest_hz, "good_to_hz": quality.good_to_hz,
            "held_hz": quality.held_hz.tolist(), "static_residual": quality.static_residual,
            "mass_carried": dict(zip(self.rows, quality.mass_carried.tolist(), strict=True)),
            "effective_mass": quality.effective_mass.tolist(),
            "rigid_body_modes": quality.rigid_body_modes, "shift_hz": quality.shift_hz,
            "seconds": self.seconds,
        }  # fmt: skip

    def pairs(self) -> list[tuple[str, str]]:
        """What the reduction kept, for people."""
        quality, reduced = self.reduced.quality, self.reduced
        held = ", ".join(f"{f:.5g}" for f in quality.held_hz[:6]) + (", …" if reduced.modes > 6 else "")
        least = min(zip(quality.mass_carried, self.rows, strict=True), default=(0.0, ""))
        pairs = [
            ("reduced", f"{self.full} rows to {len(self.rows)} DOFs and {reduced.modes} modes in "
                        f"{self.seconds:.1f} s, written to {self.path}"),
            ("modes kept", f"{held} Hz, the highest {reduced.highest_hz:.5g} Hz, with the DOFs held"
                           if held else "none"),
            ("good to", f"{quality.good_to_hz:.5g} Hz: frequencies up to there are estimated 0.1 % exact; "
                        "harmonics that matter should lie below"),
            ("errors", "first frequencies too high by "
                       + (", ".join(f"{e:.1e}" for e in quality.system_error[:6]) or "nothing")),
            ("mass carried", f"{100 * least[0]:.1f} % of the inertia or more (least for {least[1]})"),
            ("static check", f"residual {quality.static_residual:.1e}"),
        ]  # fmt: skip
        if quality.shift_hz:
            pairs.append(("free rest", f"not held by these DOFs; shifted by {quality.shift_hz:.3g} Hz"))
        return pairs


def reduced_file(asked: ImportOptions, target: Path) -> Path:
    """Where the reduced model, or the reduced sector, goes, which must not exist."""
    from solver.matrices.reduction.craig_bampton import WRITTEN

    name = asked.reduced or str(target.with_name(f"{target.stem}-reduced.npz"))
    return new_file("--reduced", name, WRITTEN if asked.sectors is None else (".npz",))


def reduce(
    given: MatrixSet, rows: Mapping[str, int], modes: int | None, up_to: float | None, path: Path
) -> ReducedModel:
    """Reduce matrices onto the DOFs in `rows` and write them to `path`."""
    from solver.matrices.diagnostics import refuse
    from solver.matrices.matrix_validation import DofTable
    from solver.matrices.reduction.craig_bampton import craig_bampton, write_reduced

    if (modes is None) == (up_to is None):
        raise InputError(
            "`--reduce` takes one of --modes N and --up-to HZ: how many modes of the rest to keep"
        )
    if modes is not None and modes < 0:
        raise InputError(f"`--modes` must be >= 0, got {modes}")
    if up_to is not None and not 0.0 < up_to < 1e9:
        raise InputError(f"`--up-to` must be a frequency above 0, got {up_to:g}")
    start = time.perf_counter()
    matrices = given.matrices
    try:
        refuse(given, reduced=True)
        dofs = DofTable.read(dict(rows))
        found = craig_bampton(matrices["M"], matrices["K"], matrices.get("C"), dofs, modes, up_to_hz=up_to)
    except ValueError as error:
        raise InputError(f"`--reduce`: {error}") from error
    seconds = time.perf_counter() - start
    with whole(path) as temporary:
        write_reduced(temporary, found, list(dofs))
    return ReducedModel(
        path=path, reduced=found, rows={name: i for i, name in enumerate(dofs)},
        full=int(matrices["M"].shape[0]), seconds=seconds,
    )  # fmt: skip


_Texts = list[str] | None


def _print_formats(wanted: bool) -> None:
    if wanted:
        from solver.matrices.readers.reader_registry import readers

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
