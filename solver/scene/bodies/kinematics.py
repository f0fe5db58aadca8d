"""The relative motions of contacts as linear forms of the degrees of freedom.

At a point p a place with position a, displacement q and small rotation θ moves by d = q + θ × (p − a). Of a
contact with the direction e, u = e · (d_first − d_second), so

    u = Σ_i e_i q_i + ((p − a) × e)_i θ_i

over the first end less the same over the second. What lies in the next sector of a disk moves in axes that
are turned with it: its position, displacement and rotation are Rot(α) times those written down, and e · Rot q
= (Rotᵀ e) · q, so its form is that of the point and direction turned back. Time marching and the balance
take these forms from here.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from functools import lru_cache
from typing import TYPE_CHECKING, Any, NamedTuple, cast

from solver.contacts.fields import NEXT, Between, Vector, parse_end
from solver.contacts.frames import Axes, cross, unit
from solver.contacts.laws.contact_law import AnyContact
from solver.scene.bodies.body import REVOLUTIONS, Body, Load, Node, Place
from solver.scene.scene_parameter import Forces, Term
from solver.scene.scene_parameter import Form as Form
from solver.scene.scene_records import Excitation, LumpedStructure

if TYPE_CHECKING:
    from solver.scene.scene import Scene


def forms_of(scene: Scene, contact: AnyContact) -> tuple[Form, ...]:
    """The relative motions of a contact that is not between DOFs, in the order its law has them."""
    if contact.motions is not None:
        return tuple(_written(motion) for motion in contact.motions)
    axes, at = cast(Axes, contact.axes), cast(Vector, contact.at)
    directions = tuple(axes[which] for which in contact.directions)
    return placed_forms(scene, contact.between, at, directions, contact.spread)


def placed_forms(
    scene: Scene, between: Between, at: Sequence[Any], directions: Sequence[Sequence[Any]],
    spread: tuple[tuple[str, float], ...] | None = None,
) -> tuple[Form, ...]:  # fmt: skip
    """The motions of the first end against the second, or against a weighted sum of ends, at a point.

    Point and directions may be symbols: the factors are then expressions in them.
    """
    against = ((between[1], 1.0),) if spread is None else spread
    ends = [(_end(scene, text), share) for text, share in ((between[0], -1.0), *against)]
    return tuple(
        _collected(
            [
                Term(dof, ahead, -share * factor)
                for (place, turn, ahead), share in ends
                if place is not None
                for dof, factor in point_motion(place, _turned_back(at, turn), _turned_back(direction, turn))
            ]
        )
        for direction in directions
    )


class _Turn(NamedTuple):
    """A rotation by an angle [rad] about an axis."""

    axis: Vector
    angle: float


class _Located(NamedTuple):
    """An end of a contact: where it is written down, and how far its sector is turned."""

    place: Place | None
    turn: _Turn
    next: bool


_STILL = _Turn((0.0, 0.0, 1.0), 0.0)


def _turned_back(vector: Sequence[Any], turn: _Turn) -> Sequence[Any]:
    """A vector turned back about an axis (Rodrigues)."""
    if turn.angle == 0.0:
        return vector
    k, c, s = turn.axis, math.cos(turn.angle), -math.sin(turn.angle)
    along = (k[0] * vector[0] + k[1] * vector[1] + k[2] * vector[2]) * (1.0 - c)
    across = cross(k, (vector[0], vector[1], vector[2]))
    return tuple(c * vector[i] + s * across[i] + along * k[i] for i in range(3))


def _end(scene: Scene, text: str) -> _Located:
    end = parse_end(text)
    if end.dof is None:
        return _Located(None, _STILL, False)
    place = places(scene.bodies, scene.nodes)[end.dof]
    structure = scene.structure
    if not end.next or isinstance(structure, LumpedStructure) or structure.axis is None:
        return _Located(place, _STILL, end.next)
    return _Located(place, _Turn(unit(structure.axis), 2.0 * math.pi / structure.sector_count), True)


@lru_cache(maxsize=64)
def places(bodies: tuple[Body, ...], nodes: tuple[Node, ...]) -> dict[str, Place]:
    """Bodies and nodes by their names."""
    return {body.name: body.place for body in bodies} | {node.name: node.place for node in nodes}


def point_motion(place: Place, at: Sequence[Any], direction: Sequence[Any]) -> list[tuple[str, Any]]:
    """Factor of each DOF of a place in the motion of the point `at` along `direction`."""
    e = (direction[0], direction[1], direction[2])
    arm = (at[0] - place.at[0], at[1] - place.at[1], at[2] - place.at[2])
    moments = cross(arm, e)
    factors = dict(zip(("x", "y", "z", "rx", "ry", "rz"), (*e, *moments), strict=True))
    return [(dof, factors[component]) for component, dof in place.dofs]


def _collected(terms: list[Term]) -> Form:
    """One term for each DOF, without those whose factor is 0."""
    found: dict[tuple[str, bool], Any] = {}
    for dof, ahead, factor in terms:
        found[dof, ahead] = found[dof, ahead] + factor if (dof, ahead) in found else factor
    return tuple(
        Term(dof, ahead, factor)
        for (dof, ahead), factor in found.items()
        if not (isinstance(factor, float) and factor == 0.0)
    )


@lru_cache(maxsize=4096)
def pair_form(between: Between) -> Form:
    """x(first) - x(second) of two DOFs; one of them may be the ground."""
    ends = zip(map(parse_end, between), (1.0, -1.0), strict=True)
    return tuple(Term(end.dof, end.next, sign) for end, sign in ends if end.dof is not None)


@lru_cache(maxsize=4096)
def _written(motion: tuple[tuple[str, float], ...]) -> Form:
    ends = [(parse_end(text), factor) for text, factor in motion]
    return tuple(Term(end.dof, end.next, factor) for end, factor in ends if end.dof is not None)


def written_form(form: Form) -> tuple[tuple[str, float], ...]:
    """A form as a scene's `motions` write it."""
    return tuple((f"{t.dof}@{NEXT}" if t.next else t.dof, t.factor) for t in form)


