"""Branches: what continuation returns, with peaks, bands, marks and what is certain of them.

Only converged points are in them.
"""

from __future__ import annotations

import math
from abc import abstractmethod
from collections.abc import Iterable, Sequence
from dataclasses import dataclass, field
from enum import Enum
from typing import TYPE_CHECKING, Annotated, Any, ClassVar, Protocol

import numpy as np
from numpy.typing import NDArray

from solver.arrays import FloatOrNaN, Integer, Real
from solver.first_use import on_demand
from solver.results.base import Drawn, Views
from solver.results.known import NOTHING_DAMPS, Known, Note, Stable, Verdict
from solver.results.told import Piece
from solver.scene.scene import Scene

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

    from solver.balance.balance import Balance, Parameter


@dataclass(frozen=True, slots=True, kw_only=True, repr=False)
class Peak(Piece):
    """A local maximum of the amplitude along a branch, polished to the stationary point."""

    JSON: ClassVar = "value at"

    value: Annotated[float, "max|x| of the observed DOF [m]."]
    at: Annotated[float, "Parameter value there, in user units (Hz for a frequency)."]
    solution: Annotated[Real, "Slip motions of the contacts there [m], (n_unknowns,)."]
    interior: Annotated[bool, "A true maximum, not an end of the branch."]


@dataclass(frozen=True, slots=True, kw_only=True, repr=False)
class Edge(Piece):
    """An end of an interval in which the amplitude exceeds a limit: where it equals the limit, or a fold."""

    at: Annotated[float, "Parameter value, in user units."]
    solution: Annotated[Real, "Slip motions of the contacts there [m], (n_unknowns,)."]
    opens: Annotated[bool, "The interval begins here; otherwise it ends here."]
    fold: Annotated[bool, "The branch turns back here, above the limit."] = False
    corner: Annotated[bool, "It does so where a contact changes its state: the end has no derivative."] = (
        False
    )


@dataclass(frozen=True, slots=True, kw_only=True, repr=False)
class Band(Piece):
    """Where the amplitude exceeds a limit."""

    limit: Annotated[float, "The limit [m]."]
    width: Annotated[float, "Measure of {parameter : amplitude > limit}, in user units (Hz for a frequency)."]
    intervals: Annotated[tuple[tuple[float, float], ...], "Its intervals, ascending."]
    edges: Annotated[
        tuple[Edge, ...], "The interval ends inside the branch (an end of the range itself is not one)."
    ]
    known: Annotated[
        bool,
        "Wherever the amplitude may cross the limit between two points, that was settled by solutions; see "
        "also `Branch.peak_certificate`.",
    ] = True


@dataclass(frozen=True, slots=True, kw_only=True, repr=False)
class PeakCertificate(Piece):
    """What is known of the amplitude between the points of a branch.

    It is about the branch as it was computed, with its harmonics: what the harmonics left out may change is
    the error estimate, and another branch of a law that allows several is not on this one.
    """

    known: Annotated[
        bool,
        "No peak of the branch is higher than `bound`, and every peak above 1 % of the highest is listed.",
    ]
    reason: Annotated[str, "Why, or why it is not known."]
    bound: Annotated[
        float,
        "What the amplitude does not exceed between points [m]: of the cubics through them, which near the "
        "top are checked by their neighbours or by solutions between, and of the motion predicted at every "
        "resonance of the structure with its contacts that is narrower than the points are apart. NaN if "
        "not known.",
    ]
    widest_gap: Annotated[
        float, "Largest distance between neighbouring points, in units of the parameter (Hz for a frequency)."
    ]
    resonances: Annotated[int, "Narrow resonances between points that were solved for."]


def certified(*, bound: float, gap: float, resonances: int) -> PeakCertificate:
    """Return the certificate of a branch on which everything was settled."""
    solved = "" if resonances == 0 else f" {resonances} of them between points were solved for."
    reason = (
        "Every resonance of the structure with its contacts is as broad as the points are apart, or too "
        f"weakly driven to matter, or solved for.{solved}"
    )
    return PeakCertificate(known=True, reason=reason, bound=bound, widest_gap=gap, resonances=resonances)


def uncertain(why: str, gap: float = math.nan) -> PeakCertificate:
    """Return the certificate of a branch of which something is not known."""
    return PeakCertificate(
        known=False, reason=f"Not known: {why}.", bound=math.nan, widest_gap=gap, resonances=0
    )


