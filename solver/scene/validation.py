"""What is wrong with a scene, all of it at once: pydantic's findings in our words, and cross references.

The cross references are checked on the plain tables and lists, so that a negative friction coefficient does
not hide a misspelt degree of freedom.
"""

from __future__ import annotations

import re
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from contextlib import suppress
from functools import cache
from itertools import chain, islice
from typing import Any, cast

from pydantic import BaseModel, ValidationError
from pydantic_core import ErrorDetails

from solver.contacts.fields import GROUND, End, parse_end
from solver.contacts.laws.law_registry import DEFAULT, laws
from solver.contacts.laws.load_harmonics import LoadHarmonic
from solver.errors import Issue, Place, Shown, pointer
from solver.extensions import on_change
from solver.matrices.values import Named
from solver.results.told import UNIT
from solver.results.units import BOUNDS, bound_said, doubt_said, has_suffix, read
from solver.scene.bodies.body import Body, Load, Node, body_dofs
from solver.scene.bodies.body_shapes import SHAPES, WITH_BODY
from solver.scene.cyclic.sector_tables import is_cyclic
from solver.scene.excitation import PLACES
from solver.scene.linear_terms import (
    Aerodynamics,
    Coupling,
    DiameterCoefficient,
    Influence,
    SpeedDependence,
    coupling_kinds,
    kind_of,
)
from solver.scene.materials import Material, strength_issue
from solver.scene.scene_records import (
    KINDS,
    LAW_TAG,
    CyclicBoundary,
    CyclicStructure,
    Damper,
    Excitation,
    LumpedStructure,
    MassEntry,
    MatricesStructure,
    Mistuning,
    Observe,
    Recovered,
    Reduction,
    Spring,
)
from solver.wording import comma_hint, every_field_said, listing, nearest, quoted

_Table = tuple[str, type[BaseModel]]
_TERMS: dict[tuple[str, ...], _Table] = {
    ("with_speed",): ("a dependence on the speed", SpeedDependence),
    ("recovery",): ("a recovered quantity", Recovered),
    ("materials",): ("a material", Material),
    ("couplings",): ("a coupling", Coupling),
    ("aerodynamics",): ("aerodynamics", Aerodynamics),
    ("aerodynamics", "influence"): ("an influence", Influence),
    ("aerodynamics", "nodal_diameters"): ("a nodal diameter", DiameterCoefficient),
}

MOST_ISSUES = 200  # of each kind: a scene with more is not read by a person
RESERVED_PREFIXES = ("excitation", "structure", "frequency", "observe", "speed")
_SCENE_KEYS = (
    "name", "structure", "contacts", "excitation", "observe", "bodies", "nodes", "loads", "dampers", "speed",
    "couplings", "aerodynamics", "speed_order", "with_speed", "recovery", "materials",
)  # fmt: skip
_TABLES: dict[tuple[str, ...], _Table] = {
    ("structure", "lumped"): ("a lumped structure", LumpedStructure),
    ("structure", "cyclic"): ("a cyclic structure", CyclicStructure),
    ("structure", "matrices"): ("a matrices structure", MatricesStructure),
    ("structure", "matrices", "reduction"): ("reduction", Reduction),
    ("structure", "matrices", "cyclic"): ("structure.cyclic", CyclicBoundary),
    ("structure", "masses"): ("a mass", MassEntry),
    ("structure", "springs"): ("a spring", Spring),
    ("structure", "dampers"): ("a damper", Damper),
    ("structure", "mistuning"): ("mistuning", Mistuning),
    ("excitation",): ("an excitation", Excitation),
    ("observe",): ("observe", Observe),
    ("bodies",): ("a body", Body),
    ("nodes",): ("a node", Node),
    ("loads",): ("a load", Load),
    **_TERMS,
    **{("dampers", shape): (f"a damper of the shape `{shape}`", each) for shape, each in SHAPES.items()},
}


def between_keys() -> tuple[str, ...]:
    """The keys of ends of a contact, of whatever law."""
    return tuple(dict.fromkeys(key for law in laws().values() for key in law.END_KEYS))


