"""What is wrong with couplings, aerodynamics and the speed they need, on the plain tables of a scene."""

from __future__ import annotations

from collections.abc import Iterator
from itertools import islice
from typing import Any

from solver.errors import Issue
from solver.scene.validation import MOST_ISSUES, dofs_of, duplicates, pointer_of, rows_of, unknown_dof

_TURNING = ("gyroscopic", "k_omega2")


def term_issues(raw: dict[str, Any]) -> list[Issue]:
    """Unknown DOFs, sectors where there are none, names taken twice, a speed that is missing."""
    structure = raw.get("structure")
    structure = structure if isinstance(structure, dict) else {}
    return list(islice(_issues(raw, structure), MOST_ISSUES))


def _issues(raw: dict[str, Any], structure: dict[str, Any]) -> Iterator[Issue]:
    dofs, cyclic = dofs_of(raw), structure.get("kind") == "cyclic"
    for steps, row in rows_of(raw, "couplings"):
        yield from _places(steps, row, ("on", "of"), dofs)
        if row.get("offset") and not cyclic:
            message = f"`offset` = {row['offset']!r} needs a cyclic structure; this one has no other sectors"
            yield Issue(pointer=pointer_of([*steps, "offset"]), message=message)
        for key in _TURNING:
            if row.get(key) and raw.get("speed") is None:
                yield _needs_speed([*steps, key], key)
    for key in ("G", "K_omega2"):
        if structure.get(key) is not None and raw.get("speed") is None:
            yield _needs_speed(["structure", key], key)
    for steps, row in rows_of(raw, "aerodynamics"):
        yield from _places(steps, row, ("dof",), dofs)
        if not cyclic:
            message = "`aerodynamics` acts between the blades of a cyclic structure; this one has no sectors"
            yield Issue(pointer=pointer_of(steps), message=message)
    tables = ("aerodynamics", "bodies", "nodes", "loads", "dampers", "contacts")
    rows = [row for table in tables for row in rows_of(raw, table)]
    named = [([*steps, "name"], row["name"]) for steps, row in rows if isinstance(row.get("name"), str)]
    mine = {row.get("name") for _, row in rows_of(raw, "aerodynamics")}
    yield from duplicates([(s, name) for s, name in reversed(named) if name in mine], "paths")


def _places(
    steps: list[int | str], row: dict[str, Any], keys: tuple[str, ...], dofs: dict[str, None] | None
) -> Iterator[Issue]:
    for key in keys:
        dof = row.get(key)
        if isinstance(dof, str) and dofs is not None and dof not in dofs:
            yield Issue(pointer=pointer_of([*steps, key]), message=unknown_dof(key, dof, dof, list(dofs)))


def _needs_speed(steps: list[int | str], key: str) -> Issue:
    message = f"`{key}` needs the `speed` of rotation [1/min] of the scene"
    return Issue(pointer=pointer_of(steps), message=message)
