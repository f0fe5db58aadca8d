"""`stickslip import`: matrices or modes from a finite-element program become a scene file."""

from __future__ import annotations

import math
import re
from collections.abc import Sequence
from contextlib import ExitStack
from dataclasses import dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

from service.cli.importing.import_files import (
    Sources,
    band,
    dof_table,
    excitation,
    existing_file,
    read_sources,
    rows_of,
    sources,
    toml,
)
from service.cli.importing.import_files import contacts as contact_tables
from service.cli.importing.import_reduction import (
    DiskOptions,
    ImportOptions,
    ReducedModel,
    WrittenSector,
    checked_boundaries,
    disk,
    found_by_position,
    reduce,
    reduce_disk,
    reduced_file,
)
from service.cli.importing.patches import Patches
from service.cli.options.inputs import new_file, relative
from service.cli.options.parameters import taking
from service.errors import InputError
from service.rendering.text import print_json, print_pairs
from solver.results import units
from solver.results.files import whole

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from solver.matrices.load_set import MatrixSet
    from solver.scene.scene import Scene

MODES = 40  # of the rest that are kept beside the DOFs of faces before motions are chosen for the contacts
SMALL = 100  # rows up to which a model with faces is kept as it is
_RATIO = 0.001  # of a structure whose files hold no damping, which would have no bound at resonance


@taking(ImportOptions)
def import_scene(asked: ImportOptions) -> None:
    """Make a scene of matrices or modes in files.

    The files are read and checked first. The scene refers to them or, with --reduce, to the reduced model,
    which is written beside it; with --patch it is one in few motions for the contacts unless another way is
    asked for. Without --contact or --patch a template of a contact stands in the scene. With --sectors the
    matrices are of one sector of a disk, reduced at every nodal diameter that is met.
    """
    target = new_file("--out", asked.out, (".toml",))
    _check_reduction(asked)
    read = _read(asked)
    large = read.given is not None and read.given.size > SMALL
    in_motions = asked.for_contacts and (large or asked.modes is not None)
    keeps_faces = in_motions and "C" in read.found.roles
    if keeps_faces:
        asked = replace(asked, reduce_once=True, modes=MODES if asked.modes is None else asked.modes)
    with ExitStack() as undo:
        structure, table, written = read.found.table(target), read.table, None
        if asked.reduce_once or in_motions:
            path = reduced_file(asked, target)
            undo.callback(path.unlink, missing_ok=True)
            written = _reduced(read, asked, path)
            structure, table = written.table(target), dict(written.rows)
        else:
            structure |= _referring(read, asked.keep_modes, target)
        raw = _SceneTables(
            read=read, target=target, structure=structure, dofs=table, observe=asked.observe,
            excitation=excitation(asked.forces, asked.excite, next(iter(table))),
        )  # fmt: skip
        scene, frequencies, said, written = _made(raw, written, asked)
        undo.pop_all()
    if keeps_faces:
        said.append("the files hold damping, which couples modes: every DOF of the faces is kept (--reduce)")
    _report(scene, target, frequencies, written, read.given, said, asked.as_json)


def _check_reduction(asked: ImportOptions) -> None:
    """Refuse options that go with --reduce without it, or not with it."""
    of_reduced = (asked.up_to,) if asked.for_contacts else (asked.modes, asked.up_to, asked.reduced)
    if not asked.reduce_once and any(each is not None for each in of_reduced):
        raise InputError("`--modes` and `--reduced` go with --reduce or --patch, `--up-to` with --reduce")
    if asked.reduce_once and asked.keep_modes is not None:
        raise InputError("`--keep-modes` reduces on every load, --reduce once: keep one of them")
    if asked.mistune and not (asked.reduce_once and asked.sectors is not None):
        raise InputError(
            "`--mistune` goes with --sectors and --reduce; a scene that refers to its files names parts in "
            "[structure.parts]"
        )


@dataclass(frozen=True, slots=True, kw_only=True)
class _Read:
    """What the files hold and what is asked of them, checked.

    Attributes
    ----------
    found, given : the files, and their matrices unless they are modes.
    deck, of : positions of the nodes, and the disk they are a sector of.
    table : DOF to its row.
    parts : the tables of contacts, bodies and nodes.
    """

    found: Sources
    given: MatrixSet | None
    deck: Path | None
    of: DiskOptions | None
    table: dict[str, int | str]
    parts: dict[str, list[dict[str, Any]]]


def _read(asked: ImportOptions) -> _Read:
    deck = existing_file("--nodes", asked.nodes)
    of = disk(asked, deck)
    found = sources(asked)
    given = read_sources(found, deck)
    positions, turn = None if given is None else given.deck, None if of is None else (of.sectors, of.axis)
    faces = Patches(asked.patches, positions, found.units, turn, asked.tolerance)
    table = dof_table(asked.dofs, found, given, patches=bool(asked.patches))
    dofs, tables = faces.made(given, table)
    return _Read(
        found=found, given=given, deck=deck, of=of, table=table | dofs,
        parts=tables | {"contacts": contact_tables(asked.contacts)},
    )  # fmt: skip


def _referring(read: _Read, keep_modes: int | None, target: Path) -> dict[str, object]:
    """Return what [structure] says beside the names of its files, which are a structure."""
    from solver.matrices.diagnostics import refuse

    kept: dict[str, object] = {} if keep_modes is None else {"keep_modes": keep_modes}
    of, given = read.of, read.given
    if given is None and of is not None:
        raise InputError("`--sectors` is for matrices, not for modes")
    if given is not None:
        gone = None if of is None else checked_boundaries(given, of).elimination(given.size, of.sectors)
        try:
            refuse(given, reduced=keep_modes is not None, gone=gone)
        except ValueError as error:
            raise InputError(f"`FILES`: {error}") from error
    if of is not None:
        return {"sectors": of.sectors, "cyclic": of.joined(target) | kept}
    if given is not None and given.remarks and read.deck is not None:
        kept["nodes"] = relative(read.deck, target)
    return kept


