"""The kind `peak`: the largest amplitude of each blade as it passes a resonance, as blade tip timing has it.

Tip timing counts when blades pass: it knows how far each moves at most, neither a phase nor the force. The
model is the highest peak of max|x| of each blade over the range, all blades from one response
(`solver.studies.blades`), with the exact derivatives of a peak, corners included
(`solver.sensitivity.nonsmooth`).
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Annotated, ClassVar

import numpy as np

from optim.identification.data.measured import (
    Column,
    CurveRun,
    DataKind,
    MeasuredRows,
    Predicted,
    RunModel,
    check_level,
    columns_of,
)
from optim.identification.data.measured_table import Dimension, Table
from optim.identification.data.response import measured_dof, observing_dof
from optim.problem.variables import Real
from solver.continuation.branch import Branch
from solver.continuation.branches.sweep import if_damped, sweep
from solver.continuation.walk import ContinuationSettings
from solver.errors import SettingError
from solver.scene.parameter_paths import AMPLITUDE
from solver.scene.scene import Scene
from solver.sensitivity.gradient import Sensitivities
from solver.sensitivity.nonsmooth import peak_gradient
from solver.studies.blades import blade_peaks, blade_rows


@dataclass(frozen=True, slots=True, kw_only=True)
class PeakRun(CurveRun):
    """Peaks of blades, or of one DOF, each perhaps at a level of its own."""

    dof: Annotated[str, "Where; of blades its name in one sector."]
    range: Annotated[tuple[float, float] | None, "Frequencies passed [Hz]; the scene's band."]

    KIND_NAME: ClassVar = "peak"
    TOLD: ClassVar = {
        "blade": "blade",
        "number": "number",
        "level": "excitation [N]",
        "peak": "largest amplitude [m]",
    }

    def model(self, scene: Scene, paths: Sequence[str], harmonics: int) -> RunModel:
        """As the base says."""
        return _PeakModel(self, scene, tuple(paths), harmonics)


class _PeakModel(RunModel):
    """The highest peaks of the scene."""

    def __init__(self, run: PeakRun, scene: Scene, paths: tuple[str, ...], harmonics: int) -> None:
        self._run, self._scene, self._paths, self._harmonics = run, scene, paths, harmonics

    def evaluate(self, values: Mapping[str, float]) -> Predicted:
        """As the base says."""
        run, m = self._run, self._run.x.size
        here = self._scene.with_values({**values, **run.conditions})
        found, slopes = np.full(m, np.nan), np.full((m, len(self._paths)), np.nan)
        levels = run.at.get("level", np.full(m, np.nan))
        blades = run.at.get("blade")
        for level in np.unique(levels):
            rows = np.flatnonzero((levels == level) | (np.isnan(levels) & np.isnan(level)))
            there = here if np.isnan(level) else here.with_values({AMPLITUDE: float(level)})
            numbers = None if blades is None else blades[rows].astype(np.int64)
            for row, branch in zip(rows, self._branches(there, numbers, rows.size), strict=True):
                found[row], slopes[row] = _peak(branch, self._paths)
        if "level" in run.at and AMPLITUDE in self._paths:  # the level stands in its place
            slopes[:, self._paths.index(AMPLITUDE)] = 0.0
        return Predicted.of([(found, slopes)])

    def _branches(self, scene: Scene, blades: np.ndarray | None, count: int) -> list[Branch | None]:
        """Return the responses of blades, or so many times that of the DOF; None where one did not reach."""
        start, stop = self._run.range or (None, None)
        if blades is None:
            seen = observing_dof(scene, self._run.dof)
            settings = ContinuationSettings(errors=False)
            branch = if_damped(
                sweep(seen, start=start, stop=stop, harmonics=self._harmonics, settings=settings)
            )
            return [branch if branch.reached else None] * count
        found = blade_peaks(scene, start, stop, dof=self._run.dof, harmonics=self._harmonics)
        if len(found.branches) != len(found.value):
            return [None] * count
        return [found.branches[b] if found.branches[b].reached else None for b in blades.tolist()]


def _peak(branch: Branch | None, paths: tuple[str, ...]) -> tuple[float, Real]:
    """Return the highest peak and its derivatives; NaN of no response."""
    if branch is None or branch.peak is None:
        return np.nan, np.full(len(paths), np.nan)
    gradient = peak_gradient(Sensitivities(branch.balance, paths), branch.peak)
    return branch.peak.value, gradient.gradient


def read_peak(scene: Scene, table: Table) -> MeasuredRows:
    """As `DataKind.read` says."""
    table.need(1, "peaks")
    at, data, sd = columns_of(table, ("blade", "level"), _MEASURED)
    if "level" in at:
        check_level(table)
    dof = _checked_blades(scene, table) if "blade" in at else measured_dof(scene, table)
    band = table.number("from", scene.observe.band[0]), table.number("to", scene.observe.band[1])
    if not band[0] < band[1]:
        raise table.refusal(band, "`from` must be below `to`, both in Hz")
    return PeakRun(
        source=table.source, conditions=dict(table.conditions), data=data, sd=sd, dof=dof,
        at=at or {"number": np.arange(1, len(table) + 1, dtype=np.float64)},
        range=band if {"from", "to"} & set(table.words) else None,
    )  # fmt: skip


def _checked_blades(scene: Scene, table: Table) -> str:
    """Return the DOF of one sector that was measured; the numbers of blades are looked at."""
    dof = table.words.get("dof", scene.observe.dof.partition("@")[0])
    try:
        count = len(blade_rows(scene, dof))
    except SettingError as error:
        raise table.refusal(dof, f"`dof`: {error}") from error
    blades = table.columns["blade"]
    bad = np.flatnonzero((blades != np.round(blades)) | (blades < 0) | (blades >= count))
    if bad.size:
        raise table.error(int(bad[0]), "blade", f"must be the number of a sector, 0 to {count - 1}")
    return dof


_MEASURED = {"peak": "peak_sd"}

KIND = DataKind(
    name="peak",
    help="The largest amplitude over a resonance, of each blade: blade tip timing.",
    columns=(
        Column("peak", Dimension.LENGTH, "Largest displacement over the frequencies passed."),
        Column("blade", Dimension.NUMBER, "Number of the sector, from 0."),
        Column("level", Dimension.FORCE, "Amplitude of the excitation, `excitation.amplitude`."),
        Column("peak_sd", Dimension.LENGTH, "Standard deviation of each, if it is known."),
    ),
    marks=(("peak",),),
    words={
        "dof": "Degree of freedom that was measured; the one the scene observes.",
        "from": "Lowest frequency passed [Hz]; that of the scene's band.",
        "to": "Highest frequency passed [Hz]; that of the scene's band.",
    },
    read=read_peak,
)  # fmt: skip
