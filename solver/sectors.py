"""The whole annulus of a cyclic scene as a lumped scene: every sector with its own degrees of freedom."""

from __future__ import annotations

import math
from typing import TypeVar

from solver.errors import SettingError
from solver.scene import (
    Contact,
    CyclicStructure,
    Damper,
    Excitation,
    LumpedStructure,
    Mass,
    Observe,
    Scene,
    Spring,
    parse_end,
)

_JoinT = TypeVar("_JoinT", Spring, Damper, Contact)
_NamedT = TypeVar("_NamedT", Spring, Damper, Mass)


def annulus(scene: Scene) -> Scene:
    """Write a cyclic scene out as a lumped one, sector by sector.

    DOF ``tip`` of sector j is ``tip@j``, contact ``shroud`` becomes ``shroud@j`` in the group ``shroud``
    (or in the group it had), a named spring ``k`` becomes ``k@j``. Sector j has
    harmonic * engine_order * j * 2 pi / sectors added to the phase of its forces and
    engine_order * j * 2 pi / sectors to that of its loads. What joins a sector to itself (one sector only)
    never moves and is left out. Observed is sector 0.

    Raises
    ------
    SettingError
        The scene is not cyclic.
    """
    structure = scene.structure
    if not isinstance(structure, CyclicStructure):
        raise SettingError("scene", scene.name, "must have a cyclic structure to be written out")
    n, sectors = structure.sectors, range(structure.sectors)
    return Scene(
        name=f"{scene.name}-annulus"[:100],
        structure=LumpedStructure(
            kind="lumped",
            stiffness_proportional_damping=structure.stiffness_proportional_damping,
            masses=tuple(_mass(mass, j) for j in sectors for mass in structure.masses),
            springs=tuple(_renamed(s, j) for j in sectors for s in _joining(structure.springs, j, n)),
            dampers=tuple(_renamed(d, j) for j in sectors for d in _joining(structure.dampers, j, n)),
        ),
        contacts=tuple(
            _contact(c, j, scene.engine_order, n) for j in sectors for c in _joining(scene.contacts, j, n)
        ),
        excitation=tuple(_force(e, j, scene.engine_order, n) for j in sectors for e in scene.excitation),
        observe=Observe(dof=_in_sector(scene.observe.dof, 0), band=scene.observe.band),
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


def _renamed(part: _NamedT, j: int) -> _NamedT:
    return part if part.name is None else part.model_copy(update={"name": _in_sector(part.name, j)})


def _mass(mass: Mass, j: int) -> Mass:
    return _renamed(mass, j).model_copy(update={"dof": _in_sector(mass.dof, j)})


def _contact(contact: Contact, j: int, order: int, n: int) -> Contact:
    return contact.model_copy(
        update={
            "name": _in_sector(contact.name, j),
            "group": contact.group or contact.name,
            "N1_phase": contact.N1_phase + _turn(order * j, n),
        }
    )


def _force(force: Excitation, j: int, order: int, n: int) -> Excitation:
    return force.model_copy(
        update={
            "dof": _in_sector(force.dof, j),
            "phase": force.phase + _turn(force.harmonic * order * j, n),
            "engine_order": None,
        }
    )


def _turn(steps: int, n: int) -> float:
    """Angle of `steps` sectors [rad], whole turns left out."""
    return 2.0 * math.pi * (steps % n) / n
