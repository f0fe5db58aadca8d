"""`stickslip import`: matrices or modes from a finite-element program become a scene file."""

from __future__ import annotations

import math
import re
from collections.abc import Sequence
from contextlib import ExitStack
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from service.cli.importing.files import (
    Sources,
    deck_file,
    dof_table,
    read_sources,
    relative,
    rows_of,
    sources,
)
from service.cli.importing.options import (
    Axis,
    Contacts,
    Deck,
    Dofs,
    EngineOrder,
    Excite,
    Files,
    Forces,
    Formats,
    From,
    High,
    Keep,
    Low,
    Mapping,
    Mistune,
    ModesKept,
    Observed,
    Out,
    PairBy,
    PatchTexts,
    Reduce,
    ReducedFile,
    SectorCount,
    To,
    Tolerance,
    Units,
    UpTo,
)
from service.cli.importing.parts import contacts as contact_tables
from service.cli.importing.parts import excitation
from service.cli.importing.patches import Patches
from service.cli.importing.reduction import Written, reduce, reduced_file
from service.cli.importing.scene import band, toml
from service.cli.importing.sector import (
    Disk,
    WrittenSector,
    checked_boundaries,
    disk,
    found_by_position,
    reduce_disk,
    sector_file,
)
from service.cli.options.inputs import output_path
from service.errors import InputError
from service.rendering.tables.text import print_json, print_pairs
from solver.results.files import whole

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from solver.matrices.load_set import MatrixSet
    from solver.scene.scene import Scene

_RATIO = 0.001  # of a structure whose files hold no damping, which would have no bound at resonance


def import_scene(
    files: Files,
    out: Out,
    dofs: Dofs = None,
    excite: Excite = None,
    observe: Observed = None,
    start: From = None,
    stop: To = None,
    keep_modes: Keep = None,
    reduce_once: Reduce = False,
    modes: ModesKept = None,
    up_to: UpTo = None,
    reduced: ReducedFile = None,
    units: Units = "SI",
    mapping: Mapping = None,
    sectors: SectorCount = None,
    low: Low = None,
    high: High = None,
    nodes: Deck = None,
    axis: Axis = None,
    pair_by: PairBy = "position",
    tolerance: Tolerance = None,
    engine_order: EngineOrder = None,
    contacts: Contacts = None,
    forces: Forces = None,
    patches: PatchTexts = None,
    mistune: Mistune = None,
    _formats: Formats = False,
    as_json: Annotated[bool, typer.Option("--json", help="Print one JSON object.")] = False,
) -> None:
    """Make a scene of matrices or modes in files.

    The files are read and checked first. The scene refers to them or, with --reduce, to the reduced model,
    which is written beside it. Without --contact or --patch a template of a contact stands in the scene. With
    --sectors the matrices are of one sector of a disk, reduced at every nodal diameter that is met.
    """
    target = output_path("--out", out, (".toml",))
    if target is None or target.exists():
        raise InputError(f"`--out`: {out!r} exists already; give another name or remove it")
    if not reduce_once and not (modes is None and up_to is None and reduced is None):
        raise InputError("`--modes`, `--up-to` and `--reduced` go with --reduce")
    if reduce_once and keep_modes is not None:
        raise InputError("`--keep-modes` reduces on every load, --reduce once: keep one of them")
    deck = deck_file(nodes)
    of = disk(sectors, low, high, deck, axis, pair_by, tolerance, engine_order, patches=bool(patches))
    if mistune and not (reduce_once and sectors is not None):
        raise InputError(
            "`--mistune` goes with --sectors and --reduce; a scene that refers to its files names parts in "
            "[structure.parts]"
        )
    found = sources(files, mapping, units, mistune)
    given = read_sources(found, deck)
    faces = Patches(
        patches,
        None if given is None else given.deck,
        units,
        None if of is None else (of.sectors, of.axis),
        tolerance,
    )
    table = dof_table(dofs, found, given, patches=bool(patches))
    made = faces.made(given, table)
    table |= made.dofs
    parts = made.tables | {"contacts": contact_tables(contacts)}
    with ExitStack() as undo:
        structure, written = found.table(target), None
        if reduce_once:
            path = reduced_file(reduced, target) if of is None else sector_file(reduced, target)
            undo.callback(path.unlink, missing_ok=True)
            written = _reduced(given, table, modes, up_to, path, of, found)
            structure = written.table(target)
            table = dict(written.rows)
        else:
            kept = {} if keep_modes is None else {"keep_modes": keep_modes}
            gone = None if of is None else _gone(given, of)
            _checked(given, reduced=keep_modes is not None, gone=gone)
            structure |= kept if of is None else {"sectors": of.sectors, "cyclic": of.joined(target) | kept}
            if of is None and given is not None and given.remarks and deck is not None:
                structure["nodes"] = relative(deck, target)
        undamped = not _damped(found)
        if undamped:
            structure["damping_ratio"] = _RATIO
        driven = excitation(forces, excite, next(iter(table)))
        raw = _Parts(
            target=target, structure={**structure, "dofs": table}, excitation=driven, observe=observe,
            engine_order=None if of is None else of.engine_order, parts=parts,
        )  # fmt: skip
        omega2 = _omega2(_load(raw.table([1.0, 2.0], bare=True), target.parent))
        frequencies = [math.sqrt(max(float(value), 0.0)) / (2.0 * math.pi) for value in omega2]
        scene = _write(target, raw.table(band(start, stop, frequencies)), found, written)
        undo.pop_all()
    said = [*_notes(given, omega2), *found_by_position(of)]
    if undamped:
        said.append(f"the files hold no damping: the scene has damping_ratio = {_RATIO:g}; put yours there")
    _report(scene, target, frequencies, written, given, said, as_json)


