"""The whole annulus of a cyclic scene as a lumped scene: every sector with its own degrees of freedom.

One sector stands for all where the disk is tuned and everything on it is one travelling wave. Otherwise the
annulus is written out: `sectors_needed` says which it is and why, `written_out` does it.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import lru_cache
from typing import Annotated, Any, TypeVar

from solver.contacts.laws.load_harmonics import is_phase
from solver.errors import SettingError
from solver.matrices.values import MOST_DOFS, DofTable, Matrix
from solver.results.told import Piece
from solver.scene.bodies.kinematics import forms_of, written_form
from solver.scene.cyclic.sector_blocks import (
    added_by_mistuning,
    annulus_matrices,
    annulus_of,
    full_elimination,
)
from solver.scene.linear_terms import Coupling, LinearTerm
from solver.scene.parameter_paths import NUMBERS, TABLES, find_parameter
from solver.scene.scene import (
    AnyContact,
    Body,
    ContactOfAnyLaw,
    CyclicStructure,
    Damper,
    Excitation,
    Load,
    LumpedStructure,
    Mass,
    MatricesStructure,
    Node,
    Scene,
    Spring,
    Structure,
    parse_end,
)
from solver.scene.scene_records import Recovered
from solver.wording import listing


@lru_cache(maxsize=8)
def matrices_annulus(sector: MatricesStructure) -> MatricesStructure:
    """The structure of all sectors; DOF ``tip`` of sector j is ``tip@j``.

    Raises
    ------
    SettingError
        It would be too large, a nodal diameter is not known, modes have damping ratios of their own, or there
        is no such part to be mistuned.
    """
    count, n = sector.sector_count, sector.n_coordinates
    if count * n > MOST_DOFS:
        raise SettingError(
            "sectors",
            count,
            f"of {n} coordinates each are {count * n} for the whole annulus, {MOST_DOFS} are the most: keep "
            "fewer modes",
        )
    if isinstance(sector.damping_ratio, tuple):
        raise SettingError(
            "damping_ratio",
            list(sector.damping_ratio),
            "must be one number where all sectors are solved: modes are counted at each nodal diameter",
        )
    K, C, M = annulus_matrices(sector)
    if sector.mistuning is not None:
        more_K, more_M = added_by_mistuning(sector, sector.mistuning.of, sector.mistuning.factors(count))
        K, M = K + more_K, M + more_M
    own = sector.dofs.rows
    if sector.diameters is None:
        eliminated = full_elimination(sector)
        own = tuple(eliminated.row(row) for row in own)
    pairs = list(zip(sector.dofs, own, strict=True))
    G, K_omega2 = (
        None if given is None else Matrix(annulus_of(sector, given.array))
        for given in (sector.G, sector.K_omega2)
    )
    return MatricesStructure(
        kind="matrices",
        symmetric=sector.symmetric,
        M=Matrix(M),
        K=Matrix(K),
        C=Matrix(C) if C.any() else None,
        G=G,
        K_omega2=K_omega2,
        dofs=DofTable({f"{name}@{j}": j * n + row for j in range(count) for name, row in pairs}),
        damping_ratio=sector.damping_ratio,
        loss_factor=sector.loss_factor,
        stiffness_proportional_damping=sector.stiffness_proportional_damping,
        mass_proportional_damping=sector.mass_proportional_damping,
    )


_JoinT = TypeVar("_JoinT", Spring, Damper)
_NamedT = TypeVar("_NamedT", Spring, Damper, Mass)


@dataclass(frozen=True, slots=True, kw_only=True, repr=False)
class Extent(Piece):
    """How many sectors a scene has to be solved with, and why."""

    sectors: Annotated[int, "1 where one sector (or the lumped structure itself) is enough, else all."]
    reason: Annotated[str, "In words and numbers."]
    assumed: Annotated[
        bool,
        "One sector stands for all only if the response is the travelling wave, which the laws of the "
        "contacts do not make the only one.",
    ] = False


def sectors_needed(scene: Scene) -> Extent:
    """Return how many sectors a scene has to be solved with.

    A standing wave of an engine order i is a travelling one as well where 2 i is a multiple of the number of
    sectors: then every sector is in phase or in antiphase with its neighbour.
    """
    structure, order = scene.structure, scene.engine_order
    if not structure.has_sectors:
        given = "lumped" if isinstance(structure, LumpedStructure) else "given by its matrices"
        return Extent(sectors=1, reason=f"the structure is {given}, it has no sectors")
    n = structure.sector_count
    factors = _factors(structure)
    least, most = min(factors), max(factors)
    if least != 1.0 or most != 1.0:
        reason = f"the disk is mistuned by factors from {least:.4g} to {most:.4g}: all {n} sectors are solved"
        return Extent(sectors=n, reason=reason)
    if _standing(scene) and (2 * order) % n:
        reason = (
            f"the excitation is a standing wave of engine order {order}, which friction does not let stand "
            f"for every sector alike: all {n} sectors are solved"
        )
        return Extent(sectors=n, reason=reason)
    if "@" in scene.observe.dof:
        reason = f"one sector is observed by its number ({scene.observe.dof}): all {n} sectors are solved"
        return Extent(sectors=n, reason=reason)
    reason = (
        f"the disk is tuned and the excitation a travelling wave of engine order {order}: "
        f"one sector stands for all {n}"
    )
    loose = [c.name for c in scene.contacts if not c.keeps_together]
    if not loose or n == 1:
        return Extent(sectors=1, reason=reason)
    reason += (
        f", assumed, not proven: with the law of {listing(loose)} the sectors may also move otherwise than "
        "in that wave, and the wave be unstable; the effect every-sector solves all of them"
    )
    return Extent(sectors=1, reason=reason, assumed=True)


def written_out(scene: Scene, *, every_sector: bool = False) -> Scene:
    """Return the annulus of a scene that one sector does not stand for, under its own name; else itself.

    With `every_sector` a disk is written out whether it needs to be or not.
    """
    if not scene.structure.has_sectors:
        return scene
    if sectors_needed(scene).sectors == 1 and not every_sector:
        return scene
    return annulus(scene).model_copy(update={"name": scene.name})


def check_in_annulus(scene: Scene, path: str) -> None:
    """Raise SettingError if `path` of a cyclic scene is not one value in its annulus.

    A contact's load has a phase (in a standing wave, an amplitude) of its own in every sector: set it in
    the scene, there it stands for all sectors.
    """
    owner, _, key = path.rpartition(".")
    found = find_parameter(scene, path)
    amplitude = found is not None and any(quantity.varies_load for quantity in found.quantities)
    if amplitude if _standing(scene) else owner != "structure" and is_phase(key):
        reason = sectors_needed(scene).reason
        raise SettingError(
            "path",
            path,
            f"differs from sector to sector and cannot be continued in: {reason}; set it instead",
        )


def annulus(scene: Scene) -> Scene:
    """Write a disk out sector by sector: of lumped sectors a lumped scene, of matrices one of matrices.

    DOF ``tip`` of sector j is ``tip@j``, contact ``shroud`` becomes ``shroud@j`` in the group ``shroud``
    (or in the group it had), a named spring ``k`` becomes ``k@j`` in the group ``k``, times
    the sector's factor of the mistuning. In a travelling wave sector j has
    harmonic * engine_order * j * 2 pi / sectors added to the phase of its forces, and to that of a load's
    harmonic of this order; in a standing wave the amplitudes are multiplied by the cosines of these angles
    instead. What joins a sector to itself (one sector only)
    never moves and is left out. Observed is sector 0, or the one that the scene names.

    Raises
    ------
    SettingError
        The scene is not cyclic, or a sector was not reduced for every nodal diameter.
    """
    structure = scene.structure
    if not structure.has_sectors:
        raise SettingError("scene", scene.name, "must have a cyclic structure to be written out")
    n, sectors = structure.sector_count, range(structure.sector_count)
    order, standing = scene.engine_order, _standing(scene)
    observed = scene.observe.dof
    terms = (*scene.couplings, *_gas(scene, n))
    placed: dict[str, Any] = {
        "name": f"{scene.name}-annulus"[:100],
        "structure": _whole_structure(structure),
        "contacts": tuple(
            _contact(c, j, _turn(order * j, n), standing=standing)
            for j in sectors
            for c in _placed(scene, j, n)
        ),
        "excitation": tuple(
            _force(e, j, _turn(e.harmonic * order * j, n), standing=standing)
            for j in sectors
            for e in scene.excitation
        ),
        "observe": scene.observe.model_copy(
            update={"dof": observed if "@" in observed else _in_sector(observed, 0)}
        ),
        "bodies": tuple(_body(b, j) for j in sectors for b in scene.bodies),
        "nodes": tuple(_node(node, j) for j in sectors for node in scene.nodes),
        "loads": tuple(_load(load, j) for j in sectors for load in scene.loads),
        "recovery": tuple(_recovered(r, j) for j in sectors for r in scene.recovery),
        "couplings": tuple(_placed_term(term, j, n) for j in sectors for term in terms),
        "aerodynamics": (),  # among the couplings
        "dampers": (),  # bodies and contacts as well
    }
    # What has no sectors is as it is.
    return Scene(**{key: getattr(scene, key) for key in Scene.model_fields} | placed)


def _whole_structure(structure: Structure) -> LumpedStructure | MatricesStructure:
    """The structure of all sectors."""
    if isinstance(structure, MatricesStructure):
        return matrices_annulus(structure)
    if isinstance(structure, LumpedStructure):
        return structure
    n, sectors = structure.sectors, range(structure.sectors)
    scaled = [_mistuned(structure, factor) for factor in _factors(structure)]
    return LumpedStructure(
        kind="lumped",
        stiffness_proportional_damping=structure.stiffness_proportional_damping,
        loss_factor=structure.loss_factor,
        masses=tuple(_mass(mass, j) for j in sectors for mass in scaled[j].masses),
        springs=tuple(_renamed(s, j) for j in sectors for s in _joining(scaled[j].springs, j, n)),
        dampers=tuple(_renamed(d, j) for j in sectors for d in _joining(scaled[j].dampers, j, n)),
    )


def _standing(scene: Scene) -> bool:
    return any(force.pattern == "standing" for force in scene.excitation)


def _factors(structure: Structure) -> tuple[float, ...]:
    mistuning = None if isinstance(structure, LumpedStructure) else structure.mistuning
    n = structure.sector_count
    return (1.0,) * n if mistuning is None else mistuning.factors(n)


def _mistuned(structure: CyclicStructure, factor: float) -> CyclicStructure:
    """The structure with `factor` on every part that the mistuning names."""
    if structure.mistuning is None:
        return structure
    of, tables = structure.mistuning.of, {table: getattr(structure, table) for table in TABLES}
    dofs = set(of) - {part.name for parts in tables.values() for part in parts}

    def scaled(part: _NamedT) -> _NamedT:
        if part.name not in of and getattr(part, "dof", None) not in dofs:
            return part
        key = NUMBERS[type(part)]
        named = {} if part.name is None or factor == 1.0 else {"factor": factor}
        return part.model_copy(update={key: factor * getattr(part, key), **named})

    return structure.model_copy(
        update={table: tuple(scaled(part) for part in parts) for table, parts in tables.items()}
    )


def _in_sector(name: str, j: int) -> str:
    return f"{name}@{j}"


def _end(text: str, j: int, n: int) -> str:
    end = parse_end(text)
    return text if end.dof is None else _in_sector(end.dof, (j + 1) % n if end.next else j)


def _joining(parts: tuple[_JoinT, ...], j: int, n: int) -> tuple[_JoinT, ...]:
    """The parts of sector j between their ends in the annulus."""
    placed = [(part, (_end(part.between[0], j, n), _end(part.between[1], j, n))) for part in parts]
    return tuple(part.model_copy(update={"between": ends}) for part, ends in placed if ends[0] != ends[1])


def _placed(scene: Scene, j: int, n: int) -> tuple[ContactOfAnyLaw, ...]:
    """The contacts of sector j between their ends in the annulus."""
    placed = []
    for contact in scene.contacts:
        in_space = contact.normal is not None or contact.motions is not None
        update, moving = _moving(scene, contact, j, n) if in_space else _between(contact, j, n)
        if any(moving) and not all(moving):
            wanted = f"must have two sectors or more: `{contact.name}` joins one to itself in one direction"
            raise SettingError("sectors", n, wanted)
        if any(moving):
            placed.append(contact.model_copy(update=update))
    return tuple(placed)


def _between(contact: AnyContact, j: int, n: int) -> tuple[dict[str, object], list[bool]]:
    """The ends of a contact in sector j, and whether each pair can move apart."""
    pairs = {
        key: (_end(pair[0], j, n), _end(pair[1], j, n))
        for key, pair in zip(contact.end_keys, contact.pairs, strict=True)
    }
    return dict(pairs), [ends[0] != ends[1] for ends in pairs.values()]


def _moving(scene: Scene, contact: AnyContact, j: int, n: int) -> tuple[dict[str, object], list[bool]]:
    """The same of one in space, whose motions are written out: each sector has its own axes."""
    motions = []
    for form in forms_of(scene, contact):
        sums: dict[str, float] = {}
        for text, factor in written_form(form):
            dof = _end(text, j, n)
            sums[dof] = sums.get(dof, 0.0) + factor
        motions.append(tuple((dof, factor) for dof, factor in sums.items() if factor != 0.0))
    ends = tuple(_end(text, j, n) for text in contact.between)
    gone = dict.fromkeys(("at", "normal", "tangents", "spread"))
    update = {"between": ends, "motions": tuple(motions)} | gone
    return update, [bool(motion) for motion in motions]


def _body(body: Body, j: int) -> Body:
    return body.model_copy(update={"name": _in_sector(body.name, j), "group": body.group or body.name})


def _node(node: Node, j: int) -> Node:
    dofs = tuple((component, _in_sector(dof, j)) for component, dof in node.dofs)
    return node.model_copy(update={"name": _in_sector(node.name, j), "dofs": dofs})


def _load(load: Load, j: int) -> Load:
    places = {key: _in_sector(place, j) for key in ("dof", "on") if (place := getattr(load, key))}
    named = {} if load.name is None else {"name": _in_sector(load.name, j)}
    return load.model_copy(update={**places, **named})


def _recovered(recovered: Recovered, j: int) -> Recovered:
    terms = tuple((_in_sector(dof, j), factor) for dof, factor in recovered.terms)
    return recovered.model_copy(update={"name": _in_sector(recovered.name, j), "terms": terms})


def _placed_term(term: LinearTerm, j: int, n: int) -> LinearTerm:
    return term.in_sector(lambda dof, ahead: _in_sector(dof, (j + ahead) % n))


def _gas(scene: Scene, n: int) -> tuple[Coupling, ...]:
    """The aerodynamic influence between blades as couplings.

    SettingError where damping of nodal diameters n and -n differs: no real dashpots between blades do that.
    """
    found = []
    for gas in scene.aerodynamics:
        for entry in gas.entries(n):
            if entry.c.imag != 0.0:
                wanted = (
                    "must be the same for a nodal diameter and for its negative where all sectors are "
                    "solved: give what differs as `imaginary`"
                )
                raise SettingError("damping", gas.dof, wanted)
            found.append(
                Coupling(
                    on=gas.dof, of=gas.dof, offset=entry.offset, k=entry.k.real, k_imaginary=entry.k.imag,
                    c=entry.c.real,
                )
            )  # fmt: skip
    return tuple(found)


def _renamed(part: _NamedT, j: int) -> _NamedT:
    if part.name is None:
        return part
    return part.model_copy(update={"name": _in_sector(part.name, j), "group": part.name})


def _mass(mass: Mass, j: int) -> Mass:
    return _renamed(mass, j).model_copy(update={"dof": _in_sector(mass.dof, j)})


def _contact(contact: ContactOfAnyLaw, j: int, turn: float, *, standing: bool) -> ContactOfAnyLaw:
    named = {"name": _in_sector(contact.name, j), "group": contact.group or contact.name}
    return contact.model_copy(update=named | contact.in_sector(turn, _cosine(turn) if standing else None))


def _force(force: Excitation, j: int, turn: float, *, standing: bool) -> Excitation:
    return force.model_copy(
        update={
            "dof": None if force.dof is None else _in_sector(force.dof, j),
            "forces": force.forces and tuple((_in_sector(dof, j), *rest) for dof, *rest in force.forces),
            "phase": force.phase + (0.0 if standing else turn),
            "amplitude": force.amplitude * (_cosine(turn) if standing else 1.0),
            "engine_order": None,
            "pattern": None,
        }
    )


def _turn(steps: int, n: int) -> float:
    """Angle of `steps` sectors [rad], whole turns left out."""
    return 2.0 * math.pi * (steps % n) / n


def _cosine(angle: float) -> float:
    """The cosine, with the nodes of a standing wave at exactly 0."""
    value = math.cos(angle)
    return value if abs(value) > 1e-15 else 0.0