def _tables_of_kinds() -> dict[tuple[str, ...], _Table]:
    """The contacts of each law, and the couplings of each kind."""
    found: dict[tuple[str, ...], _Table] = {
        ("couplings", kind): (f"a coupling of the kind `{kind}`", each)
        for kind, each in coupling_kinds().items()
        if each is not Coupling
    }
    for law, each in laws().items():
        answer = f"a contact with the law `{law}`", each
        if law == DEFAULT:
            answer = found["contacts",] = "a contact", each
        found["contacts", LAW_TAG + law] = answer
        found["contacts", LAW_TAG + law, "load"] = "a harmonic of a load", LoadHarmonic
    return found


_WANTED = {
    "float_type": "must be a number",
    **dict.fromkeys(("int_type", "int_from_float"), "must be a whole number"),
    "finite_number": "must be a finite number",
    "string_type": "must be a text",
    "string_pattern_mismatch": "may have only letters, digits, _ and -",
    "tuple_type": "must be a list",
    **dict.fromkeys(("dict_type", "model_type", "model_attributes_type"), "must be a table"),
    "too_short": "must not be empty",
}
_DEEPEST = 50  # a scene is five levels deep


def plain(data: object, depth: int = 0) -> object:
    """Models inside `data` replaced by the tables they stand for."""
    if isinstance(data, BaseModel):
        return data.model_dump(exclude_none=True)
    if depth < _DEEPEST and isinstance(data, Mapping):
        return {key: plain(value, depth + 1) for key, value in data.items()}
    if depth < _DEEPEST and isinstance(data, list | tuple) and not isinstance(data, Named):
        return [plain(value, depth + 1) for value in data]
    return data


_NUMERIC = re.compile(r"\b(Positive|NonNegative|Signed|Friction|Angle|Inclination|Stiffness|float|Vector)\b")


def unit_of(place: Place, raw: Mapping[str, Any]) -> str | None:
    """The unit of the number at a place of a scene, by its key: empty of a plain one, None of no number."""
    keys = [step for step in place if isinstance(step, str)]
    rows = [row for at, row in rows_of(dict(raw), keys[0]) if at == place[: len(at)]] if keys else []
    if keys[:2] == ["structure", "masses"] and len(keys) == 3:
        return "kg"
    if keys == ["excitation", "amplitude"]:
        return "m" if any(row.get("ground") or row.get("driven") for row in rows) else "N"
    for law in [laws().get(str(row.get("law"))) for row in rows if keys[0] == "contacts"]:
        if law is not None and keys[-1] in law.PARAMETERS:
            return law.PARAMETERS[keys[-1]].unit
    return _units_of_keys().get(keys[-1]) if keys else None


@cache
def _units_of_keys() -> dict[str, str]:
    """The unit of every key of a number, as its class says it: of one key the same but among laws."""
    found = {"load": "N", "speed": "1/min", "speed_order": "", "m": "kg"}
    models = (model for _, model in (*_TABLES.values(), *_tables_of_kinds().values()))
    for key, (kind, words) in chain.from_iterable(every_field_said(model).items() for model in models):
        if _NUMERIC.search(kind) and not found.get(key):
            found[key] = next((unit for unit in UNIT.findall(words) if "," not in unit), "")
    return found


on_change(_units_of_keys.cache_clear)


def in_si(raw: Any, whole: Mapping[str, Any], place: Place = ()) -> Any:
    """A scene with numbers where they have a unit behind them, ``"35 deg"``; what cannot be read stays."""
    if isinstance(raw, str):
        unit = unit_of(place, whole) if has_suffix(raw) else None
        with suppress(ValueError):
            return raw if unit is None else read(raw, unit)
    elif len(place) > _DEEPEST:
        return raw
    elif isinstance(raw, dict):
        return {key: in_si(value, whole, (*place, key)) for key, value in raw.items()}
    elif isinstance(raw, list) and any(isinstance(one, str | dict | list) for one in raw):
        return [in_si(one, whole, (*place, i)) for i, one in enumerate(raw)]
    return raw