def _made(
    raw: _SceneTables, written: ReducedModel | WrittenSector | None, asked: ImportOptions
) -> tuple[Scene, list[float], list[str], ReducedModel | WrittenSector | None]:
    """Write the scene; return it, its natural frequencies [Hz], what is to be said, and the reduction."""
    import solver
    from solver.matrices.diagnostics import notes
    from solver.matrices.load_set import MatrixSet, read_modes

    found, modes = raw.read.found, raw.read.found.roles.get("modes")
    undamped = "C" not in found.roles and (modes is None or read_modes(modes).damping_ratio is None)
    if undamped:
        raw.structure["damping_ratio"] = _RATIO
    omega2 = _omega2(raw.table([1.0, 2.0], bare=True), raw.target.parent)
    frequencies = [math.sqrt(max(float(value), 0.0)) / (2.0 * math.pi) for value in omega2]
    between = band(asked.start, asked.stop, frequencies)
    if isinstance(written, ReducedModel) and not asked.reduce_once:
        written = written.for_contacts(raw.table(between), asked.modes)
        raw = replace(raw, structure=written.table(raw.target) | {"damping_ratio": _RATIO})
    given, remarks = raw.read.given or MatrixSet(matrices={}), []
    if written is not None:
        made = ", ".join(path.name for path in dict.fromkeys(found.roles.values()))
        good = f"good to {units.hertz(written.good_to_hz)} (frequencies exact to 0.1 %)"
        remarks.append(f"Reduced from {given.size} rows of {made}; {good}.")
    with whole(raw.target) as temporary:
        temporary.write_text(toml(raw.table(between), remarks), encoding="utf-8")
        scene = solver.load_scene(temporary)
    said = [*notes(given, omega2), *found_by_position(raw.read.of)]
    if undamped:
        said.append(f"the files hold no damping: the scene has damping_ratio = {_RATIO:g}; put yours there")
    return scene, frequencies, said, written


@dataclass(frozen=True, slots=True, kw_only=True)
class _SceneTables:
    """The tables of the scene, but for the band."""

    read: _Read
    target: Path
    structure: dict[str, object]
    dofs: dict[str, int | str]
    excitation: dict[str, Any]
    observe: str | None

    def table(self, between: list[float], *, bare: bool = False) -> dict[str, Any]:
        """All tables; bare without contacts, which do not move natural frequencies."""
        of = self.read.of
        order = {} if of is None else {"engine_order": of.engine_order}
        forced = self.excitation.get("dof") or next(iter(self.excitation["forces"]))
        return {
            "name": re.sub(r"[^A-Za-z0-9_-]", "-", self.target.stem)[:100],
            "structure": {**self.structure, "dofs": self.dofs},
            **({} if bare else {key: rows for key, rows in self.read.parts.items() if rows}),
            "excitation": self.excitation | order,
            "observe": {"dof": self.observe or forced, "band": between},
        }


def _reduced(read: _Read, asked: ImportOptions, path: Path) -> ReducedModel | WrittenSector:
    given, of = read.given, read.of
    if given is None:
        raise InputError("`--reduce` is for matrices; modes are reduced already")
    rows = rows_of(read.table, given)
    if of is None:
        return reduce(given, rows, asked.modes if asked.reduce_once else MODES, asked.up_to, path)
    if asked.up_to is not None:
        raise InputError("`--up-to` is not for a sector: give --modes N, as many at each nodal diameter")
    from solver.matrices.values import METRES

    return reduce_disk(given, rows, asked.modes, of, path, tuple(read.found.parts), METRES[read.found.units])


def _omega2(raw: dict[str, object], folder: Path) -> NDArray[Any]:
    """Squares of the natural frequencies without contacts [rad²/s²], ascending."""
    import numpy as np

    from solver.linear.assembly import linear_model
    from solver.matrices.normal_modes import undamped_modes
    from solver.matrices.scene_files import with_files
    from solver.scene.scene import Scene

    model = linear_model(Scene.from_dict(with_files(raw, folder)))
    K, _, M = (each[0] for each in model.plain(model.diameters(np.ones(1, np.int64))))
    return np.sort(undamped_modes(K, M).omega2)


def _report(
    scene: Scene, target: Path, frequencies: Sequence[float], written: ReducedModel | WrittenSector | None,
    given: MatrixSet | None, notes: list[str], as_json: bool,
) -> None:  # fmt: skip
    from solver.matrices.diagnostics import total_mass
    from solver.scene.scene_records import MatricesStructure

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
        ("first frequencies", ", ".join(units.hertz(f) for f in frequencies[:6])),
    ]
    if mass is not None:
        pairs.append(("mass", f"{units.quantity(mass[1], 'kg')} in {mass[0]}, without what is held"))
    if reduction is not None:
        kept = f"{reduction.dofs} DOFs to {len(structure.dofs)} and {reduction.modes} modes"
        pairs.append(("reduced", f"{kept} up to {units.hertz(reduction.highest_hz)}"))
    if written is not None:
        pairs += written.pairs()
    pairs += [("note", note) for note in notes]
    todo = "look at the damping" if scene.contacts else "add [[contacts]], look at the damping"
    pairs += [
        ("compare", "frequencies and mass with those of your program; else see --units"),
        ("next", f"{todo} in the file, then `stickslip plan`"),
    ]
    print_pairs(f"Scene {scene.name} in {target}", pairs)
