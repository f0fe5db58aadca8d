"""`stickslip import --reduce`: large matrices become small ones in a file of their own, of a sector too."""

from __future__ import annotations

import math
import time
from collections.abc import Mapping
from dataclasses import dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from service.cli.failures import refused
from service.cli.options.inputs import amount, count, new_file, relative, text
from service.cli.options.parameters import Json
from service.errors import InputError
from service.rendering.text import print_pairs
from solver.results import units
from solver.results.files import whole

if TYPE_CHECKING:
    from collections.abc import Mapping, Sequence

    from solver.matrices.craig_bampton import Reduced
    from solver.matrices.load_set import MatrixSet
    from solver.matrices.sectors.sector_reduction import ReducedSector


@dataclass(frozen=True, slots=True, kw_only=True)
class ReducedModel:
    """A reduced model in its file."""

    path: Path
    reduced: Reduced
    rows: dict[str, int]
    given: MatrixSet
    seconds: float
    motions: Annotated[dict[str, Any] | None, "Facts of its motions, if those are for contacts."] = None

    @property
    def good_to_hz(self) -> float:
        """Frequency up to which every frequency is exact to 0.1 % [Hz]."""
        good = self.reduced.quality.good_to_hz
        return good if self.motions is None else min(good, self.motions["free_hz"])

    def table(self, target: Path) -> dict[str, object]:
        """The table [structure] of a scene at `target`."""
        keys = list(self.reduced.matrices) if self.motions is None else ["modes"]
        return {"kind": "matrices", **dict.fromkeys(keys, relative(self.path, target))}

    def for_contacts(self, raw: Mapping[str, Any], count: int | None) -> ReducedModel:
        """The same, written, in motions for the contacts of the tables of a scene, `count` or enough."""
        import numpy as np

        from solver.errors import SettingError
        from solver.matrices.values import Matrix
        from solver.scene.scene import Scene
        from solver.studies.contact_reduction import reduce_for_contacts

        start, matrices = time.perf_counter(), {key: Matrix(self.reduced.matrices[key]) for key in "MK"}
        scene = Scene.from_dict({**raw, "structure": {**raw["structure"], **matrices}})
        try:
            found = reduce_for_contacts(scene, count)
        except SettingError as error:
            raise InputError(f"`--patch`: {error}; --reduce --modes N keeps every DOF") from error
        with whole(self.path) as temporary:
            np.savez_compressed(temporary, omega2=found.modes.omega2, modes=found.modes.modes)
        facts = found.facts(self.given, self.reduced.basis)
        return replace(self, motions=facts, seconds=self.seconds + time.perf_counter() - start)

    def facts(self) -> dict[str, object]:
        """What the reduction kept, for programs."""
        quality = self.reduced.quality
        return self.reduced.facts(list(self.rows)) | {
            "file": str(self.path), "dofs": self.given.size, "seconds": self.seconds, "motions": self.motions,
            "effective_mass": quality.effective_mass.tolist(), "shift_hz": quality.shift_hz,
            "rigid_body_modes": quality.rigid_body_modes,
        }  # fmt: skip

    def pairs(self) -> list[tuple[str, str]]:
        """What the reduction kept, for people."""
        quality, reduced, found = self.reduced.quality, self.reduced, self.motions
        begun = f"{self.given.counted} to {len(self.rows)} DOFs and {reduced.modes} modes"
        end = f"in {units.quantity(self.seconds, 's')}, written to {self.path}"
        if found is not None:
            free, stuck, off = found["free_hz"], found["stuck_hz"], found["error"]
            shares = [f"{100 * share:.1f} % in {way}" for way, share in found["mass_carried"].items()]
            return [
                ("reduced", f"{begun}, and those to {found['count']} motions, {end}"),
                ("motions", f"modes with the contacts free to {units.hertz(free)} and stuck to "
                            f"{units.hertz(stuck)}, static ones under forces and loads"),
                ("error", "no peak was found to tell it" if off is None else
                          f"{units.number(off, 2)} of the peak, against all motions with one harmonic"),
                ("mass carried", ", ".join(shares)),
            ]  # fmt: skip
        held = ", ".join(units.number(f) for f in quality.held_hz[:6]) + (", …" if reduced.modes > 6 else "")
        least = min(zip(quality.mass_carried, self.rows, strict=True), default=(0.0, ""))
        pairs = [
            ("reduced", f"{begun} {end}"),
            ("modes kept", f"{held} Hz, the highest {units.hertz(reduced.highest_hz)}, with the DOFs held"
                           if held else "none"),
            ("good to", f"{units.hertz(quality.good_to_hz)}: frequencies up to there are estimated 0.1 % "
                        "exact; harmonics that matter should lie below"),
            ("errors", "first frequencies too high by "
                       + (", ".join(units.number(e, 2) for e in quality.system_error[:6]) or "nothing")),
            ("mass carried", f"{100 * least[0]:.1f} % of the inertia or more (least for {least[1]})"),
            ("static check", f"residual {units.number(quality.static_residual, 2)}"),
        ]  # fmt: skip
        if quality.shift_hz:
            pairs.append(("free rest", f"not held by these DOFs; shifted by {units.hertz(quality.shift_hz)}"))
        return pairs