def field_issues(error: ValidationError, raw: dict[str, Any]) -> list[Issue]:
    """Pydantic's findings as issues: pointers into the tables the user wrote, messages in our words."""
    return [_field_issue(found, raw) for found in error.errors(include_url=False)[:MOST_ISSUES]]


def _field_issue(found: ErrorDetails, raw: dict[str, Any]) -> Issue:
    steps, last = _walk(found["loc"], raw)
    kind, context, name = found["type"], found.get("ctx", {}), found["loc"][-1] if found["loc"] else ""
    place = tuple(steps)
    if kind == "missing" and isinstance(name, int):
        return Issue(place, "has too few entries", Shown(quoted(last)))
    if kind == "missing":
        return Issue((*steps, name), f"is missing: {_table(found['loc'])[0]} needs it")
    if kind == "extra_forbidden":
        table, keys = _table(found["loc"])
        hint = f"known keys: {listing(keys)}{nearest(str(place[-1]), keys)}"
        return Issue(place, f"= {quoted(last)} is not a key of {table}; {hint}")
    if kind in ("union_tag_invalid", "union_tag_not_found"):
        # The key that tells the kinds of a table apart, and its words.
        words = {"contacts": ("law", tuple(laws())), "dampers": ("shape", tuple(SHAPES)),
                 "couplings": ("kind", tuple(coupling_kinds()))}  # fmt: skip
        tag, tags = words.get(str(steps[0]) if steps else "", ("kind", KINDS))
        got = last.get(tag) if isinstance(last, dict) else None
        hint = nearest(got, tags) if isinstance(got, str) else ""
        return Issue((*steps, tag), f"must be one of {listing(tags)}", Shown(quoted(got) + hint))
    if kind == "value_error":
        return Issue(tuple(steps), str(context["error"]), named=False)
    unit = unit_of(place, raw) or ""
    if kind in BOUNDS:
        wanted = bound_said(found, unit)
        if isinstance(last, dict) and name in _table(found["loc"])[1]:
            # Another key gave the number, as the list of a load gives N0.
            return Issue(place, f"`{name}` {wanted}", Shown(quoted(found["input"])), named=False)
        return Issue(place, wanted, Shown(quoted(last) + doubt_said(last, unit)))
    wanted = _WANTED.get(kind, found["msg"])
    if kind == "too_long":
        wanted = f"must have {context['max_length']} entries at most"
    if kind == "float_type" and isinstance(last, str):
        wanted, hint = _no_number(last, unit)
        return Issue(place, wanted, Shown(quoted(last) + hint))
    return Issue(place, wanted, Shown(quoted(last)))


def _no_number(text: str, unit: str) -> tuple[str, str]:
    try:
        read(text, unit)
    except ValueError as error:
        return str(error), comma_hint(text)
    return "must be a number without quotes", ""


def _walk(loc: Iterable[int | str], raw: object) -> tuple[list[int | str], object]:
    """Follow pydantic's location as far as it exists in the user's tables (it also names union members)."""
    steps: list[int | str] = []
    for step in loc:
        in_list = isinstance(raw, list) and isinstance(step, int) and step < len(raw)
        if in_list or (isinstance(raw, dict) and step in raw):
            raw = cast(Any, raw)[step]
            steps.append(step)
    return steps, raw


def _table(loc: tuple[int | str, ...]) -> tuple[str, tuple[str, ...]]:
    """Name and known keys of the innermost table on the way to a location."""
    title, model = table_of(loc)
    if model is BaseModel:
        return title, _SCENE_KEYS
    return title, tuple(field.alias or key for key, field in model.model_fields.items())


def table_of(loc: tuple[int | str, ...]) -> _Table:
    """Name and class of the innermost table on the way to a location."""
    names = tuple(step for step in loc[:-1] if isinstance(step, str))
    for known, (title, model) in reversed([*_TABLES.items(), *_tables_of_kinds().items()]):
        without_tag = tuple(name for name in names if name not in KINDS)
        if names[: len(known)] == known or (known and without_tag[: len(known)] == known):
            return title, model
    return "a scene", BaseModel


