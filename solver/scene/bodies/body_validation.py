"""What is wrong with bodies, nodes, loads, contacts in space, mistuning, patterns and groups of a scene."""

from __future__ import annotations

import math
from collections.abc import Iterator
from itertools import chain, islice
from typing import Any

from pydantic import ValidationError

from solver.contacts.fields import GROUND, End, parse_end
from solver.contacts.laws.law_registry import DEFAULT, laws
from solver.errors import Issue, Place
from solver.matrices.sectors.sector_parts import WHOLE, PartsAcross
from solver.scene.bodies.body_shapes import WITH_BODY
from solver.scene.cyclic.sector_tables import is_cyclic
from solver.scene.scene_records import Mistuning
from solver.scene.validation import (
    MOST_ISSUES,
    RESERVED_PREFIXES,
    between_keys,
    dofs_of,
    duplicates,
    in_space,
    known_dofs,
    named_rows,
    no_sector,
    pair_issues,
    parts_of,
    rows_of,
    structure_of,
    unknown_dof,
    wave_issues,
)
from solver.wording import listing, nearest, quoted

_Dofs = dict[str, None] | None


def further_ends(law: object) -> tuple[str, ...]:
    """The keys of ends beside `between` that a contact of a law needs unless it is one in space."""
    known = laws().get(DEFAULT if law is None else str(law))
    return () if known is None else known.NEEDED_ENDS


def body_issues(raw: dict[str, Any]) -> list[Issue]:
    """Unknown bodies, nodes and DOFs, names taken twice, ends without a position."""
    dofs = dofs_of(raw)
    structure = structure_of(raw)
    found = chain(
        _name_issues(raw, is_cyclic(structure)),
        _node_issues(raw, structure),
        _load_issues(raw, dofs),
        *(_contact_issues(steps, row, raw, structure, dofs) for steps, row in rows_of(raw, "contacts")),
        *(
            _end_issues((*steps, "between"), {**row, "normal": True}, structure, _places(raw), dofs)
            for at, damper in rows_of(raw, "dampers")
            for steps, row in [(at, damper), *_points_of(at, damper)]
        ),
    )
    return list(islice(found, MOST_ISSUES))


def _points_of(at: Place, damper: dict[str, Any]) -> list[tuple[Place, dict[str, Any]]]:
    """The points of a patch, which have ends of their own."""
    pairs = damper.get("pairs")
    rows = enumerate(pairs if isinstance(pairs, list | tuple) else ())
    return [((*at, "pairs", i), row) for i, row in rows if isinstance(row, dict)]


def _places(raw: dict[str, Any]) -> list[str]:
    """Names of everything with a position."""
    shapes = [row.get("name") for _, row in rows_of(raw, "dampers") if row.get("shape") in WITH_BODY]
    dampers = [name for _, name in named_rows(raw, "dampers") if name in shapes]
    return [*(name for _, name in named_rows(raw, "bodies", "nodes")), *dampers]


def _name_issues(raw: dict[str, Any], cyclic: bool) -> Iterator[Issue]:
    """Names of bodies, nodes and loads that are taken, reserved, or of a sector."""
    named = named_rows(raw, "bodies", "nodes", "loads", "dampers")
    yield from duplicates(named, "bodies, nodes, loads and dampers")
    contacts = [row.get(key) for _, row in rows_of(raw, "contacts") for key in ("name", "group")]
    for steps, name in named:
        if name in contacts:
            said = "is that of a contact or its group: parameter paths need one owner"
            yield Issue(steps, f"= {name!r} {said}")
        if name in (*RESERVED_PREFIXES, GROUND):
            yield Issue(steps, f"= {name!r} is reserved: give it another name")
        if cyclic and "@" in name:
            yield Issue(steps, f"= {name!r}: no '@' in a cyclic scene")


def _node_issues(raw: dict[str, Any], structure: dict[str, Any]) -> Iterator[Issue]:
    own = dofs_of({"structure": structure})
    for steps, row in rows_of(raw, "nodes"):
        dofs = row.get("dofs")
        if isinstance(dofs, dict):
            yield from known_dofs((*steps, "dofs"), dofs, tuple(dofs), own)


