"""The kinds `resonance` and `peak`: phase resonance over the level, and the largest amplitude of each blade.

A test with controlled phase finds the frequency at which harmonic 1 of a displacement lags the force by a
quarter of a period, Re x̂ = 0. With the exact derivatives of x̂ by the frequency f and by parameters p,

    df/dp = −Re x̂_p / Re x̂_f,   d|x̂|/dp = ∓(Im x̂_p + Im x̂_f df/dp).

Of several such places that with the largest amplitude counts, found once on a whole response and followed
from there.

Blade tip timing counts when blades pass: it knows how far each moves at most, neither a phase nor the force.
The model is the highest peak of max|x| of each blade over the range, all blades from one response
(`solver.studies.blades`), with the exact derivatives of a peak, corners included
(`solver.sensitivity.nonsmooth`).
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from itertools import pairwise
from typing import Annotated, ClassVar, NamedTuple

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
from optim.identification.data.response import NOT_REACHED, measured_dof, observing_dof
from optim.problem.variables import Real
from solver.balance.balance import build
from solver.balance.simplifications import Effects
from solver.continuation.branch import Branch
from solver.continuation.branches.sweep import if_damped, sweep
from solver.continuation.walk import ContinuationSettings
from solver.errors import SettingError
from solver.scene.parameter_paths import AMPLITUDE
from solver.scene.scene import Scene
from solver.scene.scene_harmonics import even_harmonics_reason
from solver.sensitivity.gradient import Sensitivities
from solver.sensitivity.nonsmooth import peak_gradient
from solver.sensitivity.observed import TWO_PI, Observed, ObservedSensitivities, Quantity
from solver.studies.blades import blade_peaks, blade_rows

SHARPER = 0.1  # noise of a frequency relative to it, where that of an amplitude is 1
_MOST_STEPS, _CLOSE = 30, 1e-7  # of the frequency; then one step more is exact
_FAR = 0.05  # relative change of the frequency beyond which a step is cut


@dataclass(frozen=True, slots=True, kw_only=True)
class ResonanceRun(CurveRun):
    """Amplitude, and perhaps frequency, over the level."""

    dof: Annotated[str, "Where."]

    KIND_NAME: ClassVar = "resonance"
    TOLD: ClassVar = {
        "level": "excitation [N]",
        "resonance_frequency": "frequency [Hz]",
        "resonance_amplitude": "amplitude [m]",
    }
    SHARES: ClassVar = {"resonance_frequency": SHARPER}  # frequencies are measured better

    def model(self, scene: Scene, paths: Sequence[str], harmonics: int) -> RunModel:
        """As the base says."""
        return _ResonanceModel(self, observing_dof(scene, self.dof), tuple(paths), harmonics)


class _NearResonance(NamedTuple):
    """A response near phase resonance."""

    hertz: float
    u: Real


class _ResonanceModel(RunModel):
    """The responses of the scene in phase resonance at the levels measured."""

    def __init__(self, run: ResonanceRun, scene: Scene, paths: tuple[str, ...], harmonics: int) -> None:
        self._run, self._scene, self._paths, self._harmonics = run, scene, paths, max(harmonics, 1)
        self._effects = Effects(even_harmonics=even_harmonics_reason(scene, paths) is not None)
        self.forget()

    def forget(self) -> None:
        """As the base says."""
        self._places: list[_NearResonance | None] = [None] * self._run.x.size

    def evaluate(self, values: Mapping[str, float]) -> Predicted:
        """As the base says."""
        run, m = self._run, self._run.x.size
        columns = {name: (np.full(m, np.nan), np.full((m, len(self._paths)), np.nan)) for name in run.data}
        states = np.full((m, len(self._scene.contacts)), NOT_REACHED)
        here = self._scene.with_values({**values, **run.conditions})
        for i, level in enumerate(run.x.tolist()):
            found = self._at(here.with_values({AMPLITUDE: level}), i)
            if found is None:
                continue
            hertz, seen = found
            drift = -seen.slopes[0] / seen.by_frequency[0]
            size = abs(float(seen.values[1]))
            by_size = np.sign(seen.values[1]) * (seen.slopes[1] + seen.by_frequency[1] * drift)
            told = {"resonance_frequency": (hertz, drift), "resonance_amplitude": (size, by_size)}
            for name, (column, slopes) in columns.items():
                column[i], slopes[i] = told[name]
            states[i] = seen.states
        if AMPLITUDE in self._paths:  # the level stands in its place
            for _, slopes in columns.values():
                slopes[:, self._paths.index(AMPLITUDE)] = 0.0
        codes = {each.name: states[:, c] for c, each in enumerate(here.contacts)}
        return Predicted.of(list(columns.values()), codes)

    def _at(self, scene: Scene, i: int) -> tuple[float, Observed] | None:
        """Return frequency and response in phase resonance at level i; None where there is none."""
        balance = build(scene, harmonics=self._harmonics, effects=self._effects)
        seen = ObservedSensitivities(balance, self._paths)
        place = self._places[i]
        for known in (place, None) if place is not None else (None,):
            begin = known or self._on_a_branch(scene, seen)
            found = None if begin is None else self._solved(seen, begin)
            if found is not None:
                self._places[i] = found[0]
                return found[0].hertz, found[1]
        return None

    def _on_a_branch(self, scene: Scene, seen: ObservedSensitivities) -> _NearResonance | None:
        """Return the place near phase resonance with the largest amplitude, of the response over the band."""
        points = sweep(scene, harmonics=self._harmonics, effects=self._effects).solutions
        at = [
            (p[-1] / TWO_PI, p[:-1], seen.observed(p[:-1], p[-1] / TWO_PI, Quantity.COMPLEX)) for p in points
        ]
        good = [(hertz, u, one.values) for hertz, u, one in at if one is not None]
        best, place = 0.0, None
        for (_, _, before), (hertz, u, after) in pairwise(good):
            if before[0] * after[0] <= 0.0 and abs(after[1]) > best:
                best, place = abs(after[1]), _NearResonance(hertz, u)
        return place

    def _solved(
        self, seen: ObservedSensitivities, begin: _NearResonance
    ) -> tuple[_NearResonance, Observed] | None:
        """Return the phase resonance next to a response, by Newton's method in the frequency."""
        (hertz, u), settled = begin, False
        for _ in range(_MOST_STEPS):
            solution = seen.solve(hertz, (u,))
            found = seen.observed(solution.u, hertz, Quantity.COMPLEX) if solution.converged else None
            if found is None or not np.isfinite(found.by_frequency[0]) or found.by_frequency[0] == 0.0:
                return None
            u = solution.u
            if settled:
                return _NearResonance(hertz, u), found
            step = -float(found.values[0] / found.by_frequency[0])
            settled = abs(step) <= _CLOSE * hertz
            hertz += min(max(step, -_FAR * hertz), _FAR * hertz)
        return None