def structure_of(raw: Mapping[str, Any]) -> dict[str, Any]:
    """The table of the structure; an empty one where it is none."""
    return found if isinstance(found := raw.get("structure"), dict) else {}


def cross_issues(raw: dict[str, Any]) -> list[Issue]:
    """What is wrong between the parts of a scene: unknown DOFs, duplicate names, engine orders."""
    structure = structure_of(raw)
    table = "dofs" if structure.get("kind") == "matrices" else "masses"
    dofs = dofs_of(raw)
    cyclic = is_cyclic(structure)
    parts = ((steps, row.get("name")) for steps, row in parts_of(structure))
    named = [((*steps, "name"), name) for steps, name in parts if isinstance(name, str)]
    found = chain(
        _reserved_dofs(dofs or (), table, cyclic),
        _end_issues(raw, structure, dofs, cyclic),
        _dof_issues(raw, dofs, structure.get("sectors") if cyclic else 0),
        duplicates(named, "structure"),
        _contact_name_issues(raw, cyclic),
        wave_issues(raw, "engine_order"),
    )
    return list(islice(found, MOST_ISSUES))


_Known = dict[str, None]


def dofs_of(raw: dict[str, Any]) -> _Known | None:
    """The names of all DOFs, those of bodies behind the structure's; None if they cannot be told."""
    structure = structure_of(raw)
    table = "dofs" if structure.get("kind") == "matrices" else "masses"
    own = _dof_names(structure.get(table), table)
    if own is None:
        return None
    shapes = [row for _, row in rows_of(raw, "dampers") if row.get("shape") in WITH_BODY]
    bodies = [*(row for _, row in rows_of(raw, "bodies")), *shapes]
    bodies = [row for row in bodies if isinstance(row.get("name"), str)]
    own |= dict.fromkeys(dof for row in bodies for dof in body_dofs(row["name"], row.get("plane")))
    return own | dict.fromkeys(name for _, name in named_rows(raw, "couplings", by="point"))


def _dof_names(given: object, table: str) -> _Known | None:
    """The names of the DOFs: keys of a table, or (of matrices) a list; None if they cannot be told."""
    if isinstance(given, dict):
        return dict.fromkeys(map(str, given))
    if table == "dofs" and isinstance(given, list | tuple) and all(isinstance(name, str) for name in given):
        return dict.fromkeys(given)
    return None


def _reserved_dofs(dofs: Iterable[str], table: str, cyclic: bool) -> Iterator[Issue]:
    for dof in dofs:
        place = ("structure", table, dof)
        if dof == GROUND:
            what = "mass" if table == "masses" else "DOF"
            yield Issue(place, f"is reserved: give the {what} another name")
        if cyclic and "@" in dof:
            yield Issue(place, f"`{dof}`: no '@' in a DOF of a cyclic structure", named=False)


def rows_of(table: dict[str, Any], key: str) -> Iterator[tuple[Place, dict[str, Any]]]:
    """The tables under `key`, whether one or a list, with their steps."""
    rows = table.get(key)
    if isinstance(rows, dict):
        yield (key,), rows
    for i, row in enumerate(rows if isinstance(rows, list) else []):
        if isinstance(row, dict):
            yield (key, i), row


def in_space(contact: dict[str, Any]) -> bool:
    """Whether a contact is one between bodies and nodes, not DOFs."""
    return contact.get("normal") is not None or contact.get("motions") is not None


def _end_issues(
    raw: dict[str, Any], structure: dict[str, Any], dofs: _Known | None, cyclic: bool
) -> Iterator[Issue]:
    def of_end(place: Place, text: str, end: End) -> Iterator[Issue]:
        key = str(place[-2])
        if end.next and not cyclic:
            yield no_sector(place, key, text)
        if end.dof is not None and dofs is not None and end.dof not in dofs:
            yield unknown_dof(place, key, text, end.dof, [*dofs, GROUND])

    rows = [row for key in ("springs", "dampers") for row in rows_of(structure, key)]
    elements = [(("structure", *steps), row) for steps, row in rows]
    contacts = [each for each in rows_of(raw, "contacts") if not in_space(each[1])]
    for steps, row in [*elements, *contacts]:
        for key in between_keys():
            yield from pair_issues((*steps, key), row.get(key), of_end)


