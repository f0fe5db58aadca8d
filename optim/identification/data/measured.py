"""What every kind of data is to the fit: observations, noise, a model with derivatives; all kinds.

A further kind is one module and one line in `SHIPPED`; one from outside the package is named by
`solver.extensions`.
"""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from typing import Annotated

import numpy as np

from optim.identification.data.measured_table import Table
from optim.identification.data.measured_units import Dimension
from optim.problem.variables import Real
from solver.extensions import Kinds
from solver.jit.fourier import Integer
from solver.scene.scene import Scene


@dataclass(frozen=True, slots=True, kw_only=True)
class Predicted:
    """What a model says of every observation of a run."""

    values: Annotated[
        Real, "In the order of `Measured.observations`, (n,); NaN where the point was not reached."
    ]
    slopes: Annotated[Real, "Derivatives by the parameter paths, (n, n_paths)."]
    reached: Annotated[np.ndarray, "Whether the response of the observation's point was found, (n,) of bool."]
    states: Annotated[
        Mapping[str, Integer], "Contact to the state codes it had, (n_points,); -1 where not reached."
    ] = field(default_factory=dict)


class RunModel(ABC):
    """The responses of a run over parameter values; keeps solutions to start the next from."""

    @abstractmethod
    def evaluate(self, values: Mapping[str, float]) -> Predicted:
        """Return observations and derivatives for values of the paths."""

    unique: bool = True
    """Whether every point has one response, as far as is known; False where branches had to be told apart."""

    def forget(self) -> None:  # noqa: B027 - most models keep nothing
        """Look for solutions and their branches anew in the next evaluation."""


@dataclass(frozen=True, slots=True, kw_only=True)
class MeasuredRows(ABC):
    """One run: rows measured under the same conditions."""

    source: Annotated[str, "The file, or the place in a description."]
    conditions: Annotated[Mapping[str, float], "Parameter path to value."]

    @property
    @abstractmethod
    def observations(self) -> Real:
        """The measured numbers, (n,)."""

    @property
    @abstractmethod
    def given_noise(self) -> Real | None:
        """Standard deviation of each observation if the data say it, (n,)."""

    @abstractmethod
    def noise_shape(self, values: Real) -> Real:
        """Return what the noise of each observation is in proportion to, (n,), where `values` are true."""

    @abstractmethod
    def model(self, scene: Scene, paths: Sequence[str], harmonics: int) -> RunModel:
        """Return its model in a scene, with derivatives by parameter paths."""

    @abstractmethod
    def thinned(self, most: int) -> MeasuredRows:
        """Return the run with at most so many points, for a first look."""

    @abstractmethod
    def under(self, conditions: Mapping[str, float], most: int) -> MeasuredRows:
        """Return a run that could be measured: the same points, at most so many, under other conditions."""

    @abstractmethod
    def to_json(self, fitted: Real, sd: Real) -> dict[str, object]:
        """Return data, fit and standard deviation of the fit, (n,) each, as curves for people."""

    def curves(self, values: Real) -> Sequence[Real]:  # noqa: ARG002
        """Return values of the observations, (n,), as curves in the order they were measured in.

        None where their order means nothing.
        """
        return ()

    @property
    def fitted_besides(self) -> int:
        """How many numbers of its own, no parameters of the scene, its model fits to the observations."""
        return 0

    @property
    def unit_words(self) -> str:
        """What the observations are, with their unit."""
        return "displacements [m]"

    @property
    def scale(self) -> float:
        """What an observation is the multiple of, in that unit."""
        return 1.0

    @property
    def words(self) -> str:
        """The run in a few words: conditions, or the file."""
        told = ", ".join(f"{path} = {value:.6g}" for path, value in self.conditions.items())
        return told or self.source


@dataclass(frozen=True, slots=True)
class Column:
    """A column of a kind of data."""

    name: str
    dimension: Dimension
    help: str


@dataclass(frozen=True, slots=True, kw_only=True)
class DataKind:
    """A kind of measured data: what files and descriptions of it have, and how it is read."""

    name: Annotated[str, "Its word, ``kind`` of a head."]
    help: Annotated[str, "A sentence of Markdown."]
    columns: Annotated[tuple[Column, ...], "Those it knows."]
    marks: Annotated[tuple[tuple[str, ...], ...], "Columns of which all those of one group tell the kind."]
    words: Annotated[Mapping[str, str], "What its head may say besides, each with its meaning."]
    read: Annotated[
        Callable[[Scene, Table], MeasuredRows],
        "From a scene and the table of one run, checked for numbers, to the run.",
    ]


SHIPPED = (
    "optim.identification.data.response",
    "optim.identification.data.loop",
    "optim.identification.data.mode",
    "optim.identification.data.decay",
    "optim.identification.data.resonance",
    "optim.identification.data.measured_peak",
)


KINDS: Kinds[DataKind] = Kinds(DataKind, "kind of data", lambda kind: (kind.name,), SHIPPED, "KIND")
data_kinds = KINDS.every


def known_columns() -> dict[str, Column]:
    """Return the columns of all kinds by name; a name means the same in each."""
    return {column.name: column for kind in data_kinds() for column in kind.columns}


def known_words() -> dict[str, str]:
    """Return what the heads of all kinds may say."""
    return {word: text for kind in data_kinds() for word, text in kind.words.items()}
