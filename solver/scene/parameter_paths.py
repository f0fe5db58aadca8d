"""Parameter paths of a scene, with units: ``shroud.N0``, ``excitation.amplitude``, ``structure.k1``, …

Every kind of owner lists its paths and makes a `SceneParameter` of one that is its own; what anything else
asks of a path is asked of that object.
"""

from __future__ import annotations

import json
import math
from collections.abc import Callable, Iterable, Mapping
from fnmatch import fnmatchcase
from numbers import Real
from typing import TYPE_CHECKING, Any, TypeVar, cast

from solver.contacts.fields import LARGEST
from solver.contacts.laws.contact_law import AnyContact
from solver.errors import SettingError
from solver.results.units import has_suffix, quantity, read
from solver.scene.bodies import shape_parts as of_bodies
from solver.scene.bodies.shape_parts import own_parts, shape_parameter, shape_paths
from solver.scene.excitation import AMPLITUDE as AMPLITUDE
from solver.scene.excitation import PHASE as PHASE
from solver.scene.excitation import excitation_parameter
from solver.scene.linear_terms import at_speed
from solver.scene.scene_parameter import ActsOn, SceneParameter, Slope, changed
from solver.scene.scene_records import Damper, Mass, MatricesStructure, Spring, Structure
from solver.wording import comma_hint, listing, nearest

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


FREQUENCY = "frequency"
LEAST_HZ, MOST_HZ = 1e-100, 1e100  # their squares, times any mass or stiffness, are numbers


_SceneT = TypeVar("_SceneT", bound="Scene")


def check_frequency(name: str, frequency_hz: float) -> float:
    """Return `frequency_hz` as a float if it is a usable frequency.

    Raises
    ------
    SettingError
        Not a number above 0, or one whose square floating-point numbers cannot tell.
    """
    number = isinstance(frequency_hz, Real) and not isinstance(frequency_hz, bool)
    if not number or not 0.0 < frequency_hz < math.inf:
        raise SettingError(name, frequency_hz, "must be a frequency > 0 Hz")
    if not LEAST_HZ <= frequency_hz <= MOST_HZ:
        raise SettingError(name, frequency_hz, f"must be a frequency from {LEAST_HZ:g} to {MOST_HZ:g} Hz")
    return float(frequency_hz)


def contact_paths(scene: Scene) -> tuple[str, ...]:
    """Return every path of groups of contacts and of contacts, but for those that a shape makes."""
    own = _own_contacts(scene)
    groups = (f"{c.group}.{key}" for c in own if c.group for key in c.parameters)
    return (*groups, *(f"{c.name}.{key}" for c in own for key in c.parameters))


def contact_parameter(scene: Scene, path: str) -> SceneParameter | None:
    """Return what a path of a contact or a group of them is, if it is one."""
    owner, _, key = path.rpartition(".")
    members = [
        (i, contact, contact.parameters[key])
        for i, contact in enumerate(scene.contacts)
        if owner in (contact.name, contact.group) and key in contact.parameters
    ]
    if not members:
        return None
    quantities = tuple(quantity for *_, quantity in members)

    def with_value(new: float) -> dict[str, Any]:
        made = {
            i: changed(contact, contact.changed_by(key, new), path, new, quantity.wanted)
            for i, contact, quantity in members
        }
        return {"contacts": tuple(made.get(i, old) for i, old in enumerate(scene.contacts))}

    own = _own_contacts(scene)
    return SceneParameter(
        get=lambda: members[0][1].value_of(key), with_value=with_value, unit=quantities[0].unit,
        least=max(quantity.least for quantity in quantities), acts_on=ActsOn.CONTACTS,
        contacts={i: 1.0 for i, *_ in members}, quantities=quantities,
        listed=own is scene.contacts or any(contact in own for _, contact, _ in members),
    )  # fmt: skip


def _own_contacts(scene: Scene) -> tuple[AnyContact, ...]:
    """The contacts that no shape makes."""
    return own_parts(scene)["contacts"] if scene.dampers else scene.contacts


