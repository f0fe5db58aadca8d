"""Uncertain parameters: what is not known of a scene, and in which scenarios that may end.

A set of scenarios is given as intervals, as an ellipsoid, or as a list of samples; the blades of a disk may
be mistuned on top. Points of an interval box or an ellipsoid are numbered by ξ, of the unit box or the unit
ball: δ = centre + axes ξ, where δ is the value of a parameter or its deviation from the nominal one.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from enum import Enum
from typing import Annotated

import numpy as np
from scipy.special import ndtri

from optim.problem.variables import Real
from solver.scene.scene import Scene


class How(Enum):
    """What the number of an uncertain parameter means."""

    VALUE = "value"
    RELATIVE = "relative deviation"
    OFFSET = "deviation"
    FACTOR = "factor of a blade"  # its deviation from 1


@dataclass(frozen=True, slots=True, kw_only=True)
class Coordinate:
    """One uncertain number; several parameter paths may share it."""

    name: Annotated[str, "The paths as the user wrote them."]
    paths: Annotated[tuple[str, ...], "The parameter paths it acts on."]
    how: Annotated[
        How, "Its value, or its deviation from the nominal value (of a variable: from the design's)."
    ]

    def value(self, nominal: float, delta: float) -> float:
        """Return the value of a path."""
        if self.how is How.VALUE:
            return delta
        return nominal * (1.0 + delta) if self.how is How.RELATIVE else nominal + delta

    def by_delta(self, nominal: float) -> float:
        """Return d value / dδ."""
        return nominal if self.how is How.RELATIVE else 1.0

    def by_nominal(self, delta: float) -> float:
        """Return d value / d nominal."""
        return {How.VALUE: 0.0, How.RELATIVE: 1.0 + delta}.get(self.how, 1.0)

    def words(self, delta: float) -> str:
        """Return a number of it in words."""
        if self.how is How.VALUE:
            return f"{self.name} = {delta:.6g}"
        return (
            f"{self.name} {100.0 * delta:+.4g} %" if self.how is How.RELATIVE else f"{self.name} {delta:+.6g}"
        )


@dataclass(frozen=True, slots=True, kw_only=True)
class Disk:
    """A disk whose blades are not quite equal; the keys are those of ``[structure.mistuning]`` in a scene."""

    of: Annotated[tuple[str, ...], "The parts that differ."]
    spread: Annotated[float, "Of the random factors, unless `values` are given."] = 0.0
    seed: Annotated[int, "Likewise."] = 0
    values: Annotated[tuple[float, ...], "The factors themselves."] = ()
    free: Annotated[bool, "The factors may be any within bounds: derivatives by them count."] = False

    def table(self) -> dict[str, object]:
        """Return the table of a scene."""
        if self.values:
            return {"of": list(self.of), "values": list(self.values)}
        return {"of": list(self.of), "spread": self.spread, "seed": self.seed}

    def on(self, scene: Scene) -> Scene:
        """Return the disk of a scene, mistuned.

        Raises
        ------
        SettingError, SceneError
            The scene is not cyclic, or the factors do not fit it.
        """
        # Loaded here: it brings the compiled loops along, which reading a problem does not need.
        from solver.studies.blades import blade_paths, mistuned, with_mistuning

        if self.free:
            return mistuned(blade_paths(scene, self.of)[0], of=self.of, values=self.values)
        return with_mistuning(scene, self.table())

    def paths(self, scene: Scene) -> list[tuple[str, ...]]:
        """Return the parameters of its annulus that each factor moves, of a disk whose factors are free."""
        from solver.studies.blades import blade_paths

        return blade_paths(scene, self.of)[1] if self.free else []

    def words(self) -> str:
        """Return it in words."""
        given = (
            f"factors {min(self.values):.4g} to {max(self.values):.4g}"
            if self.values
            else f"seed {self.seed}"
        )
        return f"disk mistuned in {', '.join(self.of)}, {given}"


@dataclass(frozen=True, slots=True, kw_only=True)
class Scenario:
    """One thing that may be the case."""

    settings: Annotated[
        tuple[tuple[Coordinate, float], ...], "The uncertain parameters with their δ; all others are nominal."
    ] = ()
    disk: Annotated[Disk | None, "The mistuned disk; None for the scene's own."] = None
    xi: Annotated[tuple[float, ...], "Its place in the unit box or ball; empty for a sample of a list."] = ()

    @property
    def given_disk(self) -> Disk | None:
        """The disk, if its factors are given and no coordinates."""
        return None if self.disk is None or self.disk.free else self.disk

    def words(self) -> str:
        """Return it in words."""
        said = [coordinate.words(delta) for coordinate, delta in self.settings]
        return ", ".join(said + ([] if self.disk is None else [self.disk.words()])) or "nominal"

    def to_json(self) -> dict[str, object]:
        """Return it as one JSON object."""
        answer: dict[str, object] = {
            "parameters": [
                {"path": coordinate.name, "how": coordinate.how.value, "value": delta}
                for coordinate, delta in self.settings
            ],
            "words": self.words(),
        }
        return answer if self.disk is None else {**answer, "mistuning": self.disk.table()}


class UncertaintyShape(Enum):
    """Which set ξ comes from, and how it is distributed when it is drawn."""

    BOX = "intervals"
    BALL = "ellipsoid"
    NORMAL = "ellipsoid of a normal distribution"
    LIST = "samples"


@dataclass(frozen=True, slots=True, kw_only=True)
class UncertainSet:
    """All scenarios that count."""

    shape: Annotated[UncertaintyShape, "Of the set of ξ."]
    coordinates: Annotated[tuple[Coordinate, ...], "The n uncertain parameters."] = ()
    centre: Annotated[tuple[float, ...], "δ = centre + axes ξ, (n,)."] = ()
    axes: Annotated[tuple[tuple[float, ...], ...], "Nested, (n, n)."] = ()
    deviations: Annotated[
        float, "How many standard deviations the ellipsoid of a normal distribution reaches to."
    ] = 1.0
    ends: Annotated[
        tuple[tuple[float, float], ...],
        "The intervals as they were given, so that their ends are met to the last digit.",
    ] = ()
    disks: Annotated[
        tuple[Disk, ...], "Each of them may be the disk at hand; empty if the scene's own is."
    ] = ()
    listed: Annotated[tuple[Scenario, ...], "The samples of a list."] = ()
    blades: Annotated[
        tuple[str, ...], "The parts whose factor of each blade is a coordinate, the last ones; empty if none."
    ] = ()

    @property
    def finite(self) -> bool:
        """Whether the scenarios can be counted: a list, or mistuned disks alone."""
        return self.shape is UncertaintyShape.LIST or not self.coordinates

    def all(self) -> tuple[Scenario, ...]:
        """Return every scenario of a finite set."""
        return (
            self.listed
            if self.shape is UncertaintyShape.LIST
            else tuple(Scenario(disk=disk) for disk in self.disks)
        )

    def scenario(self, xi: Real | Sequence[float], disk: Disk | None = None) -> Scenario:
        """Return the scenario of a place in the unit box or ball."""
        place = self.inside(np.asarray(xi, dtype=np.float64))
        return self._of_delta((np.array(self.centre) + np.array(self.axes) @ place).tolist(), place, disk)

    def _of_delta(self, delta: Sequence[float], place: Real, disk: Disk | None) -> Scenario:
        """Return the scenario of δ, at a place in the unit box or ball."""
        known = list(zip(self.coordinates, delta, strict=True))
        factors = tuple(1.0 + d for c, d in known if c.how is How.FACTOR)
        return Scenario(
            settings=tuple((c, d) for c, d in known if c.how is not How.FACTOR),
            disk=Disk(of=self.blades, values=factors, free=True) if factors else disk,
            xi=tuple(float(x) for x in place),
        )  # fmt: skip

    def middle(self) -> tuple[Scenario, ...]:
        """Return the scenario in the middle, of every disk; of a finite set the first scenario."""
        if self.finite:
            return self.all()[:1]
        return tuple(self.scenario([0.0] * len(self.centre), disk) for disk in self.disks or (None,))

    def inside(self, xi: Real) -> Real:
        """Return the nearest place of the unit box or ball."""
        if self.shape is UncertaintyShape.BOX:
            return np.clip(xi, -1.0, 1.0)
        reach = float(np.linalg.norm(xi))
        return xi / reach if reach > 1.0 else xi

    def inside_of(self, scenario: Scenario) -> bool:
        """Return whether a scenario is one of an infinite set, a place of its unit box or ball."""
        xi = np.array(scenario.xi)
        return xi.size == len(self.centre) and bool(np.abs(xi - self.inside(xi)).max(initial=0.0) <= 1e-9)

    def extreme(self, slope: Real) -> Real:
        """Return the place ξ at which slopeᵀ ξ is largest."""
        if self.shape is UncertaintyShape.BOX:
            return np.where(slope >= 0.0, 1.0, -1.0)
        reach = float(np.linalg.norm(slope))
        return slope / reach if reach > 0.0 else np.zeros(slope.size)

    def by_xi(self, by_delta: Real) -> Real:
        """Return derivatives by ξ, (…, n), from those by δ."""
        return np.asarray(by_delta @ np.array(self.axes))

    def draw(self, count: int, seed: int) -> tuple[Scenario, ...]:
        """Draw scenarios: those of a finite set themselves, else by Latin hypercube sampling.

        Uniform over intervals and over an ellipsoid, normal where a covariance was given (McKay, Beckman,
        Conover, Technometrics 21 (1979) 239). The same seed gives the same scenarios.
        """
        if self.finite:
            return self.all()
        rng = np.random.default_rng(seed)
        n = len(self.coordinates)
        strata = np.array([rng.permutation(count) for _ in range(n + 1)]).T
        share = (strata + rng.random((count, n + 1))) / count
        if self.shape is UncertaintyShape.BOX:
            places = 2.0 * share[:, :n] - 1.0
        else:
            normal = ndtri(np.clip(share[:, :n], 1e-15, 1.0 - 1e-15))
            if self.shape is UncertaintyShape.NORMAL:
                places = normal / self.deviations
            else:
                reach = np.linalg.norm(normal, axis=1)
                places = normal * (share[:, n] ** (1.0 / n) / np.maximum(reach, 1e-300))[:, None]
        disks = self.disks or (None,)
        return tuple(self._at(place, disks[i % len(disks)]) for i, place in enumerate(places))

    def _at(self, place: Real, disk: Disk | None) -> Scenario:
        """Return the scenario of a place; one drawn from a normal distribution may lie outside the ball."""
        delta = (np.array(self.centre) + np.array(self.axes) @ place).tolist()
        for i, (low, high) in enumerate(self.ends):
            delta[i] = low if place[i] == -1.0 else high if place[i] == 1.0 else delta[i]
        return self._of_delta(delta, place, disk)

    def corners(self, most: int) -> tuple[tuple[float, ...], ...]:
        """Return the corners of the box, or the ends of the axes of the ball; none if more than `most`."""
        n = len(self.coordinates)
        count = 2**n if self.shape is UncertaintyShape.BOX else 2 * n
        if self.finite or count > most:
            return ()
        if self.shape is UncertaintyShape.BOX:
            return tuple(tuple(1.0 if i >> j & 1 else -1.0 for j in range(n)) for i in range(count))
        return tuple(
            tuple(sign if i == j else 0.0 for i in range(n)) for j in range(n) for sign in (-1.0, 1.0)
        )

    def reach(self) -> Real:
        """Return the largest |δ − centre| of every coordinate, (n,)."""
        axes = np.abs(np.array(self.axes))
        if self.shape is UncertaintyShape.BOX:
            return np.asarray(axes.sum(axis=1))
        return np.asarray(np.linalg.norm(np.array(self.axes), axis=1))

    @property
    def paths(self) -> tuple[str, ...]:
        """Every parameter path that is uncertain."""
        listed = [coordinate for scenario in self.listed for coordinate, _ in scenario.settings]
        return tuple(dict.fromkeys(path for c in (*self.coordinates, *listed) for path in c.paths))

    def to_json(self) -> dict[str, object]:
        """Return it as one JSON object."""
        answer: dict[str, object] = {"kind": self.shape.value}
        if self.coordinates:
            reach = self.reach()
            answer["parameters"] = [
                {"path": c.name, "how": c.how.value, "low": m - r, "high": m + r}
                for c, m, r in zip(self.coordinates, self.centre, reach.tolist(), strict=True)
                if c.how is not How.FACTOR
            ]
        if self.blades:
            answer["mistuning"] = {"of": list(self.blades), "within": self.ends[-1][1]}
        if self.listed:
            answer["samples"] = [scenario.to_json() for scenario in self.listed]
        if self.disks:
            answer["disks"] = [disk.table() for disk in self.disks]
        return answer