def pair_issues(
    steps: Place, pair: object, of_end: Callable[[Place, str, End], Iterator[Issue]]
) -> Iterator[Issue]:
    """What is wrong with a pair of ends, and with each of them; its form is pydantic's matter."""
    if not (isinstance(pair, list) and len(pair) == 2 and all(isinstance(end, str) for end in pair)):
        return
    ends = [parse_end(text) for text in pair]
    if pair[0] == pair[1]:
        yield Issue(steps, "must join two different ends", pair)
    elif all(end.next for end in ends):
        yield Issue(steps, "must have one end in this sector", pair)
    for i, (text, end) in enumerate(zip(pair, ends, strict=True)):
        yield from of_end((*steps, i), text, end)


def no_sector(place: Place, key: str, text: str) -> Issue:
    """What to say of an end in the next sector where there is none."""
    said = f"`{key}`: {text!r} needs a cyclic structure; this one has no next sector"
    return Issue(place, said, named=False)


def unknown_dof(place: Place, key: str, text: str, dof: str, known: Sequence[str]) -> Issue:
    """What to say of a DOF that does not exist."""
    hint = f"known: {listing(known)}{nearest(dof, known)}"
    return Issue(place, f"`{key}`: there is no DOF {quoted(text)}; {hint}", named=False)


def known_dofs(
    steps: Place, row: dict[str, Any], keys: tuple[str, ...], dofs: dict[str, None] | None
) -> Iterator[Issue]:
    """The DOFs that stand in a table under some keys, alone or in lists, and do not exist."""
    for key in keys:
        given = row.get(key)
        for dof in given if isinstance(given, list) else [given]:
            if isinstance(dof, str) and dofs is not None and dof not in dofs:
                yield unknown_dof((*steps, key), key, dof, dof, list(dofs))


def _dof_issues(raw: dict[str, Any], dofs: _Known | None, sectors: object) -> Iterator[Issue]:
    if dofs is None:
        return
    recovered = [row.get("name") for _, row in rows_of(raw, "recovery")]
    for steps, row in rows_of(raw, "excitation"):
        yield from known_dofs(steps, row, ("dof",), dofs)
    for steps, row in rows_of(raw, "observe"):
        dof = row.get("dof")
        base, _, sector = dof.rpartition("@") if isinstance(dof, str) else ("", "", "")
        there = sector.isdecimal() and isinstance(sectors, int) and int(sector[:10]) < sectors
        if dof not in recovered and not (there and (base in dofs or base in recovered)):
            yield from known_dofs(steps, row, ("dof",), dofs)


_Named = list[tuple[Place, str]]


def named_rows(table: dict[str, Any], *keys: str, by: str = "name") -> _Named:
    """The names in tables, or what else stands under the key `by`, with their places."""
    rows = [row for key in keys for row in rows_of(table, key)]
    return [((*steps, by), row[by]) for steps, row in rows if isinstance(row.get(by), str)]


def parts_of(structure: dict[str, Any]) -> Iterator[tuple[Place, dict[str, Any]]]:
    """Masses, springs and dashpots that are tables, with their places."""
    masses = structure.get("masses")
    for dof, row in masses.items() if isinstance(masses, dict) else ():
        if isinstance(row, dict):
            yield ("structure", "masses", str(dof)), row
    for key in ("springs", "dampers"):
        for steps, row in rows_of(structure, key):
            yield ("structure", *steps), row


def duplicates(named: _Named, what: str) -> Iterator[Issue]:
    """Names that are given twice."""
    seen: dict[str, str] = {}
    for steps, name in named:
        if name in seen:
            yield Issue(steps, f"= {name!r} is taken by {seen[name]}: names in {what} must differ")
        seen.setdefault(name, pointer(*steps))


