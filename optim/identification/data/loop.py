"""The kind `loop`: a hysteresis loop of one contact, its force over its motion, in a steady period.

Motion and force become Fourier coefficients; the law is asked for the force under that motion, and what both
have in common is the same band of harmonics, so that leaving out the higher ones biases nothing. Means are
not compared: sensors drift, and the mean force of a contact that sticks depends on its history.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Annotated, ClassVar

import numpy as np

from optim.identification.data.measured import Column, DataKind, MeasuredRows, Predicted, RunModel
from optim.identification.data.measured_table import Dimension, Table, check_monotone
from optim.problem.variables import Real
from solver.balance.balance import build
from solver.balance.simplifications import Effects
from solver.jit import fourier
from solver.jit.fourier import from_full, to_full
from solver.results import units
from solver.scene.scene import Scene
from solver.sensitivity.observed import LoopSensitivities

FEWEST = 16
_HIGHEST = 63  # harmonics of a loop that are compared
_OVER_NOISE = 4.0  # times the noise of its coefficients from which a harmonic of the motion is kept
_BACKWARD = 0.02  # of the area of the loop's box by which it may turn the wrong way
_WORDS = {
    "contact": "Name of the contact; needed where the scene has several.",
    "frequency": "Of the motion [Hz]; the middle of the scene's band.",
}


@dataclass(frozen=True, slots=True, kw_only=True)
class LoopRun(MeasuredRows):
    """A hysteresis loop."""

    contact: Annotated[str, "Name of the contact."]
    frequency_hz: Annotated[float, "Of the motion."]
    motion: Annotated[Real, "Coefficients of the motion [m], (2H + 1,)."]
    force: Annotated[Real, "Coefficients of the measured force [N], (2H + 1,)."]
    samples: Annotated[int, "They were made of."]
    sd: Annotated[float | None, "Standard deviation of a sample of the force [N]."]

    UNIT_WORDS: ClassVar = "forces [N]"

    @property
    def scale(self) -> float:
        """What a coefficient is multiplied by to have the noise of a sample, √(samples/2)."""
        return math.sqrt(0.5 * self.samples)

    @property
    def observations(self) -> Real:
        """The coefficients of the force but for the mean, times `scale`, (2H,) [N]."""
        return self.scale * self.force[1:]

    @property
    def given_noise(self) -> Real | None:
        """As the base says."""
        return None if self.sd is None else np.full(self.force.size - 1, self.sd)

    def noise_shape(self, values: Real) -> Real:
        """The largest force of the loop, for all alike."""
        waves = fourier.basis(_angles(256), (values.size) // 2)[:, 1:] @ (values / self.scale)
        return np.full(values.size, float(np.abs(waves).max()))

    def model(self, scene: Scene, paths: Sequence[str], harmonics: int) -> RunModel:  # noqa: ARG002
        """As the base says; the harmonics of a loop are its own."""
        return _LoopModel(self, scene, tuple(paths))

    def thinned(self, most: int) -> LoopRun:
        """Fewer harmonics."""
        kept = 2 * min((self.force.size - 1) // 2, max(most, 3)) + 1
        return replace(self, motion=self.motion[:kept], force=self.force[:kept])

    def under(self, conditions: Mapping[str, float], most: int) -> LoopRun:
        """The same motion under other conditions."""
        run = replace(self.thinned(max(most, 15)), conditions={**self.conditions, **conditions}, sd=None)
        return replace(run, force=np.full(run.force.size, np.nan))

    def to_json(self, fitted: Real, sd: Real) -> dict[str, object]:
        """Force over motion at instants of a period, both without their means."""
        tau = _angles(128)
        basis = fourier.basis(tau, (self.force.size - 1) // 2)[:, 1:]
        band = np.sqrt((basis**2) @ (sd / self.scale) ** 2)
        return {
            "kind": KIND.name, "source": self.source, "conditions": dict(self.conditions),
            "contact": self.contact, "x": (basis @ self.motion[1:]).tolist(),
            "data": (basis @ self.force[1:]).tolist(), "fit": (basis @ (fitted / self.scale)).tolist(),
            "fit_sd": band.tolist(),
        }  # fmt: skip


class _LoopModel(RunModel):
    """The force of the law under the measured motion."""

    def __init__(self, run: LoopRun, scene: Scene, paths: tuple[str, ...]) -> None:
        self._run, self._scene, self._paths = run, scene, paths
        self._highest = (run.force.size - 1) // 2

    def evaluate(self, values: Mapping[str, float]) -> Predicted:
        """As the base says."""
        run, paths = self._run, self._paths
        here = self._scene.with_values({**values, **run.conditions})
        balance = build(here, harmonics=self._highest, effects=Effects(even_harmonics=True))
        ks = balance.system.ks
        motion = from_full(run.motion, ks)
        found = LoopSensitivities(balance, run.contact, paths).force(motion, 2.0 * math.pi * run.frequency_hz)
        n = run.force.size - 1
        if found is None:
            return Predicted.nothing(n, len(paths))
        force, slopes, state = found
        full, by = (to_full(each, ks, int(ks[-1]))[..., 1 : n + 1] for each in (force, slopes))
        return Predicted(
            values=run.scale * full, slopes=run.scale * by.T, reached=np.ones(n, bool),
            states={run.contact: np.array([state])},
        )  # fmt: skip


def read_loop(scene: Scene, table: Table) -> MeasuredRows:
    """As `DataKind.read` says."""
    table.need(FEWEST, "samples of one period")
    counts = scene.port_counts
    names = [each.name for each, count in zip(scene.contacts, counts, strict=True) if count == 1]
    contact = table.words.get("contact", names[0] if len(names) == 1 else "")
    if contact not in names:
        raise table.refusal(contact, f"`contact` must say whose loop it is, one of {', '.join(names)}")
    low, high = scene.observe.band
    frequency = table.number("frequency", 0.5 * (low + high))
    tau = _phases(table, frequency)
    highest = min(_HIGHEST, (len(table) - 1) // 3)
    basis = fourier.basis(tau, highest)
    motion, force = (
        np.asarray(np.linalg.lstsq(basis, table.columns[name], rcond=None)[0], np.float64)
        for name in ("motion", "force")
    )
    # Harmonics of the motion that stand above its noise, judged by its upper half.
    pairs = motion[1:].reshape(-1, 2)
    noise = float(np.sqrt(np.mean(pairs[pairs.shape[0] // 2 :] ** 2)))
    kept = np.linalg.norm(pairs, axis=1) > _OVER_NOISE * noise
    kept[0] = True
    motion = np.append(motion[0], (pairs * kept[:, None]).ravel())
    # A loop that feeds energy is refused: friction dissipates, ∮ f du > 0.
    u, f = motion[1:].reshape(-1, 2), force[1:].reshape(-1, 2)
    area = math.pi * float(np.sum(np.arange(1, len(u) + 1) * (f[:, 0] * u[:, 1] - f[:, 1] * u[:, 0])))
    box = 4.0 * float(np.linalg.norm(u) * np.linalg.norm(f))
    if box == 0.0 or area < -_BACKWARD * box:
        wanted = (
            "must be a loop that dissipates, ∮ force d(motion) > 0: look at the signs of force and motion"
        )
        raise table.refusal(units.quantity(area, "J"), wanted)
    sd = table.columns.get("loop_sd")
    return LoopRun(
        source=table.source, conditions=dict(table.conditions), contact=contact, frequency_hz=frequency,
        motion=motion, force=force, samples=len(table), sd=None if sd is None else float(np.mean(sd)),
    )  # fmt: skip


def _phases(table: Table, frequency: float) -> Real:
    """Return the angles of the samples in their period: even without times."""
    if "time" not in table.columns:
        return _angles(len(table))
    check_monotone(table, "time")
    time = table.columns["time"]
    tau = 2.0 * math.pi * frequency * (time - time[0])
    gaps = np.diff(np.sort(np.append(np.mod(tau, 2.0 * math.pi), 2.0 * math.pi)))
    if gaps.max() > 0.25 * math.pi:
        wanted = (
            f"must be sampled over a whole period, 1/frequency = {units.quantity(1.0 / frequency, 's')}, "
            "without gaps of an eighth of it: give the `frequency` of the motion in the head"
        )
        raise table.refusal(float(time[-1] - time[0]), wanted, "time")
    return np.asarray(tau)


def _angles(count: int) -> Real:
    return np.asarray(2.0 * math.pi / count * np.arange(count))


KIND = DataKind(
    name="loop",
    help="Force of one contact over its motion in one steady period, samples in the order of time.",
    columns=(
        Column("motion", Dimension.LENGTH, "Relative motion of the contact, as its `between` has it."),
        Column("force", Dimension.FORCE, "Friction force, with the sign of the motion while it sticks."),
        Column("time", Dimension.TIME, "Of each sample; without, they are evenly spaced over one period."),
        Column("loop_sd", Dimension.FORCE, "Standard deviation of the samples of the force, if it is known."),
    ),
    marks=(("motion", "force"),),
    words=_WORDS,
    read=read_loop,
)