def reduced_file(asked: ImportOptions, target: Path) -> Path:
    """Where the reduced model, or the reduced sector, goes, which must not exist."""
    from solver.matrices.craig_bampton import WRITTEN

    name = asked.reduced or str(target.with_name(f"{target.stem}-reduced.npz"))
    arrays = asked.sectors is not None or asked.for_contacts
    return new_file("--reduced", name, (".npz",) if arrays else WRITTEN)


def reduce(
    given: MatrixSet, rows: Mapping[str, int], modes: int | None, up_to: float | None, path: Path
) -> ReducedModel:
    """Reduce matrices onto the DOFs in `rows` and write them to `path`."""
    from solver.matrices.craig_bampton import craig_bampton, write_reduced
    from solver.matrices.diagnostics import refuse
    from solver.matrices.values import DofTable

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
        found = craig_bampton(
            matrices["M"], matrices["K"], matrices.get("C"), dofs, modes, up_to_hz=up_to, keep_basis=True
        )
    except ValueError as error:
        raise InputError(f"`--reduce`: {error}") from error
    seconds = time.perf_counter() - start
    with whole(path) as temporary:
        write_reduced(temporary, found, list(dofs))
    rows = {name: i for i, name in enumerate(dofs)}
    return ReducedModel(path=path, reduced=found, rows=rows, given=given, seconds=seconds)


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
_REDUCE = (
    "Reduce a large model once, onto the DOFs in use and modes of the rest. Left out with --patch, the "
    "structure is written in few motions besides, chosen for the contacts."
)
_MODES = (
    "With --reduce: modes of the rest to keep. With --patch alone: motions, in place of as many as it takes."
)
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
    modes: Annotated[int | None, count("--modes", "N", _MODES)] = None
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

    @property
    def for_contacts(self) -> bool:
        """Whether the structure is written in motions for its contacts: of faces, unless it is said how."""
        otherwise = self.reduce_once or self.keep_modes is not None or self.sectors is not None
        return bool(self.patches) and not otherwise


@dataclass(frozen=True, slots=True, kw_only=True)
class DiskOptions:
    """What the options say of the disk."""

    sectors: int
    engine_order: int
    deck: Path | None
    axis: list[float]
    cyclic: Annotated[dict[str, object], "What the table [structure.cyclic] says beside axis and deck."]

    def joined(self, target: Path) -> dict[str, object]:
        """The table [structure.cyclic] of a scene at `target`."""
        nodes = {} if self.deck is None else {"nodes": relative(self.deck, target)}
        return {"axis": self.axis, **self.cyclic, **nodes}


def _nodes(text: str) -> str | list[int]:
    parts = [part.strip() for part in text.split(",")]
    return [int(part) for part in parts] if all(part.isdecimal() for part in parts) else text