def _contact_name_issues(raw: dict[str, Any], cyclic: bool) -> Iterator[Issue]:
    names, groups = (named_rows(raw, "contacts", by=key) for key in ("name", "group"))
    yield from duplicates(names, "contacts")
    taken = {name for _, name in names}
    for steps, name in [*names, *groups]:
        key = steps[-1]
        if name in RESERVED_PREFIXES:
            yield Issue(steps, f"= {name!r} is reserved in parameter paths: give the contact another {key}")
        if key == "group" and name in taken:
            yield Issue(steps, f"= {name!r} is also the name of a contact")
        if cyclic and "@" in name:
            yield Issue(steps, f"= {name!r}: no '@' in a cyclic scene")


def wave_issues(raw: dict[str, Any], key: str) -> Iterator[Issue]:
    """Numbers or words of a wave round a disk that has no sectors, or that differ between its forces."""
    structure, first = structure_of(raw), None
    kind = structure.get("kind")
    for steps, row in rows_of(raw, "excitation"):
        given = row.get(key)
        if given is None:
            continue
        place = (*steps, key)
        if kind in ("lumped", "matrices") and not is_cyclic(structure):
            yield Issue(place, f"= {quoted(given)} needs a cyclic structure; remove it from a {kind} one")
        elif first is not None and given != first:
            yield Issue(place, "must be the same everywhere", Shown(f"{quoted(given)} after {quoted(first)}"))
        first = given if first is None else first


AMPLITUDE_PATH = "excitation.amplitude"


def term_issues(raw: dict[str, Any]) -> list[Issue]:
    """Unknown DOFs, sectors where there are none, names taken twice, a speed that is missing."""
    return list(islice(_issues(raw), MOST_ISSUES))


def _issues(raw: dict[str, Any]) -> Iterator[Issue]:
    structure, dofs = structure_of(raw), dofs_of(raw)
    cyclic = is_cyclic(structure)
    points, kinds = named_rows(raw, "couplings", by="point"), coupling_kinds()
    taken = dofs_of({key: each for key, each in raw.items() if key != "couplings"} if points else {})
    yield from duplicates(points, "points")
    for steps, point in points:
        if point == GROUND or point in (taken or ()):
            yield Issue(steps, f"= {point!r} is that of another DOF: give the point a name of its own")
    for steps, row in rows_of(raw, "couplings"):
        kind = kinds.get(kind_of(row), Coupling)
        yield from known_dofs(steps, row, kind.DOFS, dofs)
        if row.get("offset") and not cyclic:
            yield Issue(
                (*steps, "offset"),
                f"= {row['offset']!r} needs a cyclic structure; this one has no other sectors",
            )
        for key in kind.TURNING:
            if row.get(key) and not _has_speed(raw):
                yield _needs_speed(*steps, key)
    for key in ("G", "K_omega2"):
        if structure.get(key) is not None and not _has_speed(raw):
            yield _needs_speed("structure", key)
    for steps, row in rows_of(raw, "excitation"):
        for key in PLACES[1:]:
            keys = tuple(row[key]) if isinstance(row.get(key), dict) else ()
            yield from known_dofs((*steps, key), dict(zip(keys, keys, strict=True)), keys, dofs)
    yield from _base_issues(raw, cyclic)
    yield from _speed_issues(raw)
    yield from _recovery_issues(raw, dofs)
    for steps, row in rows_of(raw, "aerodynamics"):
        yield from known_dofs(steps, row, ("dof",), dofs)
        if not cyclic:
            yield Issue(steps, "acts between the blades of a cyclic structure; this one has no sectors")
    named = named_rows(raw, "aerodynamics", "bodies", "nodes", "loads", "dampers", "contacts")
    # Couplings of one name are set together: they are one owner.
    coupled = {name: place for place, name in named_rows(raw, "couplings")}
    mine = {*coupled, *(name for _, name in named_rows(raw, "aerodynamics"))}
    every = [*((place, name) for name, place in coupled.items()), *named]
    yield from duplicates([(place, name) for place, name in reversed(every) if name in mine], "paths")


