"""The study `modes`: frequency and damping ratio of a mode over its amplitude, and what it does there."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from functools import cache
from typing import TYPE_CHECKING, Annotated, Any

from pydantic import BaseModel, Field, RootModel

import solver
from service.jobs.common.result_models import Table, answered
from service.jobs.common.scene_requests import HarmonicRequest, Number, PositiveNumber, check
from service.jobs.common.sizes import MOST_MOTIONS, POINTS_OF_A_SWEEP, balance_issues
from service.jobs.common.study_keys import CERTIFICATES, of_keys, prepare, with_certificates
from service.jobs.kind_registry import Flag, Json, ReadSweep, StoredSweep
from service.jobs.study import Answer, Proposed, Question, Study, Watch, rounded
from solver.errors import Issue, Naming
from solver.lab import from_lab

if TYPE_CHECKING:
    from matplotlib.figure import Figure

    from solver.results.told import Told
    from solver.scene.scene import AnyContact, Scene


MOST_CONTACTS = 40
MOST_DOFS = 400
SAMPLES = 97
"""Of a loop, its first again at the end."""
FAR = 100.0
_MODAL = (1e-7, 1e-3)  # √kg m, where nothing says at which motion contacts begin to slip
_AROUND_SLIP = (0.05, 300.0)
_EXACT_PEAKS = 8
_AMPLITUDE = "excitation.amplitude"


def motions_of(found: solver.NonlinearMode) -> dict[str, Any]:
    """Hysteresis loops of the contacts and the shape of the mode at some points, evenly along the curve.

    Returns
    -------
    `points` are numbers of points of the curve. `loops` have for each of those motion [m] and force [N] of a
    contact over one period, its first sample again at the end. `shapes` have for each the real and the
    imaginary parts of harmonic 1 of the degrees of freedom `dofs` over the amplitude [1/√kg]. Of more
    contacts or degrees of freedom than fit, the first are given.
    """
    import numpy as np

    count = found.amplitude.size
    points = [int(i) for i in np.unique(np.linspace(0, max(count - 1, 0), min(count, MOST_MOTIONS)).round())]
    points = points if count else []
    loops = []
    for name in found.contact_names[:MOST_CONTACTS]:
        pairs = [found.loop(i, name, samples=SAMPLES - 1) for i in points]
        loops.append({
            "contact": name,
            "motion": [[*motion.tolist(), float(motion[0])] for motion, _ in pairs],
            "force": [[*force.tolist(), float(force[0])] for _, force in pairs],
        })  # fmt: skip
    shapes = [found.shape(i)[:MOST_DOFS] for i in points]
    return {
        "points": points,
        "loops": loops,
        "dofs": list(found.scene.dofs[:MOST_DOFS]),
        "shapes": {"real": [s.real.tolist() for s in shapes], "imag": [s.imag.tolist() for s in shapes]},
    }


def excitations(curve: solver.PerformanceCurve, band: Sequence[float], count: int) -> list[float]:
    """Factors on the excitation, evenly in their logarithms, whose peaks the curve has within a band [Hz].

    At most a hundred times more or less than the scene's own, as far as the curve has that.
    """
    import numpy as np

    inside = (curve.excitation > 0.0) & (curve.frequency_hz > band[0]) & (curve.frequency_hz < band[1])
    near = inside & (curve.excitation >= 1.0 / FAR) & (curve.excitation <= FAR)
    inside = near if near.any() else inside
    factors = curve.excitation[inside]
    if not factors.size:
        return []
    return [float(f) for f in np.geomspace(factors.min(), factors.max(), count)]


def exact_peaks(
    found: solver.NonlinearMode, curve: solver.PerformanceCurve, count: int, watch: Watch
) -> list[dict[str, Any]]:
    """The highest peak of the whole response at so many factors on the excitation; null where it has none.

    What was not computed when it was to end is left out.
    """
    told: list[dict[str, Any]] = []
    own = found.scene.value(_AMPLITUDE)
    factors = excitations(curve, found.scene.observe.band, count)
    for i, factor in enumerate(factors):
        if watch.should_stop is not None and watch.should_stop():
            break
        branch = solver.sweep(
            found.scene.with_values({_AMPLITUDE: factor * own}), harmonics=found.n_harmonics,
            **watch.part(i / len(factors), (i + 1) / len(factors))._asdict(),
        )  # fmt: skip
        peak = branch.peak if branch.reached else None
        told.append({
            "excitation": factor,
            "peak": None if peak is None else peak.value,
            "frequency": None if peak is None else peak.at,
            "status": branch.status.value,
        })  # fmt: skip
    return told


_MOST_PEAKS = 40
_POINTS = 200  # a curve seldom has more
_OF_THE_CURVE = 0.3  # share of the progress, where exact peaks follow
Diameter = Annotated[int, Field(strict=True, ge=-10_000, le=10_000)]
_Ratio = Annotated[Number, Field(ge=-10.0, le=10.0)]


_FURTHER: dict[str, Any] = dict.fromkeys(("performance", "limit_cycles", "motions"), (Table | None, None))
_FURTHER["certificates"] = CERTIFICATES


def _slip(contact: AnyContact) -> float:
    """Return the motion at which a contact begins to slip [m]; 0 if its law does not say it."""
    friction, stiffness = (getattr(contact, key, 0.0) for key in ("mu", "kt"))
    if contact.load is None or not stiffness:
        return 0.0
    return float(friction * contact.load.mean / stiffness)


@cache
def modes_result() -> type[BaseModel]:
    """Return the schema of a nonlinear mode, or of the forced responses with `phase_resonance`."""
    one: Any = answered("solver.modes.mode_results:NonlinearMode", "NonlinearModeResult", **_FURTHER)()
    other: Any = answered("solver.modes.mode_results:PhaseResonance", "PhaseResonanceResult")()

    class ModesResult(RootModel[one | other]):
        """A nonlinear mode; with `phase_resonance` the forced responses."""

    return ModesResult


class Modes(Study, HarmonicRequest):
    """Follow a mode's frequency and damping over its amplitude.

    The modal amplitude a is mass-normalised: a² = Σ Q_kᴴ M Q_k over the harmonics, of one sector of a disk.
    """

    EXAMPLES = ({"scene": "two-dof", "mode": 1, "from": 0.01, "to": 100},)
    NAME, FUNCTION, RESULT = "modes", "solver:nonlinear_mode", modes_result
    ASKS = Question("How do frequency and damping change with amplitude?", "rig", 10_000)
    TOLD = "solver.views.tables.disks:mode"
    SHOWS = "frequency and damping ratio over the amplitude ([modes](modes.md))"
    EMPTY = ("amplitude", "no point of the mode was found")

    mode: Annotated[int, Field(strict=True, ge=1, le=100_000), Flag(metavar="N")] = Field(
        default=1, description="Which mode, 1 the slowest, contacts as they are at rest."
    )
    start: Annotated[PositiveNumber, Flag(metavar="A")] = Field(
        alias="from", description="Smallest modal amplitude [√kg m]."
    )
    stop: Annotated[PositiveNumber, Flag(metavar="B")] = Field(
        alias="to", description="Largest modal amplitude [√kg m]."
    )
    nodal_diameter: Annotated[Diameter | None, Flag(metavar="N")] = Field(
        default=None, description="Of a disk, negative for a backward wave; that of the engine order."
    )
    performance: Annotated[bool, Field(strict=True)] = Field(
        default=False, description="Resonance peaks over excitation and load too, from the one mode."
    )
    aero_damping: Annotated[_Ratio | None, Flag("--aero", "ZETA")] = Field(
        default=None, description="Aerodynamic damping ratio, below 0 if it feeds: the limit cycles too."
    )
    mode_alone: Annotated[bool, Field(strict=True)] = Field(
        default=False, description="With `aero_damping`: the gas feeds this mode alone, not every one."
    )
    motions: Annotated[bool, Field(strict=True)] = Field(
        default=False, description=f"Loops and shapes of up to {MOST_MOTIONS} points too."
    )
    exact_peaks: Annotated[int, Field(strict=True, ge=0, le=_MOST_PEAKS), Flag(metavar="N")] = Field(
        default=0, description="With `performance`: of so many excitations the whole response as well."
    )
    disturbance: Annotated[PositiveNumber | None, Flag(metavar="A")] = Field(
        default=None, description="Modal amplitude [√kg m] that is to die down: the least loads that do it."
    )
    certify: Annotated[bool, Field(strict=True)] = Field(
        default=False, description="Prove the limit cycles, where contacts are piecewise linear."
    )
    phase_resonance: Annotated[bool, Field(strict=True)] = Field(
        default=False,
        description="In place of the mode the forced responses that lag by 90°: which force each takes.",
    )

    @classmethod
    def propose(cls, scene: Scene) -> Proposed | str:
        """Amplitudes around the one at which the contacts begin to slip, as far as the scene says it."""
        slips = [one for one in map(_slip, scene.contacts) if one > 0.0]
        masses = [float(mass.m) for mass in getattr(scene.structure, "masses", ())]
        ends, known = _MODAL, bool(slips and masses)
        if known:
            root = math.sqrt(sum(masses))
            ends = (_AROUND_SLIP[0] * min(slips) * root, _AROUND_SLIP[1] * max(slips) * root)
        low, high = (rounded(end, 2) for end in ends)
        more = {"performance": True, "motions": True, "exact_peaks": _EXACT_PEAKS}
        return Proposed({"from": low, "to": high, **more}, () if known else ("from", "to"))

    def issues(self, scene: Scene) -> list[Issue]:
        """Return which questions do not go together, and what is wrong with the mode."""
        from solver.modes.nonlinear_mode import at_nodal_diameter, check_mode

        fed = self.aero_damping is not None
        apart = self.phase_resonance and (self.performance or fed)
        words = (
            ("exact_peaks", bool(self.exact_peaks and not self.performance),
             f"needs {{performance}}, which is false here, got {self.exact_peaks!r}"),
            ("from", self.start <= 0.0, f"must be greater than 0, got {self.start!r}"),
            ("to", self.start >= self.stop,
             f"must be above {{from}} = {self.start!r} √kg m, got {self.stop!r}"),
            ("disturbance", self.disturbance is not None and not fed,
             "needs {aero_damping}: without gas that feeds, every disturbance dies down"),
            ("mode_alone", self.mode_alone and not fed, "needs {aero_damping}: it says what the gas feeds"),
            ("certify", self.certify and not fed, "needs {aero_damping}: limit cycles are what is proved"),
            ("phase_resonance", apart, "is a curve of its own: leave {performance} and {aero_damping} out"),
        )  # fmt: skip
        wrong = [Issue((key,), Naming(said)) for key, bad, said in words if bad]
        wrong += (
            of_keys(
                check(lambda: from_lab("limit_cycles.limit_cycles:check_loads")(scene)), (), "aero_damping"
            )
            if fed
            else []
        )
        return wrong + check(lambda: check_mode(at_nodal_diameter(scene, self.nodal_diameter), self.mode))

    def sizes(self, scene: Scene) -> list[Issue]:
        """Return what is too large."""
        points = _POINTS + POINTS_OF_A_SWEEP * self.exact_peaks
        return balance_issues("harmonics", scene, self.harmonics, points)

    @classmethod
    def compute(cls, scene: Scene, asked: Mapping[str, Any], watch: Watch) -> Answer:
        """Follow the mode, or the phase resonances, and answer what else is asked of it."""
        import solver

        if asked.get("certify"):
            prepare(scene, rigid=False)
        given = {key: asked[key] for key in ("mode", "nodal_diameter", "harmonics") if key in asked}
        given["amplitudes"] = (asked["start"], asked["stop"])
        if asked.get("phase_resonance"):
            resonances = solver.phase_resonance(scene, **given, **watch._asdict())
            return Answer.of(resonances)
        of_peaks = asked.get("exact_peaks", 0)
        found = solver.nonlinear_mode(
            scene, **given, **watch.part(0.0, _OF_THE_CURVE if of_peaks else 1.0)._asdict()
        )
        answer = Answer.of(found)
        if asked.get("performance"):
            curve = solver.performance_curve(found)
            answer = answer.beside(curve, performance=curve.to_json())
            if of_peaks:
                rest = watch.part(_OF_THE_CURVE, 1.0, len(found.amplitude))
                answer.json["performance"]["exact"] = exact_peaks(found, curve, of_peaks, rest)
        if (ratio := asked.get("aero_damping")) is not None:
            cycles = solver.limit_cycles(found, ratio, mode_alone=asked.get("mode_alone", False))
            answer.json["limit_cycles"] = cycles.to_json(asked.get("disturbance"))
            if asked.get("certify"):
                stop = watch.should_stop
                proofs = [
                    solver.certify_cycle(scene, each, ratio, should_stop=stop) for each in cycles.cycles
                ]
                answer = with_certificates(answer, proofs)
        if asked.get("motions"):
            answer.json["motions"] = motions_of(found)
        return answer

    @classmethod
    def result_class(cls, result: Json) -> type[Told]:
        """Return the class of a mode, or of phase resonances."""
        return solver.PhaseResonance if "excitation" in result else super().result_class(result)

    @classmethod
    def figure(cls, result: Json, _sweeps: Sequence[StoredSweep], _read: ReadSweep) -> Figure:
        """Return frequency and damping ratio over the amplitude, or frequency and force of resonances."""
        from solver.views.plots.disks import mode_figure, resonance_figure

        return mode_figure(result) if result.get("damping_ratio") is not None else resonance_figure(result)
