"""Design variables in the units the search works in: 0 to 1 between the bounds, logarithmic over decades."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from types import MappingProxyType
from typing import Annotated

import numpy as np
from numpy.typing import NDArray

from optim.problem.checks import DesignError, Scaling, number_pair, word
from optim.problem.problem_keys import ABOVE, BELOW, default_variable
from solver.balance.balance import Kind, resolve
from solver.errors import at
from solver.scene.parameter_paths import AMPLITUDE
from solver.scene.scene import Scene

Real = NDArray[np.float64]
NOTHING: Mapping[str, tuple[float, float]] = MappingProxyType({AMPLITUDE: (1.0, 2.0)})
"""Stands for no variable where nothing but the options of a catalogue is chosen."""
SNAP = 1e-7  # scaled distance within which a variable is put on its bound
LOGARITHMIC_FROM = 5.0  # ratio of the bounds from which a variable is scaled logarithmically


@dataclass(frozen=True, slots=True, kw_only=True)
class BoundedVariable:
    """One number to choose, with bounds; several parameter paths may share it."""

    name: Annotated[
        str, "The paths as the user wrote them, separated by commas: ``shroud.N0`` or ``shroud.N0,root.N0``."
    ]
    paths: Annotated[tuple[str, ...], "The parameter paths that get the value."]
    low: Annotated[float, "Its lower bound, in the parameter's unit."]
    high: Annotated[float, "Its upper one."]
    logarithmic: Annotated[bool, "Whether equal ratios count equally."]

    def inside(self, value: float) -> float:
        """Return the scaled value, 0 at the lower bound and 1 at the upper."""
        if self.logarithmic:
            return math.log(value / self.low) / math.log(self.high / self.low)
        return (value - self.low) / (self.high - self.low)

    def outside(self, scaled: float) -> float:
        """Return the value of a scaled one, kept within the bounds."""
        if self.logarithmic:
            value = self.low * math.exp(scaled * math.log(self.high / self.low))
        else:
            value = self.low + scaled * (self.high - self.low)
        return min(max(value, self.low), self.high)

    def slope(self, value: float) -> float:
        """Return d value / d scaled at `value`."""
        if self.logarithmic:
            return value * math.log(self.high / self.low)
        return self.high - self.low

    def bend(self, value: float) -> float:
        """Return d² value / d scaled² at `value`."""
        return value * math.log(self.high / self.low) ** 2 if self.logarithmic else 0.0


def beside_cases(
    chosen: tuple[BoundedVariable, ...], given: Mapping[str, tuple[float, float]] | None
) -> tuple[BoundedVariable, ...]:
    """Return the variables that no case may set: those given, unless they stand for none."""
    return () if given is NOTHING else chosen


def parameter_values(variables: Sequence[BoundedVariable], values: Mapping[str, float]) -> dict[str, float]:
    """Return the parameter path to value of a design given by the names of the variables."""
    return {path: values[variable.name] for variable in variables for path in variable.paths}


def by_variables(variables: Sequence[BoundedVariable], by_path: Real) -> Real:
    """Return a gradient by the variables from one by all their paths, (n,)."""
    gathered: Real = _members(variables) @ by_path
    return gathered


def by_variables_twice(variables: Sequence[BoundedVariable], by_paths: Real) -> Real:
    """Return second derivatives by the variables from those by all their paths, (n, n)."""
    members = _members(variables)
    gathered: Real = members @ by_paths @ members.T
    return gathered


def _members(variables: Sequence[BoundedVariable]) -> Real:
    """Return which variable each path belongs to, (n_variables, n_paths) of 0 and 1."""
    owners = np.repeat(np.arange(len(variables)), [len(variable.paths) for variable in variables])
    return np.asarray(np.arange(len(variables))[:, None] == owners, dtype=np.float64)


def scaled(variables: Sequence[BoundedVariable], values: Mapping[str, float]) -> Real:
    """Return the scaled variables of a design, (n,)."""
    return np.array([variable.inside(values[variable.name]) for variable in variables])


def unscaled(variables: Sequence[BoundedVariable], z: Real | Sequence[float]) -> dict[str, float]:
    """Return the design of scaled variables, name to value."""
    return {variable.name: variable.outside(float(x)) for variable, x in zip(variables, z, strict=True)}


def snapped(z: Real) -> Real:
    """Return scaled variables within their bounds; convex solvers stop a hair's breadth inside them."""
    inside = np.clip(z, 0.0, 1.0)
    inside[inside <= SNAP] = 0.0
    inside[inside >= 1.0 - SNAP] = 1.0
    return inside


