"""What of a scene is drawn in space: points, how the DOFs move them, lines and faces between them, contacts.

Nodes, bodies and the outline of a mesh stand where the scene says. Where it tells no places the masses stand
in a row from the ground, or on rings about the axis, a column or ring as far from the ground as there are
springs on the way, and move along the row, or along the axis.
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from itertools import permutations
from typing import Annotated

import numpy as np
from numpy.typing import NDArray

from solver.arrays import Real
from solver.contacts.fields import parse_end
from solver.contacts.frames import cross, unit
from solver.results import units
from solver.scene.bodies.body import Body
from solver.scene.bodies.body_shapes import Cylinder, Wedge
from solver.scene.bodies.kinematics import places, point_motion
from solver.scene.scene import AnyContact, MatricesStructure, Scene

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


_AXES = ((1.0, 0.0, 0.0), (0.0, 1.0, 0.0), (0.0, 0.0, 1.0))
_INNER = 0.35  # radius of the first ring, of that of the last
_CORNERS = 16  # of a circle
_BELOW = 0.7  # a mass, where its contact with the ground is drawn
Vector = tuple[float, float, float]


@dataclass(slots=True)
class Picture:
    """One sector of a disk, or the whole of another structure."""

    to_scale: Annotated[bool, "Whether the scene tells the places."]
    axis: Vector
    points: Annotated[
        list[Sequence[float]], "Places at rest [m]; of unit size where the scene tells none."
    ] = field(default_factory=list)
    names: Annotated[list[str], "Of each point."] = field(default_factory=list)
    roles: Annotated[list[str], "``mesh``, ``node``, ``mass``, ``body``, ``contact`` or ``ground``."] = field(
        default_factory=list
    )
    moves: Annotated[
        list[Sequence[Mapping[str, float]]],
        "For each point and direction the factor of each DOF in its motion.",
    ] = field(default_factory=list)
    edges: Annotated[list[tuple[int, int]], "Numbers of points: the ends of lines."] = field(
        default_factory=list
    )
    ahead: Annotated[list[tuple[int, int]], "Those of lines whose second end is of the next sector."] = field(
        default_factory=list
    )
    faces: Annotated[list[tuple[int, int, int]], "The corners of triangles."] = field(default_factory=list)
    contacts: Annotated[dict[str, int], "Number of the point of each contact that is drawn."] = field(
        default_factory=dict
    )
    notes: Annotated[list[str], "What is not drawn, and why."] = field(default_factory=list)

    def add(self, at: Sequence[float], name: str, role: str, moves: Sequence[Mapping[str, float]]) -> int:
        """Draw a point, and return its number."""
        self.points.append([float(value) for value in at])
        self.names.append(name)
        self.roles.append(role)
        self.moves.append(moves)
        return len(self.points) - 1

    def factors(self, dofs: Sequence[str]) -> Real:
        """Return what each DOF moves each point in each direction, (n_points, 3, n_dofs)."""
        row = {dof: i for i, dof in enumerate(dofs)}
        found = np.zeros((len(self.points), 3, len(dofs)))
        for p, moves in enumerate(self.moves):
            for c, factors in enumerate(moves):
                for dof, factor in factors.items():
                    found[p, c, row[dof]] += factor
        return found


def picture_of(scene: Scene) -> Picture:
    """Return what is drawn of a scene, of a disk one sector."""
    known = places(scene.bodies, scene.nodes)
    outline = getattr(scene.structure, "outline", None)
    to_scale = bool(known) or outline is not None
    picture = Picture(to_scale=to_scale, axis=unit(getattr(scene.structure, "axis", None) or _AXES[2]))
    if outline is not None:
        for at in outline.points.tolist():
            picture.add(at, "", "mesh", ({}, {}, {}))
        picture.edges += [(int(a), int(b)) for a, b in outline.edges]
    parts = parts_of(scene)
    drawn = _placed(scene, picture) if to_scale else _schematic(scene, parts, picture)
    for a, b in parts.springs:
        _line(picture, drawn, a, b)
    for contact in scene.contacts:
        _contact(scene, picture, drawn, contact)
    _say(scene, picture, parts)
    return picture


def _placed(scene: Scene, picture: Picture) -> dict[str, int]:
    """Draw nodes and bodies where they are; return the point of each node."""
    drawn = {
        node.name: picture.add(node.at, node.name, "node", _moved_at(scene, node.name, node.at))
        for node in scene.nodes
    }
    for body in scene.bodies:
        section, depth, axes = _section(scene, body)
        first, n = len(picture.points), len(section)
        for side in (-0.5, 0.5):
            for across, outward in section:
                at = np.array(body.at) + np.array([across, outward, side * depth]) @ axes
                picture.add(at.tolist(), body.name, "body", _moved_at(scene, body.name, at.tolist()))
        for i in range(n):
            j = (i + 1) % n
            a, b, c, d = first + i, first + j, first + n + j, first + n + i
            picture.edges += [(a, b), (c, d), (a, d)] if n < _CORNERS else [(a, b), (c, d)]
            picture.faces += [(a, b, c), (a, c, d)]
        for cap in (first, first + n):
            picture.faces += [(cap, cap + i, cap + i + 1) for i in range(1, n - 1)]
    return drawn


def _moved_at(scene: Scene, name: str, at: Sequence[float]) -> list[dict[str, float]]:
    """The motion of a point that a node or body carries along, by its DOFs, in each direction."""
    place = places(scene.bodies, scene.nodes)[name]
    return [dict(point_motion(place, at, direction)) for direction in _AXES]


def _section(scene: Scene, body: Body) -> tuple[list[tuple[float, float]], float, NDArray[np.float64]]:
    """The outline of a body across its axis, its depth [m], and the directions across, outward and axial.

    A body without a shape is the cuboid that has its mass and its moments of inertia.
    """
    shape = next((each for each in scene.dampers if each.name == body.name), None)
    if shape is None:
        axes = np.linalg.eigh(body.tensor)[1].T if body.plane is None else np.eye(3)
    else:
        out, axial = unit(shape.out), unit(shape.axial)
        axes = np.array([cross(out, axial), out, axial])
    moments = np.einsum("ij,jk,ik->i", axes, body.tensor, axes)
    sides = np.sqrt(6.0 * np.maximum(moments.sum() - 2.0 * moments, 0.0) / body.mass)
    wide, high, deep = np.maximum(sides, 0.05 * sides.max()).tolist()
    if isinstance(shape, Cylinder):
        turns = (2.0 * math.pi * i / _CORNERS for i in range(_CORNERS))
        circle = [(shape.radius * math.cos(t), shape.radius * math.sin(t)) for t in turns]
        return circle, shape.length or 2.0 * shape.radius, axes
    if isinstance(shape, Wedge):
        half = 0.5 * shape.length * math.cos(shape.angle)
        rise = 0.5 * shape.length * math.sin(shape.angle)
        inner, outer = max(0.5 * shape.width - half, 0.0), 0.5 * shape.width + half
        upper = [(-outer, -rise), (-inner, rise), (inner, rise), (outer, -rise)]
        return [*upper, (outer, -rise - high), (-outer, -rise - high)], deep, axes
    corners = [(-1, -1), (1, -1), (1, 1), (-1, 1)]
    return [(0.5 * wide * x, 0.5 * high * y) for x, y in corners], deep, axes


def _schematic(scene: Scene, parts: Parts, picture: Picture) -> dict[str, int]:
    """Draw masses in a row from the ground, or on rings; return the point of each."""
    found = {name: at for name, at in places_of(parts).items() if not name.endswith(NEXT)}
    columns = sorted({round(x - 1e-9) for x, _ in found.values()})
    drawn: dict[str, int] = {}
    for name, (x, y) in found.items():
        if parts.disk:
            ring = columns.index(round(x - 1e-9)) / max(len(columns) - 1, 1)
            beside = sum(found[other][0] == x for other in drawn)
            angle = 2.0 * math.pi / scene.structure.sector_count * 0.3 * beside
            radius = _INNER + (1.0 - _INNER) * (ring if len(columns) > 1 else 1.0)
            at: Sequence[float] = (radius * math.cos(angle), radius * math.sin(angle), 0.0)
        else:
            at = (x, y, 0.0)
        along = 2 if parts.disk else 0
        moves: list[dict[str, float]] = [{}, {}, {}]
        for dof in parts.dofs.get(name, ()):
            component = dof.rpartition(".")[2]
            moves["xyz".index(component) if component in ("x", "y", "z") else along][dof] = 1.0
        drawn[name] = picture.add(at, name, "mass", moves)
    held = [y for name, (_, y) in found.items() if any({GROUND, name} == {*pair} for pair in parts.springs)]
    if not parts.disk and held:
        drawn[GROUND] = picture.add((0.0, sum(held) / len(held), 0.0), GROUND, "ground", ({}, {}, {}))
    return drawn


def _line(picture: Picture, drawn: Mapping[str, int], a: str, b: str) -> None:
    """Draw a spring, or what joins a contact to its ends, where both ends are drawn."""
    if a.endswith(NEXT):
        a, b = b, a
    first, second = drawn.get(a), drawn.get(b.removesuffix(NEXT))
    if first is not None and second is not None:
        (picture.ahead if b.endswith(NEXT) else picture.edges).append((first, second))


def _contact(scene: Scene, picture: Picture, drawn: Mapping[str, int], contact: AnyContact) -> None:
    """Draw a contact where it is, or half way between its ends; it goes along with its first own end."""
    groups = {dof: node.name for node in scene.nodes for _, dof in node.dofs}
    ends = [parse_end(end) for end in contact.between]
    own = next((end.dof for end in ends if end.dof is not None and not end.next), None)
    if own is None:
        return
    name = groups.get(own, own if own in drawn else own.partition(".")[0])
    if contact.at is not None and name in places(scene.bodies, scene.nodes):
        number = picture.add(contact.at, contact.name, "contact", _moved_at(scene, name, contact.at))
    elif name in drawn:
        spots = list(_spots(scene, picture, drawn, contact, groups))
        at = np.mean(spots, axis=0) if len(spots) > 1 else spots[0] - np.array([0.0, _BELOW, 0.0])
        if picture.to_scale and len(spots) == 1:
            at = spots[0]
        number = picture.add(at.tolist(), contact.name, "contact", picture.moves[drawn[name]])
    else:
        return
    picture.contacts[contact.name] = number
    if name in drawn:
        picture.edges.append((drawn[name], number))


def _spots(
    scene: Scene, picture: Picture, drawn: Mapping[str, int], contact: AnyContact, groups: Mapping[str, str]
) -> Iterator[NDArray[np.float64]]:
    """Where the ends of a contact are; the ground is nowhere."""
    pitch = 2.0 * math.pi / scene.structure.sector_count
    for end in map(parse_end, contact.between):
        if end.dof is None:
            continue
        name = groups.get(end.dof, end.dof if end.dof in drawn else end.dof.partition(".")[0])
        if name in drawn:
            at = np.array(picture.points[drawn[name]])
            yield turned(at, picture.axis, pitch) if end.next else at


def turned(vectors: NDArray[np.float64], axis: Sequence[float], angle: float) -> NDArray[np.float64]:
    """Return vectors (…, 3) turned about a unit vector by an angle [rad] (Rodrigues)."""
    k = np.array(axis)
    along = vectors @ k
    across = np.cross(np.broadcast_to(k, vectors.shape), vectors)
    return np.asarray(
        vectors * math.cos(angle) + across * math.sin(angle) + along[..., None] * k * (1.0 - math.cos(angle))
    )


def _say(scene: Scene, picture: Picture, parts: Parts) -> None:
    """Say what is not drawn."""
    if not picture.to_scale:
        way = "along the axis" if parts.disk else "along the row"
        rest = (
            "" if all(set(dofs) == {name} for name, dofs in parts.dofs.items()) else " unless their name says"
        )
        picture.notes.append(
            f"The scene tells no places: its parts are drawn by their connections, and move {way}{rest}."
        )
        return
    moving = {dof for moves in picture.moves for factors in moves for dof in factors}
    left = [dof for dof in scene.dofs if dof not in moving and not dof.startswith(COORDINATE)]
    if left and not mesh_moves(scene):
        listed = ", ".join(left[:6]) + (f" and {len(left) - 6} more" if len(left) > 6 else "")
        picture.notes.append(f"Without a place, so not drawn: {listed}.")
    if "mesh" in picture.roles and not mesh_moves(scene):
        picture.notes.append(
            "The mesh is drawn at rest: its file tells the motion of the nodes named alone. `stickslip "
            "import --nodes …` writes one that tells all."
        )
    undrawn = [contact.name for contact in scene.contacts if contact.name not in picture.contacts]
    if undrawn:
        picture.notes.append(f"Contacts without a place: {', '.join(undrawn)}.")


def mesh_moves(scene: Scene) -> bool:
    """Return whether the motion of the points of a scene's mesh, the first ones of its picture, is known."""
    structure = scene.structure
    if not isinstance(structure, MatricesStructure) or structure.outline is None:
        return False
    if structure.diameters is not None:
        return structure.diameters.motion is not None
    return len(structure.outline.moved) > 0


COORDINATE = "coordinate "
"""Before the number of one that has no name of its own."""
