"""All runs at once: predictions, residuals and their derivatives by the scaled unknowns."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from optim.identification.data.measured import Measured, Predicted
from optim.identification.unknowns import Unknowns
from optim.problem.variables import Real
from solver.jit.fourier import Integer
from solver.scene.scene import Scene


@dataclass(frozen=True, slots=True, kw_only=True)
class Fitted:
    """The predictions of all runs at one place.

    Attributes
    ----------
    z : (n,) array
        Scaled unknowns.
    values : (N,) array
        Predicted observations, NaN where not reached.
    jacobian : (N, n) array
        By z.
    reached : (N,) array of bool
    states : tuple of mappings
        Of each run, contact to state codes.
    """

    z: Real
    values: Real
    jacobian: Real
    reached: np.ndarray
    states: tuple[Mapping[str, Integer], ...]


class Runs:
    """The models of all runs.

    Parameters
    ----------
    scene : what was measured.
    runs : the data.
    unknowns : what is looked for.
    harmonics : highest harmonic of the balance.
    """

    def __init__(self, scene: Scene, runs: Sequence[Measured], unknowns: Unknowns, harmonics: int) -> None:
        self.scene, self.runs, self.unknowns, self.harmonics = scene, tuple(runs), unknowns, harmonics
        self.models = [run.model(scene, unknowns.paths, harmonics) for run in self.runs]
        self.observations = np.concatenate([run.observations for run in self.runs])
        sizes = [run.observations.size for run in self.runs]
        self.slices = [slice(end - size, end) for end, size in zip(np.cumsum(sizes), sizes, strict=True)]
        self.evaluations = 0
        self._last: Fitted | None = None

    def at(self, z: Real) -> Fitted:
        """Return the predictions at scaled unknowns; those just computed are kept."""
        if self._last is not None and np.array_equal(self._last.z, z):
            return self._last
        values = self.unknowns.by_path(z)
        found: list[Predicted] = [model.evaluate(values) for model in self.models]
        by_paths = np.concatenate([one.slopes for one in found])
        self._last = Fitted(
            z=z.copy(), values=np.concatenate([one.values for one in found]),
            jacobian=self.unknowns.by_scaled(z, by_paths),
            reached=np.concatenate([one.reached for one in found]),
            states=tuple(one.states for one in found),
        )  # fmt: skip
        self.evaluations += 1
        return self._last

    def forget(self) -> None:
        """Look for the branches of all responses anew."""
        self._last = None
        for model in self.models:
            model.forget()

    def noise(self, values: Real, level: float | None) -> tuple[Real, np.ndarray]:
        """Return the standard deviation of every observation, and which of them are known, (N,) each.

        Parameters
        ----------
        values : (N,) the observations as they truly are, or nearly.
        level : relative to the noise shape of each run; None where it is not known: the shape itself then.
        """
        sd, known = np.empty(values.size), np.empty(values.size, dtype=bool)
        for run, part in zip(self.runs, self.slices, strict=True):
            given = run.given_noise
            known[part] = given is not None or level is not None
            shape = run.noise_shape(values[part]) if given is None else given
            sd[part] = shape if given is not None or level is None else level * shape
        return sd, known

    def thinned(self, most: int) -> Runs:
        """Return the same with at most so many points of each run."""
        return Runs(self.scene, [run.thinned(most) for run in self.runs], self.unknowns, self.harmonics)
