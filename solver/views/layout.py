"""What a scene consists of, and where its parts stand in a drawing of connections, not of places.

A column is as far from the ground as there are springs on the way; the neighbour of a sector stands above it.
What moves as one node or body is one part.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from itertools import permutations

from solver.results import units
from solver.scene.scene import Scene

GROUND = "ground"
NEXT = "@next"
_GAP = 1.5  # between a sector and its neighbour, in rows
_FEW = 5  # columns that stand wide apart
_MOST_ORDERED = 6  # names of a column whose orders are all looked at
Place = tuple[float, float]
Pair = tuple[str, str]


@dataclass(frozen=True, slots=True, kw_only=True)
class Parts:
    """What is drawn: parts by name, the DOFs of each, and the pairs that springs and contacts join."""

    names: tuple[str, ...]
    dofs: Mapping[str, tuple[str, ...]]
    springs: tuple[Pair, ...]
    contacts: Mapping[Pair, tuple[str, ...]]
    forced: Mapping[str, str]
    observed: str
    disk: bool


def parts_of(scene: Scene) -> Parts:
    """Nodes and bodies stand for their DOFs; of a structure of matrices those that are named elsewhere."""
    groups = {dof: node.name for node in scene.nodes for _, dof in node.dofs}

    def part(end: str) -> str:
        name, sign, rest = end.partition("@")
        group = groups.get(name, name.partition(".")[0])
        return f"{group}{NEXT}" if sign and rest == "next" else group

    springs = [spring.between for spring in getattr(scene.structure, "springs", ())]
    contacts: dict[Pair, tuple[str, ...]] = {}
    for contact in scene.contacts:
        pair = (part(contact.between[0]), part(contact.between[1]))
        contacts[pair] = (*contacts.get(pair, ()), contact.name)
    forced: dict[str, str] = {}
    for force in scene.excitation:
        dofs = [dof for dof, *_ in (force.base.shares if force.base else force.parts)]
        forced |= {part(dof): f"{units.number(force.amplitude, 4)} {force.unit}" for dof in dofs}
    observed = part(scene.observe.dof)
    named = [*(end for pair in contacts for end in pair), *forced, observed]
    if scene.structure.kind != "matrices":
        named = [*(part(dof) for dof in scene.dofs), *named]
    names = dict.fromkeys(name.removesuffix(NEXT) for name in named)
    names.pop(GROUND, None)
    members: dict[str, tuple[str, ...]] = {}
    for dof in scene.dofs:
        members[part(dof)] = (*members.get(part(dof), ()), dof)
    return Parts(
        names=tuple(names),
        dofs=members,
        springs=tuple(dict.fromkeys((part(a), part(b)) for a, b in springs if part(a) != part(b))),
        contacts=contacts,
        forced=forced,
        observed=observed,
        disk=scene.structure.has_sectors,
    )


def layers_of(parts: Parts) -> dict[str, int]:
    """How many springs are between each circle and the ground; what only contacts hold comes after those."""
    layers = {GROUND: 0}
    if not parts.springs:
        # Matrices tell no chains: one column for each name.
        return layers | {name: i for i, name in enumerate(parts.names, start=1)}
    for pairs in (parts.springs, (*parts.springs, *parts.contacts)):
        _spread(layers, pairs)
    for name in parts.names:
        layers.setdefault(name, 1 + max(layers.values()))
    return layers


def _spread(layers: dict[str, int], pairs: Iterable[Pair]) -> None:
    joined = [(a.removesuffix(NEXT), b.removesuffix(NEXT)) for a, b in pairs]
    while True:
        found: dict[str, int] = {}
        for a, b in (*joined, *((b, a) for a, b in joined)):
            if a in layers and b not in layers:
                found[b] = min(found.get(b, layers[a] + 1), layers[a] + 1)
        if not found:
            return
        layers |= found


def places_of(parts: Parts) -> dict[str, Place]:
    """Columns by layer; the neighbour of a sector stands above it."""
    layers = layers_of(parts)
    columns: dict[int, list[str]] = {}
    for name in parts.names:
        columns.setdefault(layers[name], []).append(name)
    joins = (*parts.springs, *parts.contacts)
    doubled = parts.disk and any(end.endswith(NEXT) for pair in joins for end in pair)
    highest = max(len(column) for column in columns.values())
    up = highest - 1 + _GAP
    step = 1.6 if max(columns) <= _FEW else 1.2
    places: dict[str, Place] = {}
    for layer, column in sorted(columns.items()):
        low = 0.5 * (highest - len(column))
        # Beside a neighbour above it a column leans: what joins the two passes between its circles.
        lean = 0.5 if doubled else 0.0
        for i, name in enumerate(_ordered(column, places, low, joins)):
            places[name] = (step * layer + lean * i, low + i)
    if doubled:
        places |= {f"{name}{NEXT}": (x, y + up) for name, (x, y) in places.items()}
    return places


def _ordered(
    column: Sequence[str], places: Mapping[str, Place], low: float, joins: Sequence[Pair]
) -> Sequence[str]:
    """The order of a column in which what is joined is nearest, so that little crosses a circle."""
    if len(column) > _MOST_ORDERED:
        return column

    def spread(order: Sequence[str]) -> float:
        at = {name: low + i for i, name in enumerate(order)} | {name: y for name, (_, y) in places.items()}
        return sum((at[a] - at[b]) ** 2 for a, b in joins if a in at and b in at)

    return min(permutations(column), key=spread)
