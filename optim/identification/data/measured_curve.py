"""Runs of rows: numbers measured of each row, under what the row was measured at. Most kinds are one."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Annotated, ClassVar, Self

import numpy as np

from optim.identification.data.measured import MeasuredRows
from optim.identification.data.measured_table import Table, check_sign
from optim.problem.checks import DataError
from optim.problem.variables import Real
from solver.results.told import json_numbers
from solver.scene.parameter_paths import AMPLITUDE

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
        raise DataError(table.source, text, wanted, place=table.place) from None