def disk(asked: ImportOptions, deck: Path | None) -> DiskOptions | None:
    """What the options say of a disk; None without --sectors.

    InputError for those of a disk without --sectors, or values that are none.
    """
    if asked.sectors is None:
        others: dict[str, object] = {
            "--low": asked.low, "--high": asked.high, "--axis": asked.axis,
            "--engine-order": asked.engine_order,
        }  # fmt: skip
        if not asked.patches:  # which take it too
            others["--tolerance"] = asked.tolerance
        given = next((name for name, value in others.items() if value is not None), None)
        if given is not None:
            raise InputError(f"`{given}` is of a sector of a disk: give --sectors N too")
        return None
    if asked.sectors < 1:
        raise InputError(f"`--sectors` must be >= 1, got {asked.sectors}")
    if (asked.low is None) != (asked.high is None):
        raise InputError("`--low` and `--high` go together, or are both left out (then found by position)")
    cyclic: dict[str, object] = {}
    if asked.low is not None and asked.high is not None:
        cyclic |= {"low": _nodes(asked.low), "high": _nodes(asked.high)}
    if asked.pair_by != "position":
        cyclic["pair_by"] = asked.pair_by
    if asked.tolerance is not None:
        cyclic["tolerance"] = asked.tolerance
    order = 1 if asked.engine_order is None else asked.engine_order
    return DiskOptions(
        sectors=asked.sectors, engine_order=order, deck=deck, axis=_axis(asked.axis), cyclic=cyclic
    )  # fmt: skip


def _axis(text: str | None) -> list[float]:
    named = {"x": [1.0, 0.0, 0.0], "y": [0.0, 1.0, 0.0], "z": [0.0, 0.0, 1.0]}
    if text is None or text.lower() in named:
        return named[(text or "z").lower()]
    try:
        found = [float(part) for part in text.split(",")]
    except ValueError:
        found = []
    if len(found) != 3 or not any(found):
        raise InputError(f"`--axis` must be x, y, z or a direction such as 0,0,1, got {text!r}")
    return found


@dataclass(frozen=True, slots=True, kw_only=True)
class WrittenSector:
    """A reduced sector in its file."""

    path: Path
    reduced: ReducedSector
    full: int
    pairs_of_rows: int
    axis: list[float]
    sectors: int
    seconds: float

    @property
    def rows(self) -> dict[str, int]:
        """Row of each DOF in use."""
        return self.reduced.rows

    @property
    def good_to_hz(self) -> float:
        """Frequency up to which those of every nodal diameter are exact to 0.1 % [Hz]."""
        return self.reduced.good_to_hz

    def table(self, target: Path) -> dict[str, object]:
        """The table [structure] of a scene at `target`."""
        name = relative(self.path, target)
        return {"kind": "matrices", "sectors": self.sectors, "diameters": name, "cyclic": {"axis": self.axis}}

    def facts(self) -> dict[str, object]:
        """What the reduction kept, for programs."""
        found = self.reduced
        return {
            "file": str(self.path), "dofs": self.full, "modes": found.modes, "highest_hz": found.highest_hz,
            "good_to_hz": found.good_to_hz, "seconds": self.seconds,
            "diameters": [
                {
                    "diameter": n, "frequencies_hz": quality.system_hz[:10].tolist(),
                    "good_to_hz": quality.good_to_hz, "static_residual": quality.static_residual,
                    "relative_errors": [
                        error if math.isfinite(error) else None
                        for error in quality.system_error[:10].tolist()
                    ],
                    "seconds": seconds,
                }
                for n, quality, seconds in zip(
                    found.matrices.diameters, found.quality, found.seconds, strict=True
                )
            ],
        }  # fmt: skip

    def pairs(self) -> list[tuple[str, str]]:
        """What the reduction kept, for people."""
        found = self.reduced
        told = [
            ("reduced", f"{self.full} rows to {len(self.rows)} DOFs and {found.modes} modes at each of "
                        f"{len(found.quality)} nodal diameters in {units.duration(self.seconds)}, in "
                        f"{self.path}"),
            ("boundary", f"{self.pairs_of_rows} rows of the high boundary follow the low one"),
            ("good to", f"{units.hertz(found.good_to_hz)}: frequencies up to there are estimated 0.1 % exact "
                        "at every nodal diameter; harmonics that matter should lie below"),
        ]  # fmt: skip
        for n, quality, seconds in zip(found.matrices.diameters, found.quality, found.seconds, strict=True):
            first = ", ".join(units.number(f) for f in quality.system_hz[:4])
            high = f"too high by {max(quality.system_error[:4].tolist(), default=0.0):.1e} of it at most"
            told.append((f"diameter {n}", f"{first} Hz, …, {high}; {units.quantity(seconds, 's')}"))
        return told