def _base_issues(raw: dict[str, Any], cyclic: bool) -> Iterator[Issue]:
    """Bases of two kinds, of a disk, or a relative motion without any."""
    first: str | None = None
    for steps, row in rows_of(raw, "excitation"):
        given = [key for key in ("ground", "driven") if row.get(key) is not None]
        if not given:
            continue
        place = (*steps, given[0])
        if cyclic:
            yield Issue(place, "moves a base, which a cyclic structure has not")
        first = first or given[0]
        if given[0] != first:
            yield Issue(place, f"beside `{first}`: the ground moves or DOFs are driven, not both")
    for steps, row in rows_of(raw, "observe"):
        if row.get("relative") and first is None:
            yield Issue(
                (*steps, "relative"),
                "= true needs a base that moves (`ground` or `driven` of the excitation)",
            )


def _has_speed(raw: dict[str, Any]) -> bool:
    return raw.get("speed") is not None or raw.get("speed_order") is not None


def _speed_issues(raw: dict[str, Any]) -> Iterator[Issue]:
    """A speed given twice, and what follows it but cannot."""
    if raw.get("speed") is not None and raw.get("speed_order") is not None:
        yield Issue(
            ("speed_order",), "stands in place of `speed`: the speed follows the frequency; remove one"
        )
    named = [row.get(key) for _, row in rows_of(raw, "contacts") for key in ("name", "group")]
    contacts = dict.fromkeys(name for name in named if isinstance(name, str))
    seen: list[object] = []
    for steps, row in rows_of(raw, "with_speed"):
        path, place = row.get("path"), (*steps, "path")
        if not isinstance(path, str):
            continue
        owner, _, key = path.rpartition(".")
        if path != AMPLITUDE_PATH and not (key == "N0" and owner in contacts):
            known = ", ".join(f"{name}.N0" for name in contacts)
            yield Issue(place, f"must be `{AMPLITUDE_PATH}` or one of {known or 'no contact'}", path)
        elif path in seen:
            yield Issue(place, f"= {path!r} follows the speed twice")
        seen.append(path)
        if not _has_speed(raw):
            yield Issue(place, f"= {path!r} needs the `speed` of the scene, or `speed_order`")
        forces = [each for _, each in rows_of(raw, "excitation")]
        if path == AMPLITUDE_PATH and any(not each.get("amplitude") for each in forces[:1]):
            wanted = "`amplitude` of the first excitation must not be 0: the others are in proportion to it"
            yield Issue(place, wanted, named=False)
    turning = any(row.get("radius_of_rotation") for _, row in rows_of(raw, "bodies"))
    if raw.get("speed_order") is not None and turning and any(rows_of(raw, "loads")):
        yield Issue(("speed_order",), "cannot go with [[loads]] beside bodies that the speed loads")


def _recovery_issues(raw: dict[str, Any], dofs: dict[str, None] | None) -> Iterator[Issue]:
    """Recovered quantities of DOFs that do not exist, or with a name that is taken."""
    rows = list(rows_of(raw, "recovery"))
    named = [((*steps, "name"), row["name"]) for steps, row in rows if isinstance(row.get("name"), str)]
    yield from duplicates(named, "recovery")
    made = list(rows_of(raw, "materials"))
    yield from duplicates([((*at, "name"), one["name"]) for at, one in made if "name" in one], "materials")
    for steps, row in rows:
        if isinstance(row.get("material"), str):
            issue = strength_issue(steps, row, {str(one.get("name")): one for _, one in made})
            yield from () if issue is None else (issue,)
    for steps, row in rows if dofs is not None else ():
        terms = row.get("terms")
        for dof in terms if isinstance(terms, dict) else ():
            if dof not in (dofs or ()):
                yield unknown_dof((*steps, "terms", dof), "terms", dof, dof, list(dofs or ()))
        if row.get("name") in list(dofs or ()):
            yield Issue(
                (*steps, "name"), f"= {row['name']!r} is that of a DOF: give what is recovered another name"
            )


def _needs_speed(*place: int | str) -> Issue:
    return Issue(place, "needs the `speed` of rotation [1/min] of the scene")
