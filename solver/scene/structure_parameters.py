"""Parameters of a structure: masses, springs and dashpots and groups of them, its damping, linear terms."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Any, cast

from solver.contacts.fields import LARGEST
from solver.errors import SettingError
from solver.scene.scene_parameter import SceneParameter, Slope, changed
from solver.scene.scene_records import Damper, Mass, MatricesStructure, Spring, Structure

if TYPE_CHECKING:
    from solver.scene.scene import Scene

STRUCTURE = "structure."
_LOSS = "loss_factor"
_PROPORTIONAL = {"stiffness_proportional_damping": "s", "mass_proportional_damping": "1/s"}
TABLES = ("masses", "springs", "dampers")
NUMBERS = {Mass: "m", Spring: "k", Damper: "c"}
_UNITS = {"m": "kg", "k": "N/m", "c": "N s/m"}
_TERMS = ("couplings", "aerodynamics")
_Named = Mass | Spring | Damper


def structure_paths(scene: Scene) -> tuple[str, ...]:
    """Return the paths of groups, then of masses, springs and dashpots, as in the tables.

    Of a structure given by its matrices, the proportional damping is what can be changed.
    """
    structure = scene.structure
    own = (_LOSS,) if structure.loss_factor else ()
    if isinstance(structure, MatricesStructure):
        names: tuple[str, ...] = (*_PROPORTIONAL, *own)
    else:
        parts = named_parts(structure)
        groups = (part.group for part in parts if part.group is not None)
        names = (*groups, *(part.name for part in parts if part.name is not None), *own)
    return tuple(STRUCTURE + name for name in dict.fromkeys(names))


def structure_parameter(scene: Scene, path: str) -> SceneParameter | None:
    """Return what a path of the structure is, if it is one."""
    if not path.startswith(STRUCTURE):
        return None
    structure, name = scene.structure, path.removeprefix(STRUCTURE)
    parts = enumerate(named_parts(structure))
    members = [(i, part, share) for i, part in parts if (share := _share(part, name))]
    if members:
        return _of_parts(structure, path, members)
    lossy = name == _LOSS and structure.loss_factor > 0.0
    if not lossy and not (isinstance(structure, MatricesStructure) and name in _PROPORTIONAL):
        return None
    unit = "1" if lossy else _PROPORTIONAL[name]

    def with_value(new: float) -> dict[str, Any]:
        if lossy and not 0.0 < new <= 10.0:
            raise SettingError(path, new, "must be a number > 0 and <= 10")
        if not 0.0 <= new <= LARGEST:
            raise SettingError(path, new, f"must be a number >= 0 and <= 1e15 [{unit}]")
        return {"structure": structure.model_copy(update={name: new})}

    slope = Slope(loss=True) if lossy else Slope(damping="K" if name.startswith("stiffness") else "M")
    return SceneParameter(
        get=lambda: cast(float, getattr(structure, name)), with_value=with_value, unit=unit,
        slope=lambda: slope,
    )  # fmt: skip


def _of_parts(structure: Structure, path: str, members: list[tuple[int, _Named, float]]) -> SceneParameter:
    """Return the value of a part, or of a group of one kind, in which each has its share."""
    _, first, whole = members[0]
    key = NUMBERS[type(first)]
    unit = _UNITS[key]
    wanted = f"must be a number {'>' if key == 'm' else '>='} 0 and <= 1e15 [{unit}]"

    def with_value(new: float) -> dict[str, Any]:
        found = {id(part): changed(part, {key: new * share}, path, new, wanted) for _, part, share in members}
        tables = {table: getattr(structure, table) for table in TABLES}
        update = {table: tuple(found.get(id(old), old) for old in parts) for table, parts in tables.items()}
        return {"structure": structure.model_copy(update=update)}

    return SceneParameter(
        get=lambda: cast(float, getattr(first, key)) / whole, with_value=with_value, unit=unit,
        slope=lambda: Slope(parts=tuple((i, share) for i, _, share in members)),
    )  # fmt: skip


def named_parts(structure: Structure) -> tuple[_Named, ...]:
    """Return masses, springs and dashpots, in this order; none of a structure given by its matrices."""
    if isinstance(structure, MatricesStructure):
        return ()
    return (*structure.masses, *structure.springs, *structure.dampers)


def _share(part: _Named, name: str) -> float:
    """Value of a part as a multiple of that of the parameter `name`, its own or its group's; 0 if neither."""
    if part.name == name:
        return 1.0
    if part.group != name:
        return 0.0
    return 1.0 if part.factor is None else part.factor


def term_paths(scene: Scene) -> tuple[str, ...]:
    """Return the paths of couplings and aerodynamic influence that have a name."""
    named = (each for table in _TERMS for each in getattr(scene, table) if each.name is not None)
    return tuple(dict.fromkeys(f"{each.name}.{key}" for each in named for key in each.PARAMETERS))


def term_parameter(scene: Scene, path: str) -> SceneParameter | None:
    """Return what a path of a coupling or of aerodynamic influence is, if it is one."""
    owner, _, key = path.rpartition(".")
    tables = {table: getattr(scene, table) for table in _TERMS}
    members = [
        x for rows in tables.values() for x in rows if owner and x.name == owner and key in x.PARAMETERS
    ]
    if not members:
        return None

    positive = any(each.POSITIVE for each in members)

    def with_value(new: float) -> dict[str, Any]:
        wanted = "must be a number > 0 and <= 1e15" if positive else "must be a number from -1e15 to 1e15"
        found = {id(each): changed(each, {key: new}, path, new, wanted) for each in members}
        return {table: tuple(found.get(id(old), old) for old in rows) for table, rows in tables.items()}

    def slope() -> Slope:
        sectors = scene.structure.sector_count
        entries = tuple(entry for each in members for entry in each.slope(key, sectors))
        if scene.speed_order is not None and any(entry.turns for entry in entries):
            wanted = "is set, not swept nor differentiated, along an engine-order line: give a `speed`"
            raise SettingError("path", path, wanted)
        return Slope(entries=entries)

    return SceneParameter(
        get=lambda: cast(float, getattr(members[0], key)), with_value=with_value,
        unit=members[0].PARAMETERS[key], least=0.0 if positive else -math.inf, slope=slope,
    )  # fmt: skip