def static_forces(scene: Scene) -> tuple[Excitation, ...]:
    """The constant forces of loads and of rotation as forces on DOFs; along a line those at 1 rad/s."""
    found = [part for load in scene.loads for part in towards(scene, load, load.force)]
    for body in scene.bodies:
        found += outward(body, body.mass * (body.radius_of_rotation or 0.0) * spin_of(scene) ** 2)
    return static(tuple(found))


def spin_of(scene: Scene) -> float:
    """Speed of rotation [rad/s]; 1 along a line, where it follows the frequency."""
    return (scene.speed or 0.0) * REVOLUTIONS if scene.speed_order is None else 1.0


def static(parts: Forces) -> tuple[Excitation, ...]:
    """Constant forces on DOFs."""
    return tuple(Excitation(dof=dof, amplitude=force, harmonic=0) for dof, force in parts)


def towards(scene: Scene, load: Load, force: float) -> list[tuple[str, float]]:
    """A force where a load acts, by DOFs."""
    if load.dof is not None:
        return [(load.dof, force)]
    if load.on is None or load.direction is None:
        return []
    return _along(places(scene.bodies, scene.nodes)[load.on], load.direction, force)


def outward(body: Body, force: float) -> list[tuple[str, float]]:
    """A force on a body away from the axis of rotation, by DOFs."""
    return [] if body.out is None or force == 0.0 else _along(body.place, body.out, force)


def _along(place: Place, direction: Vector, force: float) -> list[tuple[str, float]]:
    """The components of a force at a place, those along which it moves."""
    parts = dict(zip(("x", "y", "z"), unit(direction), strict=True))
    return [(dof, force * parts[c]) for c, dof in place.dofs if parts.get(c, 0.0) != 0.0]
