"""Parameter paths of a scene, with units: ``shroud.N0``, ``excitation.amplitude``, ``structure.k1``, …"""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import Any, Protocol, Self, TypeVar, cast

from pydantic import ValidationError

from solver.contacts.fields import LARGEST, Part
from solver.contacts.laws.base import AnyContact
from solver.contacts.laws.parts import LawQuantity
from solver.errors import SettingError
from solver.results.units import number
from solver.scene.bodies.kinematics import HasBodies
from solver.scene.bodies.paths import SPEED, body_paths, body_value, changed_bodies, is_body_path
from solver.scene.bodies.shape_parts import own_parts, shape_of, shape_paths, shape_value, with_shape_value
from solver.scene.bodies.shapes import AnyShape
from solver.scene.linear_terms import SpeedDependence, at_speed
from solver.scene.parts import (
    Damper,
    Excitation,
    Mass,
    MatricesStructure,
    Spring,
    Structure,
)
from solver.wording import listing, nearest

FREQUENCY = "frequency"
AMPLITUDE = "excitation.amplitude"
PHASE = "excitation.phase"
PROPORTIONAL = ("stiffness_proportional_damping", "mass_proportional_damping")
LOSS = "loss_factor"
FACTOR = "factor"  # of aerodynamic influence
_RANGES = {
    "m": "must be a number > 0 and <= 1e15 [kg]",
    "k": "must be a number >= 0 and <= 1e15 [N/m]",
    "c": "must be a number >= 0 and <= 1e15 [N s/m]",
    "amplitude": "must be a number from -1e15 to 1e15 [N]",
    "phase": "must be a number from -1e4 to 1e4 [rad]",
}
_PartT = TypeVar("_PartT", bound=Part)
_Named = Mass | Spring | Damper


class HasParts(HasBodies, Protocol):
    """What a scene holds, as far as parameter paths go; see `solver.scene.scene.Scene`."""

    @property
    def contacts(self) -> tuple[AnyContact, ...]:
        """Every contact."""

    @property
    def excitation(self) -> tuple[Excitation, ...]:
        """Every force."""

    @property
    def with_speed(self) -> tuple[SpeedDependence, ...]:
        """What follows the speed."""

    @property
    def dampers(self) -> tuple[AnyShape, ...]:
        """Every damper given by its shape."""

    def model_copy(self, *, update: Mapping[str, Any] | None = None) -> Self:
        """Return a copy with other parts."""


_SceneT = TypeVar("_SceneT", bound=HasParts)


def parameter_paths(scene: HasParts) -> tuple[str, ...]:
    """Every path that has a value in the scene."""
    own = own_parts(scene)["contacts"] if scene.dampers else scene.contacts
    contacts = dict.fromkeys(
        f"{contact.group}.{key}" for contact in own if contact.group for key in contact.parameters
    )
    contacts |= dict.fromkeys(f"{c.name}.{key}" for c in own for key in c.parameters)
    structural = (f"structure.{name}" for name in structure_names(scene.structure))
    gas = (f"{each.name}.{FACTOR}" for each in scene.aerodynamics if each.name is not None)
    others = dict.fromkeys((*shape_paths(scene), *body_paths(scene), *gas))
    return (AMPLITUDE, PHASE, *contacts, *structural, *others)


def structure_names(structure: Structure) -> tuple[str, ...]:
    """Names that are parameters: of groups, then of masses, springs and dashpots, as in the tables.

    Of a structure given by its matrices, the proportional damping is what can be changed.
    """
    own = (LOSS,) if structure.loss_factor else ()
    if isinstance(structure, MatricesStructure):
        return (*PROPORTIONAL, *own)
    parts: tuple[_Named, ...] = (*structure.masses, *structure.springs, *structure.dampers)
    groups = dict.fromkeys(part.group for part in parts if part.group is not None)
    return tuple(dict.fromkeys((*groups, *(part.name for part in parts if part.name is not None), *own)))


def share(part: _Named, name: str) -> float:
    """Value of a part as a multiple of that of the parameter `name`, its own or its group's; 0 if neither."""
    if part.name == name:
        return 1.0
    if part.group != name:
        return 0.0
    return 1.0 if part.factor is None else part.factor


_UNITS = {"m": "kg", "k": "N/m", "c": "N s/m"}
_PROPORTIONAL_UNITS = dict(zip(PROPORTIONAL, ("s", "1/s"), strict=True))


def has_parameter(contact: AnyContact, owner: str, key: str) -> bool:
    """Whether the path ``owner.key`` acts on a contact: its name or group, and a parameter of its law."""
    return owner in (contact.name, contact.group) and key in contact.parameters


def changed_quantities(scene: HasParts, path: str) -> tuple[LawQuantity, ...]:
    """What a path changes in each contact it acts on; nothing of a path that is no contact's."""
    owner, _, key = path.rpartition(".")
    return tuple(c.parameters[key] for c in scene.contacts if has_parameter(c, owner, key))


