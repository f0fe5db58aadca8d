"""The kind `response`: amplitudes over frequency under one set of conditions.

Its model goes from point to point. Where every frequency has one response
(`solver.continuation.branches.point_by_point.is_unique`) Newton's method from a neighbour or from the last
parameters is enough. Elsewhere the branch is followed once through its folds, and of the solutions at a
measured frequency that nearest to the data is taken; from there it is followed over the parameters.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Annotated

import numpy as np

from optim.identification.data.measured import FLOOR, Column, DataKind, MeasuredRows, Predicted, RunModel
from optim.identification.data.measured_table import Dimension, Table, check_monotone, check_sign
from optim.problem.variables import Real
from solver.balance.balance import build
from solver.balance.simplifications import Effects
from solver.continuation.branches.point_by_point import is_unique
from solver.continuation.branches.sweep import sweep
from solver.continuation.walk import ContinuationSettings
from solver.jit.fourier import Complex
from solver.results import units
from solver.results.told import json_numbers
from solver.scene.scene import Scene
from solver.scene.scene_harmonics import even_harmonics_reason
from solver.sensitivity.observed import TWO_PI, Observed, ObservedSensitivities, Quantity

NOT_REACHED = -1


class ResponseModel(RunModel):
    """A response at given frequencies over parameter values.

    Parameters
    ----------
    scene : with the measured DOF observed.
    conditions : parameter paths and values of the run.
    paths : by which derivatives are wanted.
    frequency_hz : (m,) in the order of the sweep.
    quantity, harmonic : what was measured.
    harmonics : highest harmonic of the balance.
    near : (m, parts) measured values, by which branches are told apart; NaN where there are none.
    """

    def __init__(
        self, scene: Scene, conditions: Mapping[str, float], paths: Sequence[str], *, frequency_hz: Real,
        quantity: Quantity, harmonic: int, harmonics: int, near: Real,
    ) -> None:  # fmt: skip
        self._scene, self._conditions, self._paths = scene, dict(conditions), tuple(paths)
        self._hertz, self._quantity, self._harmonic = frequency_hz, quantity, harmonic
        self._harmonics, self._near = max(harmonics, harmonic), near
        self._effects = Effects(even_harmonics=even_harmonics_reason(scene, self._paths) is not None)
        self._solutions: list[Real | None] = [None] * frequency_hz.size

    def forget(self) -> None:
        """As the base says."""
        self._solutions = [None] * self._hertz.size

    def evaluate(self, values: Mapping[str, float]) -> Predicted:
        """As the base says."""
        here = self._scene.with_values({**values, **self._conditions})
        balance = build(here, harmonics=self._harmonics, effects=self._effects)
        seen = ObservedSensitivities(balance, self._paths)
        if all(known is None for known in self._solutions) and not is_unique(balance):
            self.unique = False
            self._choose_branches(here, seen)
        parts = self._near.shape[1]
        found_values = np.full((self._hertz.size, parts), np.nan)
        slopes = np.full((self._hertz.size, parts, len(self._paths)), np.nan)
        states = np.full((self._hertz.size, len(balance.scene.contacts)), NOT_REACHED)
        before: Real | None = None
        for i, hertz in enumerate(self._hertz.tolist()):
            found, before = self._point(seen, i, hertz, before)
            if found is not None:
                found_values[i], slopes[i], states[i] = found.values, found.slopes, found.states
        reached = np.isfinite(slopes).all(axis=(1, 2)) & np.isfinite(found_values).all(axis=1)
        names = [contact.name for contact in balance.scene.contacts]
        return Predicted(
            values=found_values.ravel(), slopes=slopes.reshape(found_values.size, -1),
            reached=np.repeat(reached, parts), states={name: states[:, c] for c, name in enumerate(names)},
        )  # fmt: skip

    def _point(
        self, seen: ObservedSensitivities, i: int, hertz: float, before: Real | None
    ) -> tuple[Observed | None, Real | None]:
        """Return what is measured at a point, and its solution (the one before where there is none)."""
        size = seen.balance.n_unknowns
        guesses = tuple(u for u in (self._solutions[i], before) if u is not None and u.size == size)
        solution = seen.solve(hertz, guesses)
        if not solution.converged:
            return None, before
        self._solutions[i] = solution.u
        return seen.observed(solution.u, hertz, self._quantity, self._harmonic), solution.u

    def _choose_branches(self, scene: Scene, seen: ObservedSensitivities) -> None:
        """Keep the solution nearest to the data of those the branch has at each frequency."""
        low, high = float(self._hertz.min()), float(self._hertz.max())
        branch = sweep(
            scene, start=low, stop=high, harmonics=self._harmonics, effects=self._effects,
            settings=ContinuationSettings(errors=False),
        )  # fmt: skip
        points = branch.solutions
        for i, hertz in enumerate(self._hertz.tolist()):
            ahead = points[:, -1] - TWO_PI * hertz
            crossed = np.flatnonzero(ahead[:-1] * ahead[1:] <= 0.0)
            best = np.inf
            for k in crossed.tolist():
                share = ahead[k] / (ahead[k] - ahead[k + 1]) if ahead[k] != ahead[k + 1] else 0.0
                guess = (1.0 - share) * points[k, :-1] + share * points[k + 1, :-1]
                found = seen.workspace.solve_from(TWO_PI * hertz, np.ascontiguousarray(guess))
                distance = self._distance(seen, found.u, i, hertz) if found.converged else np.inf
                if distance < best:
                    best, self._solutions[i] = distance, found.u

    def _distance(self, seen: ObservedSensitivities, u: Real, i: int, hertz: float) -> float:
        """Return how far a solution is from what was measured; of nothing measured the highest is nearest."""
        found = seen.observed(u, hertz, self._quantity, self._harmonic)
        if found is None:
            return np.inf
        if np.isnan(self._near[i]).any():
            return -float(np.linalg.norm(found.values))
        return float(np.linalg.norm(found.values - self._near[i]))


def measured_dof(scene: Scene, table: Table) -> str:
    """Return the DOF that the head says was measured; the one the scene observes without it.

    Raises
    ------
    DataError
        The scene has none of that name.
    """
    dof = table.words.get("dof", scene.observe.dof)
    if scene.seen(dof) is None:
        raise table.refusal(dof, f"`dof` must be one of {', '.join(scene.dofs)}")
    return dof


def observing_dof(scene: Scene, dof: str) -> Scene:
    """Return the scene that observes a DOF."""
    if dof == scene.observe.dof:
        return scene
    return scene.model_copy(update={"observe": scene.observe.model_copy(update={"dof": dof})})


_FAR = 20.0  # ratio to the scene's band from which a frequency is taken for a wrong unit
_MOST_DEGREES = 720.0
_WORDS = {
    "dof": "Degree of freedom that was measured; the one the scene observes.",
    "harmonic": "Which harmonic the amplitude is of; 1.",
}


@dataclass(frozen=True, slots=True, kw_only=True)
class ResponseRun(MeasuredRows):
    """A response over frequency."""

    frequency_hz: Annotated[Real, "In the order of the sweep, (m,)."]
    data: Annotated[
        Real | Complex,
        "Displacements [m], (m,); complex of `Quantity.COMPLEX`, with the phase of an excitation of phase 0.",
    ]
    sd: Annotated[
        Real | None,
        "Standard deviation of each, of a complex one of its real and its imaginary part [m], (m,).",
    ]
    quantity: Annotated[Quantity, "What was measured."]
    harmonic: Annotated[int, "Of an amplitude or a complex one."]
    dof: Annotated[str, "Where."]

    @property
    def parts(self) -> int:
        """Observations of a point."""
        return 2 if self.quantity is Quantity.COMPLEX else 1

    @property
    def observations(self) -> Real:
        """Amplitudes, or real and imaginary part of each point in turn, (n,) [m]."""
        if self.quantity is Quantity.COMPLEX:
            return np.column_stack([self.data.real, self.data.imag]).ravel()
        return np.asarray(self.data.real)

    @property
    def given_noise(self) -> Real | None:
        """As the base says."""
        return None if self.sd is None else np.repeat(self.sd, self.parts)

    def curves(self, values: Real) -> Sequence[Real]:
        """As the base says: amplitudes, or real and imaginary parts, over the frequency."""
        return tuple(values.reshape(-1, self.parts).T)

    def sizes(self, values: Real) -> Real:
        """Return the amplitude of each point, (m,), of observations."""
        return np.asarray(np.linalg.norm(values.reshape(-1, self.parts), axis=1))

    def noise_shape(self, values: Real) -> Real:
        """The amplitude, but no less than `FLOOR` of the largest."""
        sizes = self.sizes(values)
        return np.repeat(np.maximum(sizes, FLOOR * float(np.nanmax(sizes))), self.parts)

    def model(self, scene: Scene, paths: Sequence[str], harmonics: int) -> RunModel:
        """As the base says."""
        return ResponseModel(
            observing_dof(scene, self.dof), self.conditions, paths, frequency_hz=self.frequency_hz,
            quantity=self.quantity, harmonic=self.harmonic, harmonics=harmonics,
            near=self.observations.reshape(-1, self.parts),
        )  # fmt: skip

    def thinned(self, most: int) -> ResponseRun:
        """Points evenly taken, the highest always."""
        m = self.frequency_hz.size
        if m <= most:
            return self
        kept = np.unique(
            np.append(np.linspace(0, m - 1, most).round().astype(int), np.abs(self.data).argmax())
        )
        return self._rows(kept)

    def under(self, conditions: Mapping[str, float], most: int) -> ResponseRun:
        """As the base says, with nothing known of the amplitudes."""
        kept = np.unique(np.linspace(0, self.frequency_hz.size - 1, most).round().astype(int))
        run = self._rows(kept)
        nothing = np.full(kept.size, np.nan) * (1j if self.parts == 2 else 1.0)
        return replace(run, conditions={**self.conditions, **conditions}, data=nothing, sd=None)

    def _rows(self, kept: np.ndarray) -> ResponseRun:
        return replace(
            self, frequency_hz=self.frequency_hz[kept], data=self.data[kept],
            sd=None if self.sd is None else self.sd[kept],
        )  # fmt: skip

    def to_json(self, fitted: Real, sd: Real) -> dict[str, object]:
        """Amplitudes over frequency; of complex data with phases [deg]."""
        size = self.sizes(fitted)
        parts = fitted.reshape(-1, self.parts)
        with np.errstate(invalid="ignore", divide="ignore"):
            along = np.where(size[:, None] > 0.0, parts / size[:, None], 1.0)
        spread = np.sqrt(np.sum((along * sd.reshape(-1, self.parts)) ** 2, axis=1))
        told: dict[str, object] = {
            "kind": KIND.name, "source": self.source, "conditions": dict(self.conditions), "dof": self.dof,
            "quantity": self.quantity.value, "x": self.frequency_hz.tolist(),
            "data": np.abs(self.data).tolist(), "fit": json_numbers(size), "fit_sd": json_numbers(spread),
        }  # fmt: skip
        if self.parts == 2:
            told["phase_deg"] = np.degrees(np.angle(self.data)).tolist()
            told["fit_phase_deg"] = json_numbers(np.degrees(np.arctan2(parts[:, 1], parts[:, 0])))
        return told


def read_response(scene: Scene, table: Table) -> MeasuredRows:
    """As `DataKind.read` says."""
    table.need(2, "points")
    check_sign(table, "frequency", positive=True)
    check_monotone(table, "frequency")
    frequencies = table.columns["frequency"]
    # Frequencies far from those the scene is looked at over are of another unit, most likely.
    low, high = scene.observe.band
    far = np.flatnonzero((frequencies < low / _FAR) | (frequencies > high * _FAR))
    if far.size:
        wanted = (
            f"must be near the scene's band, {units.span(low, high, 'Hz')}: give the unit in the head of the "
            "column, `frequency [kHz]`, `[rad/s]` or `[1/min]`"
        )
        raise table.error(int(far[0]), "frequency", wanted)
    quantity, column, data = _data(table)
    here = scene.with_values(dict(table.conditions))
    unit = table.units.get(column)
    _check_units(table, column)
    if unit is not None and unit.per_force and here.excitation[0].base is not None:
        raise table.refusal(column, "is by a force: the scene's base moves", column)
    if unit is not None and (unit.order or unit.per_force):
        if quantity in (Quantity.MAX_ABS, Quantity.HALF_PEAK_TO_PEAK):
            wanted = "must be a displacement: velocities and accelerations do for `amplitude`, `real`, `imag`"
            raise table.refusal(column, wanted, column)
        spin = 2.0j * math.pi * frequencies * table.number("harmonic", 1.0)
        factor = (here.value("excitation.amplitude") if unit.per_force else 1.0) / spin**unit.order
        data = data * (factor if quantity is Quantity.COMPLEX else np.abs(factor))
    sd = table.columns.get("sd")
    if sd is not None:
        check_sign(table, "sd", positive=True)
        if unit is not None and (unit.order or unit.per_force):
            sd = sd * np.abs(factor)
    if quantity is Quantity.COMPLEX:
        data = data * np.exp(1j * here.value("excitation.phase") * table.number("harmonic", 1.0))
    dof = measured_dof(scene, table)
    return ResponseRun(
        source=table.source, conditions=dict(table.conditions), frequency_hz=frequencies, data=data, sd=sd,
        quantity=quantity, harmonic=int(table.number("harmonic", 1.0)), dof=dof,
    )  # fmt: skip


def _check_units(table: Table, column: str) -> None:
    """Refuse parts and deviations of another derivative than what was measured, or by a force alone."""
    unit = table.units.get(column)
    for other in ("imag", "sd"):
        its = table.units.get(other)
        if (
            unit is not None
            and its is not None
            and (its.order, its.per_force) != (unit.order, unit.per_force)
        ):
            wanted = f"must be in a unit as that of `{column}`: both displacements, or both by a force"
            raise table.refusal(other, wanted, other)


def _data(table: Table) -> tuple[Quantity, str, Real | Complex]:
    """Return what was measured, the column that says so, and its numbers."""
    columns = table.columns
    has = [group for group in KIND.marks if all(name in columns for name in group)]
    measured = {name for group in has for name in group} - {"frequency"}
    if len(has) != 1:
        wanted = "must have one of: amplitude (and phase), real and imag, max_abs, half_peak_to_peak"
        raise table.refusal(", ".join(sorted(measured)) or ", ".join(columns), wanted)
    if "real" in measured:
        return Quantity.COMPLEX, "real", columns["real"] + 1j * columns["imag"]
    (name,) = measured
    check_sign(table, name, positive=False)
    if "phase" not in columns:
        return Quantity(name), name, columns[name]
    if name != "amplitude":
        raise table.refusal(f"phase beside {name}", "a phase goes with `amplitude`")
    far = np.flatnonzero(np.abs(columns["phase"]) > _MOST_DEGREES)
    if far.size:
        raise table.error(int(far[0]), "phase", f"must be from -{_MOST_DEGREES:g} to {_MOST_DEGREES:g} deg")
    return Quantity.COMPLEX, name, columns[name] * np.exp(1j * np.radians(columns["phase"]))


KIND = DataKind(
    name="response",
    help="Amplitude, or amplitude and phase, over frequency: stepped or slow sine sweeps.",
    columns=(
        Column("frequency", Dimension.FREQUENCY, "Of the excitation."),
        Column(
            "amplitude",
            Dimension.MOTION,
            "Of one harmonic of the motion, the first unless `harmonic` says; `harmonic_3`: of the third.",
        ),
        Column("phase", Dimension.ANGLE, "By which that harmonic is ahead of the excitation."),
        Column("real", Dimension.MOTION, "Real part of the same, x = Re(x̂ e^{iωt}) under a force F cos ωt."),
        Column("imag", Dimension.MOTION, "Its imaginary part."),
        Column("max_abs", Dimension.MOTION, "Largest displacement of the period, as `solve` has it."),
        Column("half_peak_to_peak", Dimension.MOTION, "Half the range of the displacement."),
        Column("sd", Dimension.MOTION, "Standard deviation of each point, if it is known."),
    ),
    marks=(
        ("frequency", "amplitude"),
        ("frequency", "real", "imag"),
        ("frequency", "max_abs"),
        ("frequency", "half_peak_to_peak"),
    ),
    words=_WORDS,
    read=read_response,
)