@dataclass(frozen=True, slots=True, kw_only=True)
class _Parts:
    """The tables of the scene, but for the band."""

    target: Path
    structure: dict[str, object]
    excitation: dict[str, Any]
    observe: str | None
    engine_order: int | None = None
    parts: dict[str, list[dict[str, Any]]]

    def table(self, between: list[float], *, bare: bool = False) -> dict[str, Any]:
        """All tables; bare without contacts, which do not move natural frequencies."""
        order = {} if self.engine_order is None else {"engine_order": self.engine_order}
        forced = self.excitation.get("dof") or next(iter(self.excitation["forces"]))
        return {
            "name": re.sub(r"[^A-Za-z0-9_-]", "-", self.target.stem)[:100],
            "structure": self.structure,
            **({} if bare else {key: rows for key, rows in self.parts.items() if rows}),
            "excitation": self.excitation | order,
            "observe": {"dof": self.observe or forced, "band": between},
        }


def _reduced(
    given: MatrixSet | None, table: dict[str, int | str], modes: int | None, up_to: float | None, path: Path,
    of: Disk | None, found: Sources,
) -> Written | WrittenSector:  # fmt: skip
    if given is None:
        raise InputError("`--reduce` is for matrices; modes are reduced already")
    if of is not None and up_to is not None:
        raise InputError("`--up-to` is not for a sector: give --modes N, as many at each nodal diameter")
    if of is not None:
        from solver.matrices.file_units import METRES

        mistune, metres = tuple(found.parts), METRES[found.units]
        return reduce_disk(given, rows_of(table, given), modes, of, path, mistune, metres)
    return reduce(given, rows_of(table, given), modes, up_to, path)


def _gone(given: MatrixSet | None, of: Disk) -> Any:
    """How the high boundary of a sector follows whose files the scene refers to."""
    if given is None:
        raise InputError("`--sectors` is for matrices, not for modes")
    size = int(next(iter(given.matrices.values())).shape[0])
    return checked_boundaries(given, of).elimination(size, of.sectors)