_Lister = Callable[[Any], Iterable[str]]
_Maker = Callable[[Any, str], SceneParameter | None]
OWNERS: tuple[tuple[_Lister, _Maker], ...] = (
    (lambda _: (AMPLITUDE, PHASE), excitation_parameter),
    (contact_paths, contact_parameter),
    (structure_paths, structure_parameter),
    (shape_paths, shape_parameter),
    (of_bodies.body_paths, of_bodies.body_parameter),
    (of_bodies.load_paths, of_bodies.load_parameter),
    (of_bodies.speed_paths, of_bodies.speed_parameter),
    (term_paths, term_parameter),
)
"""For every kind of owner what lists its paths and what makes the parameter of one; the first that does."""


def parameter_paths(scene: Scene) -> tuple[str, ...]:
    """Every path that has a value in the scene."""
    return tuple(dict.fromkeys(path for listed, _ in OWNERS for path in listed(scene)))


def find_parameter(scene: Scene, path: object) -> SceneParameter | None:
    """Return what a path is in a scene; None of what is none, and of the frequency."""
    if not isinstance(path, str) or path == FREQUENCY:
        return None
    return next((found for _, make in OWNERS if (found := make(scene, path)) is not None), None)


def parameter_of(scene: Scene, path: object) -> SceneParameter:
    """Return what a path is in a scene.

    Raises
    ------
    SettingError
        The scene has no such parameter; the message lists those it has.
    """
    found = find_parameter(scene, path)
    if found is None:
        raise _unknown(scene, path)
    return found


def follows_speed(scene: Scene, path: str) -> str | None:
    """The parameter that follows the speed and that a path would set, itself or its group's; else None."""
    found = find_parameter(scene, path) if scene.with_speed else None
    for each in scene.with_speed:
        theirs = find_parameter(scene, each.path)
        if path == each.path or (found is not None and theirs is not None and found.sets_with(theirs)):
            return each.path
    return None


def check_path(scene: Scene, path: str) -> None:
    """Raise SettingError unless `path` is ``frequency`` or a path of the scene.

    Along an engine-order line the ``speed`` is one too.
    """
    if path == FREQUENCY or (path == of_bodies.SPEED and scene.speed_order is not None):
        return
    found = find_parameter(scene, path)
    if found is None or not found.listed:
        raise _unknown(scene, path, FREQUENCY)


def value(scene: Scene, path: str) -> float:
    """Value of a path; of a group, its first member's."""
    return parameter_of(scene, path).get()


def with_values(scene: _SceneT, values: Mapping[str, float]) -> _SceneT:
    """The scene with other values; only what changes is checked again."""
    for path in values:
        if not isinstance(path, str):
            raise _unknown(scene, path)
    if len(values) > 1:
        _check_together(scene, values)
    for path, new in values.items():
        given = new
        try:
            if isinstance(new, str) and has_suffix(new):
                given = read(new, parameter_of(scene, path).unit)
            number = float(given)
        except (TypeError, ValueError, OverflowError) as error:
            words = str(error) if isinstance(new, str) and has_suffix(new) else "must be a number"
            raise SettingError(str(path), new, words, comma_hint(str(new))) from error
        rigid = path.endswith((".kt", ".kn")) and number == math.inf
        if isinstance(given, str | bool) or not (rigid or math.isfinite(number)):
            raise SettingError(str(path), new, "must be a finite number")
        scene = _with_value(scene, path, number)
    return scene


