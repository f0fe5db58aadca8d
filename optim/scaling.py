"""Design variables in the units the search works in: 0 to 1 between the bounds, logarithmic over decades."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from optim.errors import DesignError
from solver.parameter import Kind, resolve
from solver.scene import FrictionContact, Scene

Real = NDArray[np.float64]
LOGARITHMIC_FROM = 5.0  # ratio of the bounds from which a variable is scaled logarithmically


@dataclass(frozen=True, slots=True, kw_only=True)
class Variable:
    """A parameter path with bounds.

    Attributes
    ----------
    path : str
        For example ``shroud.N0``.
    low, high : float
        Bounds, in the parameter's unit.
    """

    path: str
    low: float
    high: float

    @property
    def logarithmic(self) -> bool:
        """Whether equal ratios count equally."""
        return self.low > 0.0 and self.high / self.low >= LOGARITHMIC_FROM

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


def check_variables(
    scene: Scene, variables: Mapping[str, tuple[float, float]] | None
) -> tuple[Variable, ...]:
    """Return the design variables; without any, the N0 of the first contact whose load N1 is tied to.

    Raises
    ------
    SettingError
        A path the scene does not have.
    DesignError
        Bounds that are not two finite ascending numbers, or a variable that cannot be designed.
    """
    if variables is None:
        variables = _default(scene)
    if not variables:
        raise DesignError("variables", variables, "must name at least one parameter path with (low, high)")
    checked = []
    for path, bounds in variables.items():
        parameter = resolve(scene, path)
        if parameter.kind is Kind.FREQUENCY:
            raise DesignError("variables", path, "cannot be the frequency: the band of the scene is searched")
        low, high = _bounds(path, bounds)
        parameter.check(f"variables.{path} (low)", low)
        parameter.check(f"variables.{path} (high)", high)
        checked.append(Variable(path=path, low=low, high=high))
    return tuple(checked)


def _bounds(path: str, bounds: object) -> tuple[float, float]:
    name = f"variables.{path}"
    if not isinstance(bounds, Sequence) or isinstance(bounds, str) or len(bounds) != 2:
        raise DesignError(name, bounds, "must be two numbers, low and high")
    low, high = bounds
    for value in (low, high):
        number = isinstance(value, (int, float)) and not isinstance(value, bool)
        if not number or not math.isfinite(value):
            raise DesignError(name, bounds, "must be two finite numbers, low and high")
    if not low < high:
        raise DesignError(name, bounds, "must have low < high")
    return float(low), float(high)


def _default(scene: Scene) -> dict[str, tuple[float, float]]:
    """Return N0 of the first contact with a tied load (else of the first), a tenth to 15 times its value."""
    rubbing = [contact for contact in scene.contacts if isinstance(contact, FrictionContact)]
    if not rubbing:
        raise DesignError("variables", None, "must be given: the scene has no friction contact to design")
    tied = [contact for contact in rubbing if contact.N1_ratio is not None]
    contact = (tied or rubbing)[0]
    if contact.N0 <= 0.0:
        raise DesignError("variables", None, f"must be given: {contact.name}.N0 is 0, it suggests no range")
    return {f"{contact.group or contact.name}.N0": (contact.N0 / 10.0, contact.N0 * 15.0)}
