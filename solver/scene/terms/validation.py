"""What is wrong with couplings, aerodynamics and the speed they need, on the plain tables of a scene."""

from __future__ import annotations

from collections.abc import Iterator
from itertools import islice
from typing import Any

from solver.errors import Issue
from solver.scene.cyclic.sector_tables import is_cyclic
from solver.scene.terms.excitation import PLACES
from solver.scene.validation import MOST_ISSUES, dofs_of, duplicates, pointer_of, rows_of, unknown_dof

AMPLITUDE_PATH = "excitation.amplitude"
_TURNING = ("gyroscopic", "k_omega2")


def term_issues(raw: dict[str, Any]) -> list[Issue]:
    """Unknown DOFs, sectors where there are none, names taken twice, a speed that is missing."""
    structure = raw.get("structure")
    structure = structure if isinstance(structure, dict) else {}
    return list(islice(_issues(raw, structure), MOST_ISSUES))


def _issues(raw: dict[str, Any], structure: dict[str, Any]) -> Iterator[Issue]:
    dofs, cyclic = dofs_of(raw), is_cyclic(structure)
    for steps, row in rows_of(raw, "couplings"):
        yield from _places(steps, row, ("on", "of"), dofs)
        if row.get("offset") and not cyclic:
            message = f"`offset` = {row['offset']!r} needs a cyclic structure; this one has no other sectors"
            yield Issue(pointer=pointer_of([*steps, "offset"]), message=message)
        for key in _TURNING:
            if row.get(key) and not _has_speed(raw):
                yield _needs_speed([*steps, key], key)
    for key in ("G", "K_omega2"):
        if structure.get(key) is not None and not _has_speed(raw):
            yield _needs_speed(["structure", key], key)
    for steps, row in rows_of(raw, "excitation"):
        for key in PLACES[1:]:
            keys = tuple(row[key]) if isinstance(row.get(key), dict) else ()
            yield from _places([*steps, key], dict(zip(keys, keys, strict=True)), keys, dofs)
    yield from _base_issues(raw, cyclic)
    yield from _speed_issues(raw)
    yield from _recovery_issues(raw, dofs)
    for steps, row in rows_of(raw, "aerodynamics"):
        yield from _places(steps, row, ("dof",), dofs)
        if not cyclic:
            message = "`aerodynamics` acts between the blades of a cyclic structure; this one has no sectors"
            yield Issue(pointer=pointer_of(steps), message=message)
    tables = ("aerodynamics", "bodies", "nodes", "loads", "dampers", "contacts")
    rows = [row for table in tables for row in rows_of(raw, table)]
    named = [([*steps, "name"], row["name"]) for steps, row in rows if isinstance(row.get("name"), str)]
    mine = [row.get("name") for _, row in rows_of(raw, "aerodynamics")]
    yield from duplicates([(s, name) for s, name in reversed(named) if name in mine], "paths")


def _base_issues(raw: dict[str, Any], cyclic: bool) -> Iterator[Issue]:
    """Bases of two kinds, of a disk, or a relative motion without any."""
    first: str | None = None
    for steps, row in rows_of(raw, "excitation"):
        given = [key for key in ("ground", "driven") if row.get(key) is not None]
        if not given:
            continue
        pointer = pointer_of([*steps, given[0]])
        if cyclic:
            yield Issue(
                pointer=pointer, message=f"`{given[0]}` moves a base, which a cyclic structure has not"
            )
        first = first or given[0]
        if given[0] != first:
            message = f"`{given[0]}` beside `{first}`: the ground moves or DOFs are driven, not both"
            yield Issue(pointer=pointer, message=message)
    for steps, row in rows_of(raw, "observe"):
        if row.get("relative") and first is None:
            message = "`relative` = true needs a base that moves (`ground` or `driven` of the excitation)"
            yield Issue(pointer=pointer_of([*steps, "relative"]), message=message)


def _places(
    steps: list[int | str], row: dict[str, Any], keys: tuple[str, ...], dofs: dict[str, None] | None
) -> Iterator[Issue]:
    for key in keys:
        dof = row.get(key)
        if isinstance(dof, str) and dofs is not None and dof not in dofs:
            yield Issue(pointer=pointer_of([*steps, key]), message=unknown_dof(key, dof, dof, list(dofs)))


def _has_speed(raw: dict[str, Any]) -> bool:
    return raw.get("speed") is not None or raw.get("speed_order") is not None


def _speed_issues(raw: dict[str, Any]) -> Iterator[Issue]:
    """A speed given twice, and what follows it but cannot."""
    if raw.get("speed") is not None and raw.get("speed_order") is not None:
        message = "`speed_order` stands in place of `speed`: the speed follows the frequency; remove one"
        yield Issue(pointer="/speed_order", message=message)
    named = [row.get(key) for _, row in rows_of(raw, "contacts") for key in ("name", "group")]
    contacts = dict.fromkeys(name for name in named if isinstance(name, str))
    seen: list[object] = []
    for steps, row in rows_of(raw, "with_speed"):
        path, pointer = row.get("path"), pointer_of([*steps, "path"])
        if not isinstance(path, str):
            continue
        owner, _, key = path.rpartition(".")
        if path != AMPLITUDE_PATH and not (key == "N0" and owner in contacts):
            known = ", ".join(f"{name}.N0" for name in contacts)
            message = f"`path` must be `{AMPLITUDE_PATH}` or one of {known or 'no contact'}, got {path!r}"
            yield Issue(pointer=pointer, message=message)
        elif path in seen:
            yield Issue(pointer=pointer, message=f"`path` = {path!r} follows the speed twice")
        seen.append(path)
        if not _has_speed(raw):
            yield Issue(pointer=pointer, message=f"{path!r} needs the `speed` of the scene, or `speed_order`")
        forces = [each for _, each in rows_of(raw, "excitation")]
        if path == AMPLITUDE_PATH and any(not each.get("amplitude") for each in forces[:1]):
            message = "`amplitude` of the first excitation must not be 0: the others are in proportion to it"
            yield Issue(pointer=pointer, message=message)
    turning = any(row.get("radius_of_rotation") for _, row in rows_of(raw, "bodies"))
    if raw.get("speed_order") is not None and turning and any(rows_of(raw, "loads")):
        message = "`speed_order` cannot go with [[loads]] beside bodies that the speed loads"
        yield Issue(pointer="/speed_order", message=message)


def _recovery_issues(raw: dict[str, Any], dofs: dict[str, None] | None) -> Iterator[Issue]:
    """Recovered quantities of DOFs that do not exist, or with a name that is taken."""
    rows = list(rows_of(raw, "recovery"))
    named = [([*steps, "name"], row["name"]) for steps, row in rows if isinstance(row.get("name"), str)]
    yield from duplicates(named, "recovery")
    for steps, row in rows if dofs is not None else ():
        terms = row.get("terms")
        for dof in terms if isinstance(terms, dict) else ():
            if dof not in (dofs or ()):
                message = unknown_dof("terms", dof, dof, list(dofs or ()))
                yield Issue(pointer=pointer_of([*steps, "terms", dof]), message=message)
        if row.get("name") in list(dofs or ()):
            message = f"`name` = {row['name']!r} is that of a DOF: give what is recovered another name"
            yield Issue(pointer=pointer_of([*steps, "name"]), message=message)


def _needs_speed(steps: list[int | str], key: str) -> Issue:
    message = f"`{key}` needs the `speed` of rotation [1/min] of the scene"
    return Issue(pointer=pointer_of(steps), message=message)