def unsettled(certificates: Iterable[PeakCertificate]) -> list[str]:
    """Return why it is not known of some branches that no peak hides between points, each reason once."""
    return list(dict.fromkeys(one.reason for one in certificates if not one.known))


class MarkKind(Enum):
    """What happens at a mark; the value is what a user reads."""

    FOLD = "fold: the branch turns back in its parameter"
    BRANCH_POINT = "branch point: another branch leaves this one"
    PERIOD_DOUBLING = "period doubling: a motion of twice the period leaves this branch"
    TORUS = "torus: a second frequency grows (Neimark-Sacker)"
    END = "end: the branch goes no further"


@dataclass(frozen=True, slots=True, kw_only=True, repr=False)
class Mark(Piece):
    """A place on a branch."""

    kind: Annotated[MarkKind, "What happens there."]
    at: Annotated[float, "Parameter value, in user units."]
    amplitude: Annotated[float, "max|x| of the observed DOF there [m]."]
    solution: Annotated[Real, "Slip motions [m] with λ (inside unit) last, (n_unknowns + 1,)."]
    after: Annotated[int, "The point of the branch it comes behind."]
    corner: Annotated[bool, "Of a fold: a contact changes its state there."] = False
    why: Annotated[str, "Of an end: how the branch ended."] = ""

    def to_json(self) -> dict[str, object]:
        """Return the mark as one JSON object."""
        found: dict[str, object] = {
            "kind": self.kind.name.lower(), "at": self.at, "amplitude": self.amplitude, "after": self.after,
        }  # fmt: skip
        if self.kind is MarkKind.FOLD:
            found["corner"] = self.corner
        return {**found, "why": self.why} if self.why else found


@dataclass(frozen=True, slots=True, kw_only=True, repr=False)
class Bifurcations(Piece):
    """Stability along a branch, and its marks."""

    JSON: ClassVar = "known_by parameter_path=parameter unstable=stretches marks seconds"

    unstable: Annotated[
        NDArray[np.bool_], "Points at which a perturbation grows, as far as `known_by` sees, (P,)."
    ]
    marks: Annotated[tuple[Mark, ...], "In their order along the branch."]
    known_by: Annotated[
        str,
        "``uniqueness``: loads are given and everything takes out power, so that all points are stable; "
        "``determinant``: real perturbations of the same period alone are seen; ``multipliers``: all are.",
    ]
    parameter: Annotated[str, "Path of the parameter."]
    seconds: Annotated[float, "What it took."]

    @property
    def stretches(self) -> tuple[tuple[int, int], ...]:
        """First and last point of every stretch that is not stable."""
        changes = np.flatnonzero(np.diff(np.concatenate([[0], self.unstable.astype(int), [0]])))
        return tuple((int(first), int(last) - 1) for first, last in changes.reshape(-1, 2))

    def of_a_branch(self) -> dict[str, object]:
        """Return what the JSON object of a branch has of it."""
        return {
            "unstable": [list(stretch) for stretch in self.stretches],
            "marks": [mark.to_json() for mark in self.marks],
            "stability_known_by": self.known_by,
        }


class BranchStatus(Enum):
    """How a continuation ended; the value is a sentence a user can act on."""

    COMPLETED = "The branch reached the end of the range."
    NO_START = "No first solution was found: start somewhere else, or use more harmonics."
    STALLED = (
        "The steps became too small to go on: use more harmonics, or start from the other end of the range."
    )
    TURNED_BACK = "The branch turned and left the range where it began; the end of the range was not reached."
    ACCURACY_NOT_REACHED = (
        "The branch reached the end of the range, but the accuracy asked for was not reached with the most "
        "harmonics allowed: ask for less, or set the harmonics yourself."
    )
    STOPPED = "The continuation was stopped by the caller."
    TOO_MANY_POINTS = "The largest number of points was used up: allow more points or a larger step."
    TOO_HIGH = "The amplitude is far higher than what it is compared with: the branch was not followed on."
    TOO_STIFF = (
        "A contact is so much stiffer than the structure that what it deforms is lost in the rounding of its "
        "motion: lower kt. Above a million times the structure's stiffness the response no longer depends on "
        "it."
    )
    RATCHETS = (
        "Beyond the last point there is no periodic motion: a part that contacts alone hold ratchets, it "
        "drifts a little further every period. Press it harder, take away what pulls it to one side, or hold "
        "it by a spring."
    )
    UNDAMPED = NOTHING_DAMPS
    POWER_LOST = (
        "Beyond the last point the balance is satisfied as far as rounding shows, but the power put in is "
        "not what is dissipated: no such motion exists. Press parts that contacts alone hold harder, hold "
        "them by a spring, or lower kt."
    )
    RIGID_OPENS = (
        "Beyond the last point a contact with kn = inf opens under its load, and where it closes again is an "
        "impact, which takes a law of its own. Press it harder, or give it a finite kn."
    )
    NO_ORBIT = (
        "Beyond the last point no motion repeats that the events of the contacts were followed for: start "
        "from the other end of the range, or give some damping."
    )


