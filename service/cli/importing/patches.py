"""`stickslip import --patch`: faces of a mesh that lie on each other become contacts."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING, Any

from service.cli.importing.import_files import split
from service.errors import InputError
from solver.results import units

if TYPE_CHECKING:
    from solver.matrices.decks.deck import Deck
    from solver.matrices.load_set import MatrixSet

GROUND = "ground"
_Touched = tuple[int, Mapping[int, float], Any, Any]
"""A node, what it touches with weights, its place and its area."""
_NEXT = "@next"
_AXES = {"x": (1.0, 0.0, 0.0), "y": (0.0, 1.0, 0.0), "z": (0.0, 0.0, 1.0)}


class Patches:
    """The patches of a model, each two sets of nodes that lie on each other.

    Parameters
    ----------
    texts : such as ``shroud=AHEAD:BEHIND@next,normal=y,kt=1e7,kn=2e7,mu=0.3,N0=100``.
    deck : positions and sets, or None.
    units : of the deck.
    turn : sectors and axis of a disk, for faces that touch the next sector.
    tolerance : distance within which nodes touch, in the units of the deck.

    Raises
    ------
    InputError
        Texts that are none, sets that are not there or nodes that do not lie on each other.
    """

    def __init__(
        self, texts: Sequence[str] | None, deck: Deck | None, units: str,
        turn: tuple[int, Sequence[float]] | None, tolerance: float | None,
    ) -> None:  # fmt: skip
        from solver.matrices.values import METRES

        self._dampers: list[dict[str, Any]] = []
        self._nodes: dict[int, tuple[float, float, float]] = {}
        self._turn = turn
        self._tolerance, self._metres = tolerance, METRES[units]
        if not texts:
            return
        if deck is None:
            raise InputError(
                "`--patch` needs --nodes DECK, the deck with the positions and the sets of nodes"
            )
        self._deck = deck
        for text in texts:
            self._add(text)

    def _add(self, text: str) -> None:
        example = "shroud=AHEAD:BEHIND,normal=y,kt=1e7,kn=2e7,mu=0.3,N0=100"
        name, ends, values = split("--patch", text, example)
        first, second = (self._members(name, end.removesuffix(_NEXT)) for end in ends)
        ahead = [end.endswith(_NEXT) for end in ends]
        if first is None or ahead[0]:
            raise InputError(f"`--patch` {name!r}: the first face must be a set of nodes, got {ends[0]!r}")
        if ahead[1] and self._turn is None:
            raise InputError(f"`--patch` {name!r}: {ends[1]!r} lies in the next sector: give --sectors N")
        given, pairing = values.pop("normal", None), values.pop("pairing", "nodes")
        if pairing not in ("nodes", "mortar"):
            raise InputError(f"`--patch` {name!r}: `pairing` must be nodes or mortar, got {pairing!r}")
        sector = _NEXT if ahead[1] else ""
        try:
            normal, touched = self._touched(name, given, (first, second), self._turned(sector), pairing)
        except ValueError as error:
            raise InputError(f"`--patch` {name!r}: {error}") from error
        pairs = [self._point(*one, sector) for one in touched]
        law = values.pop("law", "coulomb-3d")
        self._dampers.append(
            {"name": name, "shape": "patch", "law": law, "normal": normal, **values, "pairs": pairs}
        )

    def _members(self, name: str, end: str) -> list[int] | None:
        if end == GROUND:
            return None
        found = self._deck.sets.get(end.strip('"').upper())
        if found is None:
            known = ", ".join(sorted(self._deck.sets)) or "none"
            raise InputError(f"`--patch` {name!r}: the deck has no set {end!r}; it has {known}")
        return list(dict.fromkeys(found))

    def _turned(self, sector: str) -> Any:
        """The rotation to where a face touches; None where that is here."""
        from solver.matrices.sectors.elimination import rotation

        if not sector or self._turn is None:
            return None
        sectors, axis = self._turn
        return rotation(axis, 2.0 * math.pi / sectors)

    def _touched(
        self, name: str, given: object, faces: tuple[list[int], list[int] | None], turn: Any, pairing: object
    ) -> tuple[list[float], list[_Touched]]:
        """The normal, and each node of the first face with what it touches of the second."""
        from solver.matrices.mortar import face, mortar

        first, second = faces
        if pairing == "mortar" and second is not None:
            normal = self._normal(name, given, None)
            found = mortar(self._deck, first, second, normal, turn)
            return normal, [*zip(found.nodes, found.weights, found.places, found.areas, strict=True)]
        lying = face(self._deck, first, second, turn, self._tolerance)
        touched: list[_Touched] = [
            (node, {} if other is None else {other: 1.0}, place, area)
            for (node, other), place, area in zip(lying.pairs, lying.places, lying.areas, strict=True)
        ]
        return self._normal(name, given, lying.plane), touched

    def _point(
        self, node: int, touched: Mapping[int, float], place: Sequence[float], area: float, sector: str
    ) -> dict[str, Any]:
        """A point of a patch: a node, what it touches, where it is and its area."""
        for one in (node, *touched):
            self._nodes[one] = self._deck.nodes[one]
        heaviest = max(touched, key=lambda other: touched[other], default=None)
        end = GROUND if heaviest is None else f"n{heaviest}{sector}"
        found: dict[str, Any] = {
            "between": [f"n{node}", end], "at": [float(value) * self._metres for value in place],
            "area": float(area) * self._metres**2,
        }  # fmt: skip
        if len(touched) > 1:
            found["spread"] = {f"n{other}{sector}": weight for other, weight in touched.items()}
        return found

    def _normal(self, name: str, given: object, plane: Any) -> list[float]:
        """The unit vector asked for; it is not guessed, because its sign says which way the face opens."""
        text = str(given)
        sign = -1.0 if text.startswith("-") else 1.0
        if text.lstrip("+-").lower() in _AXES:
            return [sign * value for value in _AXES[text.lstrip("+-").lower()]]
        try:
            vector = [float(part) for part in text.split("/")]
        except ValueError:
            vector = []
        size = math.sqrt(sum(value * value for value in vector))
        if given is None or len(vector) != 3 or not 0.0 < size < math.inf:
            fitted = (
                ""
                if plane is None
                else "; the plane of its nodes has " + "/".join(units.number(v) for v in plane)
            )
            got = "" if given is None else f", got {text!r}"
            raise InputError(
                f"`--patch` {name!r} needs normal=x, -y or such as 0/1/0, across the face from the first set "
                f"to the second{got}{fitted} or its opposite"
            )
        return [value / size for value in vector]

    def made(
        self, given: MatrixSet | None, known: Mapping[str, int | str]
    ) -> tuple[dict[str, int | str], dict[str, list[dict[str, Any]]]]:
        """What the patches add to a scene: DOFs of their nodes that had no name, each with its label; tables.

        InputError if the rows of the matrices have no names, or a node has no row.

        Parameters
        ----------
        given : the matrices.
        known : DOFs that have a name already, each with its row or label.
        """
        if self._nodes and (given is None or given.labels is None):
            raise InputError(
                "`--patch` needs matrices whose rows are named: give the file that names them (--mapping)"
            )
        rows = set() if given is None else {str(label) for label in given.labels or ()}
        named = {row: name for name, row in known.items() if isinstance(row, str)}
        dofs: dict[str, int | str] = {}
        nodes = []
        for node in self._nodes:
            labels = {axis: f"{node}.U{axis.upper()}" for axis in "xyz"}
            own = {axis: named.get(text, f"n{node}{axis}") for axis, text in labels.items() if text in rows}
            if not own:
                raise InputError(f"`--patch`: node {node} has no row in the matrices")
            dofs |= {dof: labels[axis] for axis, dof in own.items() if dof not in known}
            at = [value * self._metres for value in self._nodes[node]]
            nodes.append({"name": f"n{node}", "at": at, "dofs": own})
        return dofs, {"nodes": nodes, "dampers": self._dampers}