def without(scene: _SceneT, names: Iterable[str]) -> _SceneT:
    """The scene without contacts and dampers of some names, and without bodies that nothing else holds."""
    raw: dict[str, Any] = scene.to_dict()
    gone, bodies = set[str](), {body.name for body in scene.bodies}
    for name in names:
        rows = [*raw["contacts"], *raw.get("dampers", ())]
        found = {
            row["name"]
            for row in rows
            for said in (row["name"], row.get("group"))
            if said and fnmatchcase(said, name)
        }
        if not found:
            known = dict.fromkeys(said for row in rows for said in (row["name"], row.get("group")) if said)
            raise SettingError("without", name, f"must be of {listing([*known])}", nearest(name, [*known]))
        gone |= found
    contacts = tuple(contact for contact in scene.contacts if contact.name not in gone)
    followed = tuple(one for one in scene.with_speed if one.path.rpartition(".")[0] not in gone)
    if not bodies:
        return scene.model_copy(update={"contacts": contacts, "with_speed": followed})
    for key in ("contacts", "dampers"):
        raw[key] = [row for row in raw.get(key, ()) if row["name"] not in gone]
    kept = json.dumps([raw["contacts"], raw["dampers"]])
    free = {body for body in bodies - gone if f'"{body}' not in kept} | gone & bodies

    def stays(row: Any) -> bool:
        ends = [*row.get("between", ()), row.get("name"), row.get("on"), row.get("path")]
        return not any(str(end).partition(".")[0] in free for end in ends)

    for table in (raw, raw["structure"]):
        for key in ("bodies", "loads", "couplings", "springs", "dampers", "with_speed"):
            if key in table:
                table[key] = [row for row in table[key] if stays(row)]
    return cast(_SceneT, type(scene).from_dict(raw))


def _check_together(scene: Scene, values: Mapping[str, float]) -> None:
    """Raise SettingError where two paths say one number: N1 and N1_ratio, or a group and a member of it."""
    owners = dict[str | None, dict[str, str]]()
    for path in values:
        owner, _, key = path.rpartition(".")
        owners.setdefault(owner, {})[key] = path

    def refused(path: str, other: str) -> SettingError:
        return SettingError(path, values[path], f"cannot be set together with `{other}`: give one of both")

    for part in named_parts(scene.structure):
        group, own = f"{STRUCTURE}{part.group}", f"{STRUCTURE}{part.name}"
        if group != own and group in values and own in values:
            raise refused(group, own)
    named = [*((c.group, c.name) for c in scene.contacts), *((b.group, b.name) for b in scene.bodies)]
    for of, name in named:
        of_group, alone = owners.get(of, {}), owners.get(name, {})
        for key in of_group:
            if key in alone and of_group is not alone:
                raise refused(of_group[key], alone[key])
    for contact in scene.contacts:
        said = {**owners.get(contact.group, {}), **owners.get(contact.name, {})}
        for key in filter(contact.parameters.__contains__, said if len(said) > 1 else ()):
            for other in contact.changed_by(key, 0.0):
                if other != key and other in said:
                    raise refused(said[key], said[other])


def _with_value(scene: _SceneT, path: str, new: float) -> _SceneT:
    followed = follows_speed(scene, path)
    if followed is not None:
        raise SettingError(path, new, f"cannot be set: {followed} follows the speed (`with_speed`)")
    found = parameter_of(scene, path)
    if not found.listed:
        raise _unknown(scene, path)
    update = found.with_value(new)
    if of_bodies.SPEED in update and scene.with_speed:
        return cast(_SceneT, at_speed(scene, new))
    return scene.model_copy(update=update)


def _unknown(scene: Scene, path: object, *besides: str) -> SettingError:
    if path == FREQUENCY:
        return SettingError("path", path, "must name a value of the scene; the frequency belongs to the run")
    known = (*besides, *parameter_paths(scene))
    return SettingError("path", path, f"must be one of {listing(known)}", nearest(str(path), known))


def parameter_unit(path: str) -> str:
    """The unit of the values of a parameter path; empty where there is none, or it depends on the scene."""
    # Loaded here: help and tables of results need no laws.
    from solver.contacts.laws.law_registry import laws
    from solver.contacts.laws.load_harmonics import higher_quantity, order_of

    units = {FREQUENCY: "Hz", AMPLITUDE: "N", PHASE: "rad", of_bodies.SPEED: "1/min"}
    owner, _, key = path.rpartition(".")
    if path in units or owner == "structure":
        return units.get(path, "")
    if order_of(key) is not None:
        return higher_quantity(key).unit
    # A path does not say what its owner is: laws, and shapes of bodies, that share a word must agree.
    found = {law.PARAMETERS[key].unit for law in laws().values() if key in law.PARAMETERS}
    found |= {of_bodies.UNITS[key]} if key in of_bodies.UNITS else set()
    return found.pop() if len(found) == 1 else ""


def parameter(path: str, value: float) -> str:
    """A value of a parameter path with its unit."""
    return quantity(value, parameter_unit(path))