def follows_speed(scene: HasParts, path: str) -> str | None:
    """The parameter that follows the speed and that a path would set, itself or its group's; else None."""
    owner, _, key = path.rpartition(".")
    mine = {contact.name for contact in scene.contacts if owner in (contact.name, contact.group)}
    for each in scene.with_speed:
        other, _, wanted = each.path.rpartition(".")
        theirs = {contact.name for contact in scene.contacts if other in (contact.name, contact.group)}
        if path == each.path or (key == wanted and mine & theirs):
            return each.path
    return None


def is_gas_path(scene: HasBodies, path: str) -> bool:
    """Whether a path is the factor of aerodynamic influence."""
    owner, _, key = path.rpartition(".")
    return key == FACTOR and any(owner and each.name == owner for each in scene.aerodynamics)


def is_loss(structure: Structure, name: str) -> bool:
    """Whether a name is the loss factor of a structure that has one, and not of one of its parts."""
    return name == LOSS and structure.loss_factor > 0.0 and not _structure_parts(structure, name)


def structure_unit(structure: Structure, name: str) -> str:
    """The unit of the parameter ``structure.name``; empty of a group whose parts have different ones."""
    if is_loss(structure, name):
        return "1"
    if isinstance(structure, MatricesStructure):
        return _PROPORTIONAL_UNITS[name]
    found = {_UNITS[_quantity(part)] for part in _structure_parts(structure, name)}
    return found.pop() if len(found) == 1 else ""


def check_path(scene: HasParts, path: str) -> None:
    """Raise SettingError unless `path` is ``frequency`` or a path of the scene.

    Along an engine-order line the ``speed`` is one too.
    """
    if path == SPEED and scene.speed_order is not None:
        return
    if path != FREQUENCY and path not in parameter_paths(scene):
        raise _unknown(scene, path, FREQUENCY)


def value(scene: HasParts, path: str) -> float:
    """Value of a path; of a group, its first member's."""
    if path == AMPLITUDE:
        return scene.excitation[0].amplitude
    if path == PHASE:
        return next((force.phase for force in scene.excitation if force.harmonic), 0.0)
    shape = shape_of(scene, path) if isinstance(path, str) else None
    if shape is not None:
        return shape_value(*shape)
    if isinstance(path, str) and is_body_path(scene, path):
        return body_value(scene, path)
    owner, _, key = path.rpartition(".") if isinstance(path, str) else ("", "", "")
    if isinstance(path, str) and is_gas_path(scene, path):
        return next(each.factor for each in scene.aerodynamics if each.name == owner)
    if owner == "structure" and is_loss(scene.structure, key):
        return scene.structure.loss_factor
    if owner == "structure" and isinstance(scene.structure, MatricesStructure) and key in PROPORTIONAL:
        return cast(float, getattr(scene.structure, key))
    if owner == "structure":
        part = next(iter(_structure_parts(scene.structure, key)), None)
        if part is None:
            raise _unknown(scene, path)
        return cast(float, getattr(part, _quantity(part))) / share(part, key)
    contact = next((c for c in scene.contacts if has_parameter(c, owner, key)), None)
    if contact is None:
        raise _unknown(scene, path)
    return contact.value_of(key)


def with_values(scene: _SceneT, values: Mapping[str, float]) -> _SceneT:
    """The scene with other values; only what changes is checked again."""
    for path, new in values.items():
        if not isinstance(path, str):
            raise _unknown(scene, path)
        scene = _with_value(scene, path, _number(path, new))
    return scene


def _with_value(scene: _SceneT, path: str, new: float) -> _SceneT:
    followed = follows_speed(scene, path)
    if followed is not None:
        raise SettingError(path, new, f"cannot be set: {followed} follows the speed (`with_speed`)")
    if path == SPEED and scene.with_speed and scene.speed is not None:
        return cast(_SceneT, at_speed(scene, changed_bodies(scene, path, new)[SPEED]))
    if path in (AMPLITUDE, PHASE):
        change = _with_amplitude if path == AMPLITUDE else _with_phase
        return scene.model_copy(update={"excitation": change(scene.excitation, new)})
    if shape_of(scene, path) is not None:
        return scene.model_copy(update=with_shape_value(scene, path, new))
    if is_body_path(scene, path):
        return scene.model_copy(update=changed_bodies(scene, path, new))
    owner, _, key = path.rpartition(".")
    if is_gas_path(scene, path):
        wanted = "must be a number from -1e15 to 1e15"
        gas = tuple(
            _changed(each, {FACTOR: new}, path, new, wanted) if each.name == owner else each
            for each in scene.aerodynamics
        )
        return scene.model_copy(update={"aerodynamics": gas})
    if owner == "structure":
        return scene.model_copy(update={"structure": _with_structure(scene, path, key, new)})
    own = own_parts(scene)["contacts"] if scene.dampers else scene.contacts
    if not any(has_parameter(contact, owner, key) for contact in own):
        raise _unknown(scene, path)
    contacts = tuple(
        _changed(contact, contact.changed_by(key, new), path, new, contact.parameters[key].wanted)
        if has_parameter(contact, owner, key)
        else contact
        for contact in scene.contacts
    )
    return scene.model_copy(update={"contacts": contacts})