ROWS = ("solutions", "tangents", "states", "observed", "measures")


@dataclass(frozen=True, slots=True, kw_only=True, repr=False)
class Points:
    """The rows of a branch, see `Branch`; of what is observed the coefficients of the harmonics kept."""

    solutions: Real
    tangents: Real
    states: Integer
    observed: Real
    measures: Real

    @classmethod
    def of(cls, branch: Any, **others: Real) -> Points:
        """Return the rows of what has them, some of them others."""
        rows: dict[str, Any] = {name: getattr(branch, name) for name in ROWS}
        return cls(**{**rows, **others})


class Posed(Protocol):
    """What a branch is of: the problem that each of its points solves."""

    @property
    def scene(self) -> Scene:
        """What vibrates, with the values that stayed fixed."""

    @property
    def parameter(self) -> Parameter:
        """What was continued in."""

    @property
    def n_harmonics(self) -> int:
        """The number asked for."""


@dataclass(frozen=True, slots=True, kw_only=True, repr=False)
class AnyBranch(Drawn):
    """Periodic responses over one parameter, P points in their order along it: what `sweep` returns.

    A `Branch` has them by continuation of a balance of harmonics, an `ExactBranch` by exact orbits.
    """

    VIEWS: ClassVar = Views("solver.views", "responses:branch", "of_branch", "branch_dataset")
    JSON: ClassVar = (
        "scene measured=scene.measured parameter=values parameter_path=parameter unit speed_rpm=speeds_rpm"
        " amplitude half_peak_to_peak mean peak peaks=interior_peaks stable=highest_stability.stable"
        " stable_ground=highest_stability.ground peaks_stable band_hz=band.width band_limit=band.limit"
        " band_intervals_hz=band.intervals band_known peak_certificate drift_per_period points=values.size"
        " n_harmonics error_estimate newton_iterations rejected_steps folds unstable marks"
        " stability_known_by mean_undetermined largest_residual seconds flags notes completed=reached status"
    )

    status: Annotated[BranchStatus, "How it ended."]
    start: Annotated[float, "First value of the range asked for, in user units."]
    stop: Annotated[float, "Last value of it."]
    values: Annotated[Real, "Parameter values in user units, (P,)."]
    observed: Annotated[
        Real, "Full coefficients of the observed DOF [m], zero where a harmonic is not kept, (P, 2H + 1)."
    ]
    measures: Annotated[
        Real,
        "Columns named in `solver.balance.kernels.output`; slopes are along the tangents. (P, MEASURES).",
    ]
    states: Annotated[
        Integer,
        "State of every contact, as in `solver.response.contact_response.ContactState`. (P, n_contacts).",
    ]
    peaks: Annotated[
        tuple[Peak, ...], "All local maxima, highest first; the ends of the branch are in it too."
    ]
    band: Annotated[
        Band | None,
        "Where the amplitude exceeds the limit asked for (peak/√2 if none was); None without a peak.",
    ]
    error_estimate: Annotated[
        FloatOrNaN, "Estimated error of the highest peak's value [m]; NaN without a peak."
    ]
    newton_iterations: Annotated[int, "Of all points."]
    rejected_steps: Annotated[int, "Steps that were tried again, shorter."]
    seconds: Annotated[float, "Time taken [s]."]
    peak_certificate: Annotated[
        PeakCertificate, "Why no higher peak hides between two points, or why that is not known."
    ]
    flags: Annotated[tuple[str, ...], "Names of what is to be known of it, see the classes."] = ()

    @property
    @abstractmethod
    def posed(self) -> Posed:
        """What its points solve."""

    @property
    @abstractmethod
    def coefficients(self) -> Real:
        """Coefficients of every relative motion of the contacts at each point, (P, n_ports, n) [m]."""

    @property
    @abstractmethod
    def mean_undetermined(self) -> bool | None:
        """Whether the mean, and with it the height, of the highest peak depends on the history; None without.

        It is found when it is asked for, as `solve` does.
        """

    @property
    @abstractmethod
    def known(self) -> Known:
        """How well the highest peak is known; what is made of branches passes it on."""

    @property
    def notes(self) -> tuple[Note, ...]:
        """A highest amplitude at an end of the band, and what of the scene is hardly meant."""
        of_scene = on_demand("solver.response.plausibility:plausibility")(self.scene)
        return (*on_demand("solver.response.plausibility:band_end_of")(self), *of_scene)

    @property
    @abstractmethod
    def peak_stability(self) -> tuple[Verdict, ...]:
        """Whether the response at each of `peaks` is stable; found when asked for, where it costs little."""

    @property
    @abstractmethod
    def drift_per_period(self) -> float:
        """How far a part drifts in a period [m] just beyond where the branch ended as RATCHETS; else NaN."""

    @property
    @abstractmethod
    def bifurcations(self) -> Bifurcations:
        """Its folds, branch points and early end, and which of it is not stable; found when asked for."""

    @property
    def scene(self) -> Scene:
        """What vibrates, with the values that stayed fixed."""
        return self.posed.scene

    @property
    def n_harmonics(self) -> int:
        """The number of harmonics asked for."""
        return self.posed.n_harmonics

    @property
    def parameter(self) -> str:
        """Path of the parameter that was continued in."""
        return self.posed.parameter.path

    @property
    def unit(self) -> str:
        """Unit of its values."""
        return self.posed.parameter.unit

    def _measure(self, name: str) -> Real:
        """Return a column of the measures; its number is the kernel's, which results are read without."""
        column: Any = on_demand(f"solver.balance.kernels.output:{name}")
        found: Real = self.measures[:, column]
        return found

    @property
    def amplitude(self) -> Real:
        """max|x| of the observed DOF at each point [m]."""
        return self._measure("MAX_ABS")

    @property
    def half_peak_to_peak(self) -> Real:
        """(max x − min x)/2 of the observed DOF at each point [m]."""
        return self._measure("HALF_RANGE")

    @property
    def mean(self) -> Real:
        """Mean of the observed DOF at each point [m]."""
        return self._measure("MEAN")

    @property
    def residuals(self) -> Real:
        """Relative residual at each point."""
        return self._measure("RESIDUAL")

    @property
    def slopes(self) -> Real:
        """Change of max|x| along the unit tangent at each point."""
        return self._measure("SLOPE")

    @property
    def peak(self) -> Peak | None:
        """The highest peak, or None if the branch has no point."""
        return self.peaks[0] if self.peaks else None

    @property
    def interior_peaks(self) -> tuple[Peak, ...]:
        """All local maxima that are no ends of the branch, highest first."""
        return tuple(peak for peak in self.peaks if peak.interior)

    @property
    def highest_stability(self) -> Verdict | None:
        """Whether the highest peak is stable; None if the branch has no point."""
        return next(iter(self.peak_stability), None)

    @property
    def peaks_stable(self) -> tuple[Stable, ...]:
        """Whether each of `interior_peaks` is stable: yes, no, or not known."""
        both = zip(self.peak_stability, self.peaks, strict=True)
        return tuple(one.stable for one, peak in both if peak.interior)

    @property
    def band_known(self) -> bool | None:
        """Whether the whole band is: no crossing of its limit hides between points; None without a band."""
        return None if self.band is None else self.band.known and self.peak_certificate.known

    @property
    def largest_residual(self) -> float | None:
        """Largest relative residual of all points; None if there is none."""
        return max(self.residuals.tolist(), default=None)

    @property
    def ratchets(self) -> bool:
        """Whether a part that contacts alone hold drifts a little further every period."""
        return self.status is BranchStatus.RATCHETS

    @property
    def folds(self) -> int:
        """How often the branch turned back in its parameter; two points at one value are no turn."""
        ahead = np.sign(np.diff(self.values))
        return int(np.count_nonzero(np.diff(ahead[ahead != 0.0])))

    def plot(self, ax: Axes | Sequence[Axes] | None = None, *, limit: float | None = None) -> Figure:
        """Draw the response, its peak and its band.

        Parameters
        ----------
        ax : axes to draw into, else a new figure.
        limit : amplitude [m] drawn as a line.
        """
        figure: Figure = self.VIEWS.call("figure", self, ax=ax, limit=limit)
        return figure

    @property
    def speeds_rpm(self) -> Real | None:
        """Speeds of rotation [1/min] of the points along an engine-order line; None elsewhere."""
        order = self.scene.speed_order
        return None if order is None else 60.0 / order * self.values

    def to_json(self) -> dict[str, Any]:
        """Return the branch as one JSON object."""
        found = self._json(**self.bifurcations.of_a_branch())
        return found if self.ratchets else {k: v for k, v in found.items() if k != "drift_per_period"}