def read_resonance(scene: Scene, table: Table) -> MeasuredRows:
    """As `DataKind.read` says."""
    table.need(1, "levels")
    check_level(table)
    at, data, sd = columns_of(table, ("level",), _IN_RESONANCE)
    return ResonanceRun(
        source=table.source, conditions=dict(table.conditions), at=at, data=data, sd=sd,
        dof=measured_dof(scene, table),
    )  # fmt: skip


_IN_RESONANCE = {
    "resonance_frequency": "resonance_frequency_sd", "resonance_amplitude": "resonance_amplitude_sd",
}  # fmt: skip

RESONANCE = DataKind(
    name="resonance",
    help="Amplitude and frequency in phase resonance over the level of the excitation.",
    columns=(
        Column("level", Dimension.FORCE, "Amplitude of the excitation, `excitation.amplitude`."),
        Column("resonance_amplitude", Dimension.LENGTH, "Of harmonic 1, which lags the force by 90°."),
        Column("resonance_frequency", Dimension.FREQUENCY, "At which it does."),
        Column("resonance_amplitude_sd", Dimension.LENGTH, "Standard deviation of each, if it is known."),
        Column("resonance_frequency_sd", Dimension.FREQUENCY, "Standard deviation of each, if it is known."),
    ),
    marks=(("level", "resonance_amplitude"), ("level", "resonance_frequency")),
    words={"dof": "Degree of freedom that was measured; the one the scene observes."},
    read=read_resonance,
)  # fmt: skip


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
    at, data, sd = columns_of(table, ("blade", "level"), _OF_BLADES)
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


_OF_BLADES = {"peak": "peak_sd"}

PEAK = DataKind(
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

KIND = (RESONANCE, PEAK)
