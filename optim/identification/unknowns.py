"""What is looked for: parameters within bounds, and what was known of them before."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Annotated

import numpy as np

from optim.problem.checks import DesignError, is_number
from optim.problem.variables import (
    BoundedVariable,
    Real,
    by_variables,
    check_variables,
    parameter_values,
    slopes,
    unscaled,
)
from solver.scene.scene import Scene

UNKNOWNS, PRIORS = "unknowns", "priors"
FIRMEST = (
    1e-6  # standard deviation of a prior relative to the width of the bounds, below which it is no unknown
)


@dataclass(frozen=True, slots=True, kw_only=True)
class Prior:
    """A normal distribution of a parameter before the data: mean and standard deviation in its unit."""

    mean: float
    sd: float


@dataclass(frozen=True, slots=True, kw_only=True)
class Unknowns:
    """Parameters within bounds, each scaled to z from 0 to 1, logarithmically over wide ranges."""

    variables: Annotated[tuple[BoundedVariable, ...], "Tuple of Variable."]
    priors: Annotated[Mapping[str, Prior], "Name of a variable to what was known of it."]

    def __len__(self) -> int:
        return len(self.variables)

    @property
    def names(self) -> tuple[str, ...]:
        """Names of the variables, in order."""
        return tuple(variable.name for variable in self.variables)

    @property
    def paths(self) -> tuple[str, ...]:
        """The parameter paths of all variables, in the order derivatives have."""
        return tuple(path for variable in self.variables for path in variable.paths)

    def by_path(self, z: Real) -> dict[str, float]:
        """Return parameter path to value of scaled values."""
        return parameter_values(self.variables, unscaled(self.variables, z))

    def values(self, z: Real) -> Real:
        """Return the values of scaled ones, (n,), each in its unit."""
        return np.array(list(unscaled(self.variables, z).values()))

    def slopes(self, z: Real) -> Real:
        """Return d value / dz, (n,)."""
        return slopes(self.variables, unscaled(self.variables, z))

    def by_scaled(self, z: Real, by_paths: Real) -> Real:
        """Return derivatives by z, (rows, n), of derivatives by the paths (rows, n_paths)."""
        return np.asarray(by_variables(self.variables, by_paths.T).T * self.slopes(z))

    def prior_rows(self, z: Real) -> tuple[Real, Real]:
        """Return (value − mean)/sd of each prior, (n_priors,), and the derivatives by z, (n_priors, n)."""
        values, by = self.values(z), self.slopes(z)
        at = [i for i, name in enumerate(self.names) if name in self.priors]
        priors = [self.priors[self.names[i]] for i in at]
        rows = np.array([(values[i] - p.mean) / p.sd for i, p in zip(at, priors, strict=True)])
        jacobian = np.zeros((len(at), len(self)))
        for row, (i, p) in enumerate(zip(at, priors, strict=True)):
            jacobian[row, i] = by[i] / p.sd
        return rows, jacobian

    def start(self, scene: Scene) -> Real:
        """Return the scaled values of the scene, kept within the bounds; the middle where it has none."""
        values = [scene.value(variable.paths[0]) for variable in self.variables]
        return np.array([
            variable.inside(value) if variable.low <= value <= variable.high else 0.5
            for variable, value in zip(self.variables, values, strict=True)
        ])  # fmt: skip


def read_unknowns(
    scene: Scene, unknowns: Mapping[str, Sequence[float]], scaling: Mapping[str, str] | None,
    priors: Mapping[str, Sequence[float]] | None,
) -> Unknowns:  # fmt: skip
    """Return the unknowns of a description.

    Parameters
    ----------
    unknowns : parameter path (several that share a value separated by commas) to (low, high).
    scaling : names to ``linear``, ``logarithmic`` or ``auto``.
    priors : names to (mean, standard deviation).

    Raises
    ------
    DesignError, SettingError
        Names the path, the value and what would be right.
    """
    if not isinstance(unknowns, Mapping) or not unknowns:
        raise DesignError(UNKNOWNS, unknowns, "must name at least one parameter path with (low, high)")
    variables = check_variables(scene, unknowns, scaling, key=UNKNOWNS)
    by_name = {variable.name: variable for variable in variables}
    known: dict[str, Prior] = {}
    for name, pair in (priors or {}).items():
        if name not in by_name:
            wanted = f"must be of an unknown, one of {', '.join(by_name)}"
            raise DesignError(PRIORS, name, wanted, place=(PRIORS, name))
        good = isinstance(pair, Sequence) and len(pair) == 2 and all(is_number(value) for value in pair)
        wide = by_name[name].high - by_name[name].low
        if not good or pair[1] < FIRMEST * wide:
            wanted = "must be a mean and a standard deviation > 0, both in the unit of the parameter"
            raise DesignError((PRIORS, name), pair, wanted)
        known[name] = Prior(mean=float(pair[0]), sd=float(pair[1]))
    return Unknowns(variables=variables, priors=known)