def _with_structure(scene: HasParts, path: str, name: str, new: float) -> Structure:
    if isinstance(scene.structure, MatricesStructure) and name in PROPORTIONAL:
        if not 0.0 <= new <= LARGEST:
            unit = "s" if name == PROPORTIONAL[0] else "1/s"
            raise SettingError(path, new, f"must be a number >= 0 and <= 1e15 [{unit}]")
        return scene.structure.model_copy(update={name: new})
    if is_loss(scene.structure, name):
        if not 0.0 < new <= 10.0:
            raise SettingError(path, new, "must be a number > 0 and <= 10")
        return scene.structure.model_copy(update={LOSS: new})
    members = _structure_parts(scene.structure, name)
    if not members:
        raise _unknown(scene, path)
    changed = {
        id(part): _changed(part, {key: new * share(part, name)}, path, new, _RANGES[key])
        for part in members
        for key in (_quantity(part),)
    }
    tables = {table: getattr(scene.structure, table) for table in ("masses", "springs", "dampers")}
    return scene.structure.model_copy(
        update={table: tuple(changed.get(id(old), old) for old in parts) for table, parts in tables.items()}
    )


def _with_amplitude(forces: tuple[Excitation, ...], new: float) -> tuple[Excitation, ...]:
    first = forces[0].amplitude
    if first == 0.0 and len(forces) > 1:
        raise SettingError(AMPLITUDE, new, "scales all forces by one factor, but the first one is 0")
    scaled = [new, *(force.amplitude * (new / first) for force in forces[1:])]
    wanted = _RANGES["amplitude"]
    return tuple(
        _changed(force, {"amplitude": a}, AMPLITUDE, new, wanted)
        for force, a in zip(forces, scaled, strict=True)
    )


def _with_phase(forces: tuple[Excitation, ...], new: float) -> tuple[Excitation, ...]:
    """Shift every force but static ones so that the first has the phase `new`."""
    moving = [force for force in forces if force.harmonic]
    if not moving:
        raise SettingError(PHASE, new, "has no meaning: every force of this scene is static")
    shift = new - moving[0].phase
    phases = {id(force): force.phase + shift for force in moving} | {id(moving[0]): new}
    return tuple(
        _changed(force, {"phase": phases[id(force)]}, PHASE, new, _RANGES["phase"])
        if force.harmonic
        else force
        for force in forces
    )


def _changed(part: _PartT, update: Mapping[str, object], path: str, new: float, wanted: str) -> _PartT:
    """The part with other fields; SettingError says what is `wanted` if it may not have them."""
    try:
        return type(part).model_validate({**part.__dict__, **update}, by_name=True)
    except ValidationError as error:
        raise SettingError(path, new, wanted) from error


def _structure_parts(structure: Structure, name: str) -> tuple[_Named, ...]:
    if isinstance(structure, MatricesStructure):
        return ()
    parts: tuple[_Named, ...] = (*structure.springs, *structure.dampers, *structure.masses)
    return tuple(part for part in parts if name and name in (part.name, part.group))


def _quantity(part: _Named) -> str:
    return {Mass: "m", Spring: "k", Damper: "c"}[type(part)]


def _number(path: str, new: object) -> float:
    try:
        number = float(new)  # type: ignore[arg-type]
    except (TypeError, ValueError, OverflowError) as error:
        raise SettingError(str(path), new, "must be a number") from error
    rigid = path.endswith((".kt", ".kn")) and number == math.inf
    if isinstance(new, str | bool) or not (rigid or math.isfinite(number)):
        raise SettingError(str(path), new, "must be a finite number")
    return number


def _unknown(scene: HasParts, path: object, *besides: str) -> SettingError:
    if path == FREQUENCY:
        return SettingError("path", path, "must name a value of the scene; the frequency belongs to the run")
    known = (*besides, *parameter_paths(scene))
    return SettingError("path", path, f"must be one of {listing(known)}", nearest(str(path), known))


def parameter_unit(path: str) -> str:
    """The unit of the values of a parameter path; empty where there is none, or it depends on the scene."""
    # Loaded here: help and tables of results need no laws.
    from solver.contacts.laws.harmonics import higher_quantity, order_of
    from solver.contacts.laws.registry import laws

    units = {FREQUENCY: "Hz", AMPLITUDE: "N", PHASE: "rad"}
    owner, _, key = path.rpartition(".")
    if path in units or owner == "structure":
        return units.get(path, "")
    if order_of(key) is not None:
        return higher_quantity(key).unit
    # A path does not say which law its contact has: laws that share a word must agree.
    found = {law.PARAMETERS[key].unit for law in laws().values() if key in law.PARAMETERS}
    return found.pop() if len(found) == 1 else ""


def parameter(path: str, value: float) -> str:
    """A value of a parameter path with its unit."""
    return f"{number(value, digits=6)} {parameter_unit(path)}".rstrip()