@dataclass(frozen=True, slots=True, kw_only=True, repr=False)
class Branch(AnyBranch):
    """A branch of periodic responses over one parameter, P points in their order along it.

    They are the steps of the continuation and what was solved for between them: narrow resonances and peaks.
    The error is by the harmonics left out and the residual, with peaks that stand elsewhere if more are kept
    (`solver.continuation.extrema.branch_error`); `solver.branch_errors` gives that of every point. Flags are
    ``symmetric_unstable`` if a half-wave symmetric point of it is not the motion that is seen,
    ``travelling_wave_assumed`` where one sector stands for all though the laws allow other motions,
    ``mean_load_above_friction`` where it ends because contacts cannot hold a part's mean load.
    """

    balance: Annotated[Balance, "What was continued; its scene holds the values that stayed fixed."]
    solutions: Annotated[Real, "Slip motions [m] with λ (inside unit) last, (P, n_unknowns + 1)."]
    tangents: Annotated[Real, "Tangents that point onward along the branch, (P, n_unknowns + 1)."]
    stepped_over: int
    _judged: list[tuple[Verdict, ...]] = field(default_factory=list, init=False, compare=False)
    _drifts: list[float] = field(default_factory=list, init=False, compare=False)

    @property
    def posed(self) -> Balance:
        """The balance."""
        return self.balance

    def scene_at(self, value: float) -> tuple[Scene, float]:
        """Return the scene and the frequency [Hz] of the responses at a value of the parameter."""
        if self.parameter == "frequency":
            return self.scene.at_frequency(value), value
        scene = self.scene.with_values({self.parameter: value})
        return scene, self.balance.system.omega / (2.0 * math.pi)

    @property
    def coefficients(self) -> Real:
        """Slip motion of every contact at each point, (P, n_contacts, n) [m]."""
        n = self.balance.n_coefficients
        return self.solutions[:, :-1].reshape(len(self.values), -1, n)

    @property
    def mean_undetermined(self) -> bool | None:
        """As `solve` says it of the highest peak."""
        if self.peak is None:
            return None
        return "mean_undetermined" in on_demand("solver.response.solve:peak_flags")(self)

    @property
    def known(self) -> Known:
        """By the error estimate and the flags of the highest peak."""
        found: Known = on_demand("solver.response.solve:known_of")(self)
        return found

    @property
    def peak_stability(self) -> tuple[Verdict, ...]:
        """By what is known of the scene, else by multipliers."""
        if not self._judged:
            self._judged.append(on_demand("solver.response.stability.verdict:of_peaks")(self))
        return self._judged[0]

    @property
    def drift_per_period(self) -> float:
        """By the balance of a motion that drifts."""
        if not self.ratchets:
            return math.nan
        if not self._drifts:
            self._drifts.append(on_demand("solver.response.drift:of_branch")(self))
        return self._drifts[0]

    @property
    def bifurcations(self) -> Bifurcations:
        """By the signs of the determinants along it.

        A branch of very many unknowns is not looked at, and says so: `solver.bifurcations` does it all the
        same.
        """
        found: Bifurcations = on_demand("solver.response.stability.bifurcations:of_branch")(self)
        return found