def _load_issues(raw: dict[str, Any], dofs: _Dofs) -> Iterator[Issue]:
    known = _places(raw)
    for steps, row in rows_of(raw, "loads"):
        on = row.get("on")
        yield from known_dofs(steps, row, ("dof",), dofs)
        if isinstance(on, str) and on not in known:
            yield _unknown_place((*steps, "on"), "on", on, known, dofs)


def _contact_issues(
    steps: Place, row: dict[str, Any], raw: dict[str, Any], structure: dict[str, Any], dofs: _Dofs
) -> Iterator[Issue]:
    law = row.get("law")
    if not in_space(row):
        for key in further_ends(law):
            if row.get(key) is None:
                yield Issue((*steps, key), f"is missing: a contact with the law `{law}` needs it")
        return
    given = "normal" if row.get("motions") is None else "motions"
    for key in between_keys()[1:]:
        if row.get(key) is not None:
            yield Issue(
                (*steps, key), f"and `{given}` exclude each other: `{given}` says how the contact moves"
            )
    known = _places(raw)
    if given == "motions":
        yield from _motion_issues(steps, row, is_cyclic(structure), dofs)
        known += list(dofs or ())
    yield from _end_issues((*steps, "between"), row, structure, known, dofs)


def _end_issues(
    steps: Place, row: dict[str, Any], structure: dict[str, Any], known: list[str], dofs: _Dofs
) -> Iterator[Issue]:
    cyclic = is_cyclic(structure)

    def of_end(place: Place, text: str, end: End) -> Iterator[Issue]:
        key = str(place[-2])
        if end.dof is not None and end.dof not in known:
            yield _unknown_place(place, key, end.dof, known, dofs)
        if end.next and not cyclic:
            yield no_sector(place, key, text)
        elif end.next and row.get("normal") is not None and not _has_axis(structure):
            sentence = (
                f"`{key}`: {text!r} lies in the next sector, which is turned: "
                "give the direction of the axis as `axis` of the structure (matrices: of [structure.cyclic])"
            )
            yield Issue(place, sentence, named=False)

    yield from pair_issues(steps, row.get("between"), of_end)
    spread = row.get("spread")
    for text in map(str, spread if isinstance(spread, dict) else ()):
        yield from of_end((*steps[:-1], "spread", text), text, parse_end(text))


def _has_axis(structure: dict[str, Any]) -> bool:
    joined = structure.get("cyclic")
    table = joined if structure.get("kind") == "matrices" and isinstance(joined, dict) else structure
    return table.get("axis") is not None


def _motion_issues(steps: Place, row: dict[str, Any], cyclic: bool, dofs: _Dofs) -> Iterator[Issue]:
    motions = row.get("motions")
    for i, motion in enumerate(motions if isinstance(motions, list) else []):
        for text in motion if isinstance(motion, dict) else ():
            place, end = (*steps, "motions", i, str(text)), parse_end(str(text))
            if dofs is not None and end.dof not in dofs:
                yield unknown_dof(place, "motions", str(text), str(end.dof), list(dofs))
            elif end.next and not cyclic:
                yield no_sector(place, "motions", str(text))


def _unknown_place(place: Place, key: str, name: str, known: list[str], dofs: _Dofs) -> Issue:
    said = f"there is no body or node {quoted(name)}; known: {listing(known)}{nearest(name, known)}"
    if dofs is not None and name in dofs:
        place_of = "name a body, or a node ([[nodes]] with `at` and `dofs`)"
        said = f"{quoted(name)} is a DOF and has no position: {place_of}"
    return Issue(place, f"`{key}`: {said}", named=False)


