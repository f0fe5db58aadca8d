"""What is wrong with mistuning, wave patterns and groups, on the plain tables and lists of a scene."""

from __future__ import annotations

import math
from collections.abc import Iterator
from typing import Any

from pydantic import ValidationError

from solver.errors import Issue
from solver.matrices.sectors.sector_parts import WHOLE, PartsAcross
from solver.scene.cyclic.sector_tables import is_cyclic
from solver.scene.scene_records import Mistuning
from solver.scene.validation import parts_of, structure_of, wave_issues
from solver.wording import listing, nearest, quoted


def cyclic_issues(raw: dict[str, Any]) -> list[Issue]:
    """Patterns and groups that do not fit, mistuned parts that do not exist, factors too few or not > 0."""
    structure = structure_of(raw)
    found = [*wave_issues(raw, "pattern")]
    found += _group_issues(structure)
    mistuning = structure.get("mistuning")
    if is_cyclic(structure) and isinstance(mistuning, dict):
        found += [*_name_issues(structure, mistuning), *_factor_issues(mistuning, structure.get("sectors"))]
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


def _name_issues(structure: dict[str, Any], mistuning: dict[str, Any]) -> Iterator[Issue]:
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
