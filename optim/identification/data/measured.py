"""What every kind of data is to the fit: observations, noise, a model with derivatives; all kinds.

Most are runs of rows (`CurveRun`): numbers measured of each row, under what the row was measured at. A
further kind is one module and one line in `SHIPPED`; one from outside the package is named by
`solver.extensions`.
"""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from typing import Annotated, ClassVar, Self

import numpy as np

from optim.identification.data.measured_table import Dimension, Table, check_sign
from optim.problem.variables import Real
from solver.extensions import Kinds
from solver.jit.fourier import Integer
from solver.results.told import json_numbers
from solver.scene.parameter_paths import AMPLITUDE
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

    @classmethod
    def of(
        cls, columns: Sequence[tuple[Real, Real]], states: Mapping[str, Integer] | None = None
    ) -> Predicted:
        """Return what columns (m,) with their slopes (m, n_paths) come to; reached is what has both."""
        values, slopes = np.concatenate([one for one, _ in columns]), np.vstack([by for _, by in columns])
        reached = np.isfinite(values) & np.isfinite(slopes).all(axis=1)
        return cls(values=values, slopes=slopes, reached=reached, states=states or {})

    @classmethod
    def nothing(cls, n: int, n_paths: int) -> Predicted:
        """Return that no point was reached."""
        return cls.of([(np.full(n, np.nan), np.full((n, n_paths), np.nan))])


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

    UNIT_WORDS: ClassVar[str] = "displacements [m]"
    """What the observations are, with their unit."""
    FITTED_BESIDES: ClassVar[int] = 0
    """How many numbers of its own, no parameters of the scene, its model fits to the observations."""

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
        "From a scene and the table of one run, checked for numbers, to the run; DataError says what is "
        "wrong, with its line.",
    ]


SHIPPED = (
    "optim.identification.data.response",
    "optim.identification.data.loop",
    "optim.identification.data.mode",
    "optim.identification.data.resonance",
)


KINDS: Kinds[DataKind] = Kinds(DataKind, "kind of data", lambda kind: (kind.name,), SHIPPED, "KIND")
data_kinds = KINDS.every


def known_columns() -> dict[str, Column]:
    """Return the columns of all kinds by name; a name means the same in each."""
    return {column.name: column for kind in data_kinds() for column in kind.columns}


def known_words() -> dict[str, str]:
    """Return what the heads of all kinds may say."""
    return {word: text for kind in data_kinds() for word, text in kind.words.items()}


FLOOR = 0.01  # of the largest size of a column, below which noise in proportion to it falls no further


@dataclass(frozen=True, slots=True, kw_only=True)
class CurveRun(MeasuredRows):
    """Columns measured over others; m rows."""

    at: Annotated[Mapping[str, Real], "Columns that tell where each row was measured, the first the x, (m,)."]
    data: Annotated[Mapping[str, Real], "Columns measured, in the order of the observations, (m,)."]
    sd: Annotated[Mapping[str, Real] | None, "Standard deviations of these, if known, (m,)."]

    KIND_NAME: ClassVar[str]
    TOLD: ClassVar[Mapping[str, str]]
    """Its columns in words, with their units."""
    SHARES: ClassVar[Mapping[str, float]] = {}
    """Noise of columns relative to their size, where that of the others is 1."""

    @property
    def x(self) -> Real:
        """What the rows are drawn over, (m,)."""
        return next(iter(self.at.values()))

    @property
    def observations(self) -> Real:
        """The columns one after the other, (n,)."""
        return np.concatenate(list(self.data.values()))

    @property
    def given_noise(self) -> Real | None:
        """As the base says."""
        return None if self.sd is None else np.concatenate([self.sd[name] for name in self.data])

    def noise_shape(self, values: Real) -> Real:
        """The size of each number times the share of its column, but no less than `FLOOR` of the largest."""
        shapes = []
        for name, column in zip(self.data, self.curves(values), strict=True):
            size = np.abs(column)
            shapes.append(self.SHARES.get(name, 1.0) * np.maximum(size, FLOOR * float(np.nanmax(size))))
        return np.concatenate(shapes)

    def curves(self, values: Real) -> Sequence[Real]:
        """As the base says: each column over the rows."""
        return tuple(values.reshape(len(self.data), -1))

    def thinned(self, most: int) -> Self:
        """Rows evenly taken."""
        m = self.x.size
        return self if m <= most else self._rows(np.unique(np.linspace(0, m - 1, most).round().astype(int)))

    def under(self, conditions: Mapping[str, float], most: int) -> Self:
        """The same places under other conditions."""
        run = self.thinned(most)
        nothing = {name: np.full(run.x.size, np.nan) for name in run.data}
        return replace(run, conditions={**self.conditions, **conditions}, sd=None, data=nothing)

    def _rows(self, kept: np.ndarray) -> Self:
        at, data = ({name: column[kept] for name, column in of.items()} for of in (self.at, self.data))
        sd = None if self.sd is None else {name: column[kept] for name, column in self.sd.items()}
        return replace(self, at=at, data=data, sd=sd)

    def to_json(self, fitted: Real, sd: Real) -> dict[str, object]:
        """The last column over x; further ones by their names."""
        *others, (name, seen) = self.data.items()
        *fits, fit = self.curves(fitted)
        more: dict[str, object] = {}
        for (other, column), values in zip(others, fits, strict=True):
            more |= {other: column.tolist(), f"fit_{other}": json_numbers(values)}
        return {
            "kind": self.KIND_NAME, "source": self.source, "conditions": dict(self.conditions),
            "quantity": self.TOLD[name], "over": self.TOLD[next(iter(self.at))], "x": self.x.tolist(),
            "data": seen.tolist(), "fit": json_numbers(fit), "fit_sd": json_numbers(sd[-seen.size :]), **more,
        }  # fmt: skip


def columns_of(
    table: Table, at: Sequence[str], measured: Mapping[str, str]
) -> tuple[dict[str, Real], dict[str, Real], dict[str, Real] | None]:
    """Return `at`, `data` and `sd` of a run, those of the columns that the table has.

    Parameters
    ----------
    at : columns that tell where; each must be there or have been looked at.
    measured : columns that may be measured, all above 0, to the column of their standard deviation.

    Raises
    ------
    DataError
        A number that is not above 0; deviations of some columns and not of all.
    """
    columns = table.columns
    data = {name: columns[name] for name in measured if name in columns}
    named = {name: measured[name] for name in data}
    for name in (*data, *(sd for sd in named.values() if sd in columns)):
        check_sign(table, name, positive=True)
    given = [sd for sd in named.values() if sd in columns]
    missing = next((sd for sd in named.values() if sd not in columns), None)
    if given and missing is not None:
        wanted = f"must come with {missing}: deviations of all or of none"
        raise table.refusal(", ".join(given), wanted)
    sd = {name: columns[of] for name, of in named.items()} if given else None
    return {name: columns[name] for name in at if name in columns}, data, sd


def check_level(table: Table) -> None:
    """Raise DataError if levels are not above 0, or a condition of the run says one too."""
    check_sign(table, "level", positive=True)
    if AMPLITUDE in table.conditions:
        raise table.refusal(table.conditions[AMPLITUDE], f"{AMPLITUDE} is the column `level` here")


def whole_word(table: Table, word: str) -> int | None:
    """Return a whole number of the head; None without it.

    Raises
    ------
    DataError
        It is none.
    """
    text = table.words.get(word)
    if text is None:
        return None
    try:
        return int(text)
    except ValueError:
        wanted = f"`{word}` must be a whole number"
        raise table.refusal(text, wanted) from None