def cyclic_issues(raw: dict[str, Any]) -> list[Issue]:
    """Patterns and groups that do not fit, mistuned parts that do not exist, factors too few or not > 0."""
    structure = structure_of(raw)
    found = [*wave_issues(raw, "pattern")]
    found += _group_issues(structure)
    mistuning = structure.get("mistuning")
    if is_cyclic(structure) and isinstance(mistuning, dict):
        found += [
            *_mistuned_issues(structure, mistuning),
            *_factor_issues(mistuning, structure.get("sectors")),
        ]
    return found


def _names(structure: dict[str, Any]) -> list[str]:
    return [row["name"] for _, row in parts_of(structure) if isinstance(row.get("name"), str)]


def _group_issues(structure: dict[str, Any]) -> Iterator[Issue]:
    """Groups named like a part, in a cyclic structure, or of parts of another kind."""
    names, quantities = set(_names(structure)), dict[str, str]()
    for steps, row in parts_of(structure):
        group, quantity = row.get("group"), str(steps[1])
        if not isinstance(group, str):
            continue
        place = (*steps, "group")
        if structure.get("kind") == "cyclic":
            yield Issue(place, f"= {quoted(group)}: a named part of a cyclic structure is a group already")
        elif group in names:
            yield Issue(place, f"= {quoted(group)} is also the name of a part")
        elif quantities.setdefault(group, quantity) != quantity:
            yield Issue(place, f"= {quoted(group)} has {quantities[group]} in it already, and no {quantity}")


def _mistuned_issues(structure: dict[str, Any], mistuning: dict[str, Any]) -> Iterator[Issue]:
    """Names in `of` that are neither a DOF nor the name of a spring, dashpot or mass, or stand twice."""
    if structure.get("kind") == "matrices":
        known, what = _matrix_parts(structure), "part of the matrices"
        hint = "" if known else ": reduce the sector with --mistune"
    else:
        masses = structure.get("masses")
        known = [*_names(structure), *map(str, masses if isinstance(masses, dict) else ())]
        what, hint = "spring, damper, mass or DOF", " (parts need a `name`)"
    of = mistuning.get("of")
    named = of if isinstance(of, list) else []
    for i, name in enumerate(named):
        if not isinstance(name, str):
            continue
        place = ("structure", "mistuning", "of", i)
        if name not in known:
            sentence = (
                f"`of`: there is no {what} {quoted(name)}{hint}; "
                f"known: {listing(known) or 'none'}{nearest(name, known)}"
            )
            yield Issue(place, sentence, named=False)
        elif name in named[:i]:
            yield Issue(place, f"`of` has {name!r} twice: its factor would count twice", named=False)


def _matrix_parts(structure: dict[str, Any]) -> list[str]:
    """What may be mistuned of a sector given by matrices: K, M and its parts, if reduced those kept."""
    reduced, parts = structure.get("diameters"), structure.get("parts")
    if reduced is None:
        return [*WHOLE, *map(str, parts if isinstance(parts, dict | list | tuple) else ())]
    kept = reduced.get("parts") if isinstance(reduced, dict) else getattr(reduced, "parts", None)
    names = kept.names if isinstance(kept, PartsAcross) else kept
    return list(map(str, names if isinstance(names, dict | list | tuple) else ()))


def _factor_issues(mistuning: dict[str, Any], sectors: object) -> Iterator[Issue]:
    """Factors of another number than sectors, or drawn ones that are not above 0."""
    try:
        read = Mistuning.model_validate(mistuning)
    except ValidationError:
        return
    if not isinstance(sectors, int) or isinstance(sectors, bool) or not 1 <= sectors <= 10_000:
        return
    factors = read.factors(sectors)
    if len(factors) != sectors:
        yield Issue(
            ("structure", "mistuning", "values"),
            f"must have one factor for each of the {sectors} sectors",
            len(factors),
        )
    bad = next((j for j, factor in enumerate(factors) if not 0.0 < factor < math.inf), None)
    if bad is not None:
        yield Issue(
            ("structure", "mistuning", "spread"),
            f"= {read.spread:g} gives sector {bad} the factor {factors[bad]:.3g}, which must be > "
            "0: choose a smaller spread or another `seed`",
        )