def _damped(found: Sources) -> bool:
    """Whether the files hold damping."""
    from solver.matrices.files import read_modes

    return "C" in found.roles or (
        "modes" in found.roles and read_modes(found.roles["modes"]).damping_ratio is not None
    )


def _checked(given: MatrixSet | None, *, reduced: bool, gone: Any) -> None:
    """Refuse what is no structure."""
    from solver.matrices.diagnostics import refuse

    if given is None:
        return
    try:
        refuse(given, reduced=reduced, gone=gone)
    except ValueError as error:
        raise InputError(f"`FILES`: {error}") from error


def _notes(given: MatrixSet | None, omega2: NDArray[Any]) -> list[str]:
    from solver.matrices.diagnostics import notes
    from solver.matrices.load_set import MatrixSet

    return notes(given if given is not None else MatrixSet(matrices={}), omega2)


def _load(raw: dict[str, object], folder: Path) -> Scene:
    from solver.matrices.scene_files import with_files
    from solver.scene.scene import Scene

    return Scene.from_dict(with_files(raw, folder))


def _omega2(scene: Scene) -> NDArray[Any]:
    """Squares of the natural frequencies without contacts [rad²/s²], ascending."""
    import numpy as np

    from solver.linear.assembly import linear_model
    from solver.matrices.normal_modes import undamped_modes

    model = linear_model(scene)
    K, _, M = (each[0] for each in model.plain(model.diameters(np.ones(1, np.int64))))
    return np.sort(undamped_modes(K, M).omega2)


def _write(
    target: Path, raw: dict[str, Any], found: Sources, written: Written | WrittenSector | None
) -> Scene:
    """Write the scene, whole or not at all, and read it as anyone would."""
    import solver

    remarks = []
    if written is not None:
        made = ", ".join(path.name for path in dict.fromkeys(found.roles.values()))
        remarks.append(
            f"Reduced from {written.full} rows of {made}; good to "
            f"{written.good_to_hz:.5g} Hz (frequencies exact to 0.1 %)."
        )
    with whole(target) as temporary:
        temporary.write_text(toml(raw, remarks), encoding="utf-8")
        return solver.load_scene(temporary)


def _report(
    scene: Scene, target: Path, frequencies: Sequence[float], written: Written | WrittenSector | None,
    given: MatrixSet | None, notes: list[str], as_json: bool,
) -> None:  # fmt: skip
    from solver.matrices.diagnostics import total_mass
    from solver.scene.parts import MatricesStructure

    structure = scene.structure
    mass = None if given is None else total_mass(given)
    reduction = structure.reduction if isinstance(structure, MatricesStructure) else None
    if as_json:
        loaded = None if reduction is None else reduction.model_dump()
        print_json(
            {
                "scene": scene.name, "file": str(target), "dofs": list(structure.dofs),
                "frequencies_hz": list(frequencies[:10]), "notes": notes,
                "mass_kg": None if mass is None else mass[1],
                "reduction": loaded if written is None else written.facts(),
            }
        )  # fmt: skip
        return
    pairs = [
        ("DOFs in use", ", ".join(structure.dofs[:10]) + (", …" if len(structure.dofs) > 10 else "")),
        ("first frequencies", ", ".join(f"{f:.5g} Hz" for f in frequencies[:6])),
    ]
    if mass is not None:
        pairs.append(("mass", f"{mass[1]:.4g} kg in {mass[0]}, without what is held"))
    if reduction is not None:
        kept = f"{reduction.dofs} DOFs to {len(structure.dofs)} and {reduction.modes} modes"
        pairs.append(("reduced", f"{kept} up to {reduction.highest_hz:.5g} Hz"))
    if written is not None:
        pairs += written.pairs()
    pairs += [("note", note) for note in notes]
    todo = "look at the damping" if scene.contacts else "add [[contacts]], look at the damping"
    pairs += [
        ("compare", "frequencies and mass with those of your program; else see --units"),
        ("next", f"{todo} in the file, then `stickslip plan`"),
    ]
    print_pairs(f"Scene {scene.name} in {target}", pairs)