def reduce_disk(
    given: MatrixSet, rows: Mapping[str, int], modes: int | None, of: DiskOptions, path: Path,
    mistune: Sequence[str] = (), metres: float = 1.0,
) -> WrittenSector:  # fmt: skip
    """Reduce a sector at every nodal diameter its engine order meets, and write it to `path`.

    Parameters
    ----------
    mistune : names of what mistuning may scale; then all nodal diameters are built.
    metres : the unit of the deck.
    """
    from scipy.sparse import csr_array

    from solver.errors import SceneError
    from solver.matrices.diagnostics import refuse
    from solver.matrices.sectors.loading import check_part_sizes, parts_to_reduce
    from solver.matrices.sectors.sector_reduction import diameters_met, reduce_sector, write_diameters

    if modes is None or modes < 0:
        raise InputError("`--reduce` of a sector takes --modes N: as many at each nodal diameter")
    begun = time.perf_counter()
    matrices: dict[str, Any] = {key: csr_array(matrix) for key, matrix in given.matrices.items()}
    try:
        refuse(given, reduced=True)
        ends = checked_boundaries(given, of, metres)
        gone = ends.elimination(matrices["M"].shape[0], of.sectors)
        check_part_sizes(given)
        parts = parts_to_reduce({"of": mistune}, given)
        met = range(of.sectors // 2 + 1) if parts else diameters_met([of.engine_order], of.sectors)
        reduced = reduce_sector(matrices, gone, rows, modes, met, of.sectors, parts, ends.drawn)
    except SceneError as error:
        raise refused([error.issues[0].at("mistune")], {"mistune": "--mistune"}) from error
    except ValueError as error:
        raise InputError(f"`--reduce`: {error}") from error
    with whole(path) as temporary:
        write_diameters(temporary, reduced, ends.outline)
    return WrittenSector(
        path=path, reduced=reduced, full=int(matrices["M"].shape[0]), axis=of.axis, sectors=of.sectors,
        pairs_of_rows=int(gone.here.shape[0] - gone.kept.size), seconds=time.perf_counter() - begun,
    )  # fmt: skip


def checked_boundaries(given: MatrixSet, of: DiskOptions, metres: float = 1.0) -> Any:
    """The boundaries of the sector as rows.

    InputError for sets or nodes that are not there, or do not match.
    """
    from solver.errors import SceneError
    from solver.matrices.sectors.loading import boundaries

    # Relative to the current folder: the scene's own may be another one.
    table = of.joined(Path.cwd() / "scene.toml")
    try:
        return boundaries(table, given, of.sectors, Path.cwd(), metres)
    except SceneError as error:
        issue = error.issues[0]
        raise InputError(issue.said(f"--{issue.name.replace('_', '-')}")) from error


def found_by_position(of: DiskOptions | None) -> list[str]:
    """What to know of boundaries that were not named."""
    if of is None:
        return []
    if of.deck is None:
        return [
            "there is no deck: the rows are taken to be along the global axes; if nodes have frames of their "
            "own (GRID field 7, NBLOCK angles, *TRANSFORM), give it with --nodes"
        ]
    if "low" in of.cyclic:
        return []
    return [
        "the boundaries were found by position: faces that only touch the next sector, as of shrouds, lie "
        "there too and are joined with it; where there are any, name the sets with --low and --high"
    ]