def slopes(variables: Sequence[BoundedVariable], values: Mapping[str, float]) -> Real:
    """Return d value / d scaled of every variable, (n,)."""
    return np.array([variable.slope(values[variable.name]) for variable in variables])


def check_variables(
    scene: Scene,
    variables: Mapping[str, Sequence[float]] | None,
    scaling: Mapping[str, str] | None = None,
    *,
    key: str = "variables",
) -> tuple[BoundedVariable, ...]:
    """Return the design variables; without any, the N0 of the first contact whose load N1 is tied to.

    Parameters
    ----------
    scene : what is designed.
    variables : paths (several that share a value separated by commas) to (low, high).
    scaling : names of variables to ``linear``, ``logarithmic`` or ``auto``.
    key : what the description calls them.

    Raises
    ------
    SettingError
        A path the scene does not have.
    DesignError
        Bounds that are not two finite ascending numbers, or a variable that cannot be designed.
    """
    if variables is None:
        variables = _default(scene)
    if not isinstance(variables, Mapping) or not variables:
        raise DesignError(key, variables, "must name at least one parameter path with (low, high)")
    scaling = {} if scaling is None else scaling
    for name in scaling:
        if name not in variables:
            wanted = f"must name the variables {', '.join(variables)}"
            raise DesignError("scaling", name, wanted, place=("scaling", name))
    taken: dict[str, str] = {}
    checked = []
    for name, bounds in variables.items():
        paths = tuple(part.strip() for part in str(name).split(","))
        low, high = number_pair((key, name), bounds)
        if not low < high:
            raise DesignError((key, name), bounds, "must have low < high")
        for path in paths:
            with at(key, name):
                parameter = resolve(scene, path)
                if parameter.kind is Kind.FREQUENCY:
                    wanted = "cannot be the frequency: the band of the scene is searched"
                    raise DesignError(key, path, wanted)
                parameter.check(f"{key}.{path} (low)", low)
                parameter.check(f"{key}.{path} (high)", high)
            if path in taken:
                wanted = f"must stand in one variable, it is in {taken[path]} too"
                raise DesignError(key, path, wanted, place=(key, path))
            taken[path] = name
        how = _scaling(name, scaling.get(name, Scaling.AUTO.value), low, high)
        checked.append(BoundedVariable(name=name, paths=paths, low=low, high=high, logarithmic=how))
    return tuple(checked)


def _scaling(name: str, wanted: object, low: float, high: float) -> bool:
    """Return whether a variable is scaled logarithmically."""
    how = word(("scaling", name), wanted, Scaling)
    if how is Scaling.LOGARITHMIC and low <= 0.0:
        raise DesignError(("scaling", name), wanted, f"needs a lower bound > 0, which is {low:g}")
    return how is Scaling.LOGARITHMIC or (
        how is Scaling.AUTO and low > 0.0 and high / low >= LOGARITHMIC_FROM
    )


def _default(scene: Scene) -> dict[str, tuple[float, float]]:
    """Return the variable that is designed by itself with its range."""
    path = default_variable(scene)
    if path is None:
        raise DesignError("variables", None, "must be given: the scene has no friction contact to design")
    value = scene.value(path)
    if value <= 0.0:
        raise DesignError("variables", None, f"must be given: {path} is {value:g}, it suggests no range")
    return {path: (value / BELOW, value * ABOVE)}
