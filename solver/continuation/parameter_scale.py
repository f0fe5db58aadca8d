"""The range of a parameter in the coordinate it is followed in: itself, or its logarithm over decades."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Annotated

import numpy as np

from solver.balance.balance import Kind, Parameter, resolve
from solver.errors import SettingError
from solver.jit.fourier import Real
from solver.scene.scene import Scene

LOGARITHMIC_FROM = 5.0  # ratio of the ends of the range from which equal ratios count equally


@dataclass(frozen=True, slots=True, kw_only=True)
class Scale:
    """A parameter with its range; z is the parameter or its logarithm."""

    parameter: Annotated[Parameter, "Not the frequency."]
    start: Annotated[float, "The range as it was asked for: its beginning."]
    stop: Annotated[float, "Its end."]

    @property
    def logarithmic(self) -> bool:
        """Whether z is the logarithm."""
        low, high = sorted((self.start, self.stop))
        return low > 0.0 and high / low >= LOGARITHMIC_FROM

    @property
    def low(self) -> float:
        """Smallest z."""
        return self.inside(min(self.start, self.stop))

    @property
    def high(self) -> float:
        """Largest z."""
        return self.inside(max(self.start, self.stop))

    @property
    def span(self) -> float:
        """Length of the range in z."""
        return self.high - self.low

    def inside(self, p: float) -> float:
        """Return z of a value of the parameter."""
        return math.log(p) if self.logarithmic else p

    def outside(self, z: float) -> float:
        """Return the value of the parameter at z; exactly the ends at the ends."""
        if z in (self.low, self.high):
            return min(self.start, self.stop) if z == self.low else max(self.start, self.stop)
        return math.exp(z) if self.logarithmic else z

    def by_z(self, p: Real) -> Real:
        """Return dp/dz at values of the parameter."""
        return p.copy() if self.logarithmic else np.ones(p.size)

    def spaced(self, count: int) -> Real:
        """Return values from start to stop, evenly spaced in z."""
        z = np.linspace(self.inside(self.start), self.inside(self.stop), count)
        return np.array([self.start, *(self.outside(float(at)) for at in z[1:-1]), self.stop])


def scale_of(scene: Scene, path: str, start: float, stop: float) -> Scale:
    """Return the range of a parameter; SettingError for the frequency, or a path or range that is none."""
    parameter = resolve(scene, path)
    if parameter.kind is Kind.FREQUENCY:
        raise SettingError("parameter", path, "cannot be the frequency: it is searched over the scene's band")
    first, last = check_range(parameter, start, stop)
    return Scale(parameter=parameter, start=first, stop=last)


def check_range(parameter: Parameter, start: float | None, stop: float | None) -> tuple[float, float]:
    """Return the range of a continuation as floats; SettingError for ends that are none, or the same."""
    ends = []
    for name, value in (("start", start), ("stop", stop)):
        if value is None:
            raise SettingError(name, None, f"is needed for a sweep of `{parameter.path}`")
        ends.append(parameter.check(name, value))
    first, last = ends
    if first == last:
        raise SettingError("stop", last, f"must differ from the start {first!r}")
    return first, last
