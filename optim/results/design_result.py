"""What a design search returns: the best design, local optima, the best so far, what a curve is worth."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass, field, replace
from enum import Enum
from typing import TYPE_CHECKING, Annotated, Any, ClassVar

from optim.criteria.criterion import CriterionRow
from optim.criteria.peak_criterion import BAND, PEAK
from optim.problem.checks import Method
from optim.results.doubts import doubts_of
from solver.arrays import FloatOrNaN
from solver.first_use import on_demand
from solver.results.base import Drawn, MadeOfResponses, Views
from solver.results.known import Known, Measured, Note, Stable, Verdict, notes_of_all, worst
from solver.results.told import Piece, json_number

if TYPE_CHECKING:
    from optim.criteria.constraint_rows import DesignEvaluation
    from optim.problem.design_problem import Problem
    from solver.continuation.branch import Branch


SAME_PLACE = 1e-3  # scaled distance within which two optima are one


@dataclass(frozen=True, slots=True, kw_only=True, repr=False)
class LocalOptimum(Piece):
    """A local optimum."""

    values: Annotated[Mapping[str, float], "Variable name to value."]
    peak: Annotated[float, "Highest peak [m]."]
    objective: Annotated[float, "What is minimised."]
    settled: Annotated[bool, "Whether the first-order conditions hold there."]
    feasible: Annotated[bool, "Whether the limits are kept there."]
    proven: Annotated[
        bool,
        "Whether a response there was computed, so that no peak is higher than `peak`. A further basin of "
        "the tracked peak is solved for along the peaks that were followed: it is at least that high.",
    ]


@dataclass(frozen=True, slots=True, kw_only=True, repr=False)
class Checked(Piece):
    """A local optimum again with more harmonics."""

    JSON: ClassVar = "values n_harmonics=harmonics peak objective feasible"

    values: Annotated[Mapping[str, float], "Variable name to value."]
    harmonics: Annotated[int, "Highest harmonic kept."]
    peak: Annotated[float, "Highest peak [m]; NaN where a response could not be computed."]
    objective: Annotated[float, "What is minimised; NaN likewise."]
    feasible: Annotated[bool, "Whether the limits are kept."]


class OptionStatus(Enum):
    """What became of an option; the value is a sentence."""

    FEASIBLE = "It keeps all limits."
    INFEASIBLE = "No design of it keeps all limits."
    CUT = "Its mass alone is no better than the best design of another option."
    UNKNOWN = "No design of it could be computed: use more harmonics or a narrower band."
    STOPPED = "Stopped by the caller before it was looked at."


@dataclass(frozen=True, slots=True, kw_only=True, repr=False)
class CatalogueOption(Piece):
    """One option of a catalogue."""

    name: Annotated[str, "As it was given."]
    status: Annotated[OptionStatus, "What became of it."]
    objective: Annotated[float, "Of its best design; inf without one."]
    least: Annotated[float, "What its objective cannot fall below, by its mass alone."]
    values: Annotated[Mapping[str, float], "Variable to value of its best design; empty without variables."]


VERIFIED = "Its whole response was computed with all harmonics."
FEWER_HARMONICS = "Ranked with fewer harmonics; those that count are computed with all of them."
PEAKS_OPEN = "Its response was computed, but a higher peak may lie between its points."
NOMINAL = "The best without the uncertainty; what that does to it is looked at next."


@dataclass(frozen=True, slots=True, kw_only=True, repr=False)
class BestSoFar(Piece):
    """The best design of a search on its way; the result may be another."""

    values: Annotated[Mapping[str, float], "The design."]
    peak: Annotated[
        float, "Its highest peak [m]; of a robust design the highest over the scenarios looked at."
    ]
    objective: Annotated[float, "What is minimised."]
    feasible: Annotated[bool, "Whether it keeps the limits."]
    verified: Annotated[
        bool, "Whether these are the numbers of whole responses of the problem as it was asked."
    ]
    words: Annotated[str, "What is known of it, a sentence."]
    evaluations: Annotated[int, "Designs, of a tracked peak responses, looked at when it was found."]


OnBest = Callable[[BestSoFar], None] | None


@dataclass(frozen=True, slots=True, kw_only=True, repr=False)
class CurveCheck(Piece):
    """The peak of the performance curve at its optimum, beside exact ones."""

    JSON: ClassVar = (
        "mode shared curves synthesised corrected exact estimate error tolerance suffices holds curve_seconds"
        " correction_seconds response_seconds seconds_saved"
    )

    mode: Annotated[int, "Number of the mode that the curve is of."]
    shared: Annotated[bool, "One curve served all designs, because forces, loads and motions grow together."]
    curves: Annotated[int, "Curves followed."]
    synthesised: Annotated[float, "Peak of the curve at its optimum [m]."]
    corrected: Annotated[
        float,
        "What the whole balance next to the synthesised motion makes of it [m]; NaN if that was not found.",
    ]
    exact: Annotated[float, "Highest peak of the whole response [m]; NaN if it could not be computed."]
    tolerance: Annotated[float, "Relative error up to which the curve suffices."]
    curve_seconds: Annotated[float, "What the search on curves took [s]."]
    correction_seconds: Annotated[float, "What the correction took [s]."]
    response_seconds: Annotated[float, "What the whole response took [s]."]
    exact_responses: Annotated[float, "The work of an exact search, in whole responses, at least."]

    @property
    def estimate(self) -> float:
        """Relative error of the curve's peak by the correction, without a whole response; NaN if unknown."""
        return self.synthesised / self.corrected - 1.0

    @property
    def error(self) -> float:
        """Relative error of the curve's peak."""
        return self.synthesised / self.exact - 1.0

    @property
    def suffices(self) -> bool:
        """Whether the estimate alone says that the curve suffices."""
        return abs(self.estimate) <= self.tolerance

    @property
    def holds(self) -> bool:
        """Whether the curve is as good as asked for, by the whole response."""
        return abs(self.error) <= self.tolerance

    @property
    def seconds_saved(self) -> float:
        """Time [s] saved against an exact search of the least work; below 0 if that had been quicker."""
        spent = self.curve_seconds + self.correction_seconds + self.response_seconds
        return self.exact_responses * self.response_seconds - spent

    def to_json(self) -> dict[str, Any]:
        """Return it as a JSON object."""
        return self._json(holds=math.isfinite(self.error) and self.holds)


SAME_HEIGHT = 1e-5  # relative distance within which rows count as equally high
AT_LIMIT = 1e-4  # relative distance from a bound within which a limited row holds the design


@dataclass(frozen=True, slots=True, kw_only=True)
class Conditions:
    """The Karush-Kuhn-Tucker conditions of a design: which rows hold it, with which force."""

    rows: Annotated[
        tuple[tuple[CriterionRow, float], ...],
        "Active rows with their multipliers: objective rows of one quantity sum to 1; those of limited "
        "rows say by how much of the objective's scale the optimum falls for a relative relief of the "
        "bound.",
    ]
    bounds: Annotated[
        tuple[tuple[str, str, float], ...],
        "Variable, ``lower`` or ``upper``, and multiplier, of the variables on a bound.",
    ]
    residual: Annotated[
        float, "Largest component of the gradient of the Lagrangian, relative objective per scaled variable."
    ]
    violation: Annotated[float, "Largest relative excess over a bound."]

    def to_json(self) -> dict[str, object]:
        """Return them as one JSON object."""
        return {
            "residual": json_number(self.residual), "violation": json_number(self.violation),
            "rows": [
                {"what": row.what, "case": row.case, "quantity": row.quantity.name, "multiplier": x}
                for row, x in self.rows
            ],
            "bounds": [{"variable": name, "side": side, "multiplier": x} for name, side, x in self.bounds],
        }  # fmt: skip


class DesignStatus(Enum):
    """How a search ended; the value is a sentence a user can act on."""

    OPTIMAL = "What is minimised can not be lowered further."
    AT_BOUND = (
        "What is minimised can not be lowered further within the bounds, and a variable lies on a bound that "
        "holds the design: wider bounds would do better."
    )
    KINK = (
        "The search could not improve the design, but the first-order conditions do not hold there: the "
        "response has a kink at this design, or more harmonics are needed."
    )
    LOCAL = (
        "No better design is near, but there may be a better one elsewhere: the look over the whole range "
        "did not come to its end, or, as a warning then says, a response may have a higher peak than those "
        "found. Give a start there, narrower bounds, fewer variables, or more harmonics."
    )
    FLAT = (
        "The peak does not depend on these variables (no friction, or contacts that never slip): "
        "choose others."
    )
    INFEASIBLE = (
        "No design within the bounds keeps all limits; the one that breaks them least is given, with what "
        "each limit would have to be: relax one of those, or allow wider bounds."
    )
    NO_RESPONSE = (
        "The frequency response could not be computed over the whole band for any design tried: "
        "use more harmonics or a narrower band."
    )
    UNDAMPED = (
        "There is a resonance in the band and no damping, so that nothing bounds the response of any design "
        "tried: give the structure some (damping_ratio = 0.001, say), or a band without the resonance."
    )
    NOT_TRACKED = (
        "The peaks could not be followed over the whole range; the best design seen is given: use the method "
        "minimax, or a narrower range."
    )
    APPROXIMATE = (
        "The performance curve of one mode is least here, and its peak is that of the whole response within "
        "the tolerance. That no other design is better is as sure as the curve is."
    )
    CURVE_OFF = (
        "The performance curve of one mode is least here, but its peak is not that of the whole response "
        "within the tolerance: use the method auto, or a wider tolerance."
    )
    NO_CURVE = (
        "No performance curve reaches the excitation within the bounds: use the method auto, or see with "
        "`stickslip modes` where the curve ends."
    )
    TOO_MANY = "The largest number of responses was used up before the search settled: allow more."
    NOT_KNOWN = (
        "No better design is near with these harmonics, but its highest peak is not known within 5 %, and "
        "more harmonics that the search may afford do not mend that: ask for more harmonics, or see what the "
        "warnings say."
    )
    STOPPED = "The search was stopped by the caller."


class Certainty(Enum):
    """How far it is certain that no other design is better; the value is what a user reads."""

    CLOSED = "closed: the peaks followed over the whole range are nowhere lower"
    SAMPLED = "sampled: between the designs looked at a better one may lie that shows in no slope around"
    BAND_END = (
        "no: the highest amplitude of every case is at an end of its band, which any resonance beyond exceeds"
    )


_PROVEN = (DesignStatus.OPTIMAL, DesignStatus.AT_BOUND)


@dataclass(frozen=True, slots=True, kw_only=True, repr=False)
class DesignPeak(Piece):
    """A peak of the response of a design."""

    value: Annotated[float, "max|x| of the observed DOF [m]."]
    at: Annotated[float, "Its frequency [Hz]."]


@dataclass(frozen=True, slots=True, kw_only=True, repr=False)
class DesignResult(MadeOfResponses, Drawn):
    """The best design found."""

    VIEWS: ClassVar = Views("optim.views", "design:design", "of_design", "design_dataset")
    JSON: ClassVar = (
        "scene measured method optimum peak n_harmonics=problem.harmonics peaks band_hz limit bands"
        " objective rows held_by error_estimate stable stable_ground errors warnings plateau chosen_by"
        " certainty checked curve looked_at evaluations newton_iterations tried basins seconds work"
        " active optimality multipliers conditions broken options reached status"
    )

    problem: Annotated[Problem, "What was asked."]
    method: Annotated[Method, "How the optimum was found."]
    status: Annotated[DesignStatus, "How the search ended."]
    evaluation: Annotated[DesignEvaluation | None, "Rows and responses of the optimum."]
    conditions: Annotated[Conditions | None, "First-order conditions there."]
    basins: Annotated[tuple[LocalOptimum, ...], "Every local optimum found, best first."]
    looked_at: Annotated[
        tuple[DesignEvaluation, ...],
        "The designs of the look over the whole range, in order, some of them with fewer harmonics.",
    ] = ()
    plateau: Annotated[
        Mapping[str, tuple[float, float]],
        "Along each variable, how far every value is as good (to 1e-6); empty for a sharp optimum.",
    ] = field(default_factory=dict)
    chosen_by: Annotated[str | None, "What the design was chosen by on a plateau."] = None
    checked: Annotated[
        tuple[Checked, ...],
        "The local optima again with twice the harmonics, where the estimated error of a peak is large.",
    ] = ()
    options: Annotated[
        tuple[CatalogueOption, ...], "Of a catalogue its options, best first: the design is of the first."
    ] = ()
    curve: Annotated[
        CurveCheck | None, "Of the method performance-curve: the curve beside the whole response."
    ] = None
    history: Annotated[
        tuple[DesignEvaluation, ...],
        "Every design evaluated, in order; the optimum is among them (of a tracked peak the optimum alone).",
    ]
    evaluations: Annotated[int, "Frequency responses computed."]
    work: Annotated[FloatOrNaN, "What the search cost in all, in frequency responses."]
    seconds: Annotated[float, "Time in all [s]."] = 0.0

    @property
    def scene(self) -> str:
        """Name of the scene."""
        return self.problem.scene.name

    @property
    def measured(self) -> Measured:
        """What its peaks and limits are of; half peak to peak where the mean of the responses is free."""
        return self.problem.cases[0].scene.measured

    @property
    def optimum(self) -> Mapping[str, float]:
        """Variable name to value; empty when no design could be evaluated."""
        return {} if self.evaluation is None else dict(self.evaluation.values)

    @property
    def reached(self) -> bool:
        """Whether the goal was reached."""
        return self.status in (DesignStatus.OPTIMAL, DesignStatus.AT_BOUND, DesignStatus.APPROXIMATE)

    @property
    def peak(self) -> DesignPeak | None:
        """The highest peak of the optimum."""
        if self.evaluation is None or not self.evaluation.peaks:
            return None
        return DesignPeak(value=self.evaluation.peaks[0].value, at=self.evaluation.peaks[0].at_hz)

    @property
    def held_by(self) -> CriterionRow | None:
        """The row that holds what is minimised: the highest weighted peak, or else of another criterion."""
        if self.evaluation is None:
            return None
        for quantity in self.problem.weights:
            rows = [row for row in self.evaluation.of(quantity) if row.weight > 0.0]
            if rows:
                return max(rows, key=lambda row: row.weight * row.value)
        return None

    @property
    def error_estimate(self) -> FloatOrNaN:
        """Estimated error [m] of the highest peak of the case that holds the optimum; NaN if not known.

        It is of the `measure` of `known`.
        """
        held = self.held_by
        if held is None or self.evaluation is None:
            return math.nan
        parts = dict(self.evaluation.known_parts)
        return parts[held.case].error_estimate if held.case in parts else math.nan

    @property
    def stability(self) -> Verdict:
        """Whether the responses at the highest peaks of the optimum are stable, in every case."""
        responses = () if self.evaluation is None else self.evaluation.responses
        return worst([response.branch.peak_stability[0] for response in responses if response.branch.peaks])

    @property
    def stable(self) -> Stable:
        """Whether small perturbations die out there: yes, no, or not known."""
        return self.stability.stable

    @property
    def certainty(self) -> Certainty:
        """Whether the range is closed by peaks that were followed over all of it, or only sampled.

        It is neither where the response of every case is highest at an end of its band: what is least there
        is no peak.
        """
        branches = () if self.evaluation is None else tuple(self.evaluation.over_bands.values())
        if branches and all(map(on_demand("solver.response.plausibility:is_band_end"), branches)):
            return Certainty.BAND_END
        followed = self.method is Method.TRACKED and bool(self.basins) and self.basins[0].proven
        return Certainty.CLOSED if followed and self.status in _PROVEN else Certainty.SAMPLED

    @property
    def of_scene(self) -> tuple[Note, ...]:
        """What of the scene is hardly meant, with the values of the optimum."""
        whole = self.evaluation
        scenes = [self.problem.scene] if whole is None else [one.scene for one in whole.over_bands.values()]
        return notes_of_all(map(on_demand("solver.response.plausibility:plausibility"), scenes))

    @property
    def warnings(self) -> tuple[str, ...]:
        """What makes the numbers doubtful, in words."""
        return doubts_of(
            self.evaluation,
            harmonics=self.problem.harmonics,
            optimum=self.optimum,
            checked=self.checked,
            feasible=not self.broken,
        )

    @property
    def band_hz(self) -> float | None:
        """Width of the widest resonance band of the optimum [Hz]."""
        band = None if self.evaluation is None else self.evaluation.band
        return None if band is None else band.value

    @property
    def further(self) -> tuple[CriterionRow, ...]:
        """The largest row of each criterion that is minimised besides peak and band."""
        weights = self.problem.weights
        others = [one for one, weight in weights.items() if weight > 0.0 and one not in (PEAK, BAND)]
        rows = () if self.evaluation is None else (self.evaluation.of(one)[:1] for one in others)
        return tuple(row for found in rows for row in found)

    @property
    def limit(self) -> float | None:
        """Amplitude at which the band is measured [m]."""
        if self.evaluation is None or self.evaluation.band is None:
            return None
        branches = [r.branch for r in self.evaluation.responses if r.case == self.evaluation.band.case]
        return None if branches[0].band is None else branches[0].band.limit

    @property
    def optimality(self) -> FloatOrNaN:
        """Largest component of the gradient of the Lagrangian, relative objective per scaled variable."""
        return math.nan if self.conditions is None else self.conditions.residual

    @property
    def multipliers(self) -> tuple[float, ...]:
        """Of the active peaks; they sum to 1."""
        if self.conditions is None:
            return ()
        return tuple(x for row, x in self.conditions.rows if row.quantity is PEAK and x > 1e-6)

    @property
    def active(self) -> tuple[str, ...]:
        """What holds the optimum in place, in words: equally high peaks, bounds, limits."""
        if self.evaluation is None or not self.evaluation.rows:
            return ()
        # Peaks by frequency: which of equally high ones is higher is rounding.
        rows = self.evaluation.highest(SAME_HEIGHT)
        rows.sort(key=lambda row: row.at_hz if row.quantity is PEAK else math.inf)
        held = [self._words(row.what, row) for row in rows]
        for variable in self.problem.variables:
            value = self.evaluation.values[variable.name]
            for bound, name in ((variable.low, "lower"), (variable.high, "upper")):
                if abs(value - bound) <= 1e-9 * max(abs(bound), 1e-300):
                    held.append(f"{name} bound of {variable.name}")
        at_limits = [self._words(limit_words(row), row) for row in self.evaluation.rows if at_limit(row)]
        return (*held, *at_limits)

    def _words(self, what: str, row: CriterionRow) -> str:
        """Return what a row says, with the name of its case where there are several."""
        return f"{what} of {row.case}" if len(self.problem.cases) > 1 and row.case else what

    @property
    def broken(self) -> tuple[CriterionRow, ...]:
        """The limited rows that the design does not keep, worst first."""
        if self.evaluation is None:
            return ()
        rows = [row for row in self.evaluation.rows if row.bound is not None and row.value > row.bound]
        return tuple(sorted(rows, key=lambda row: -row.excess(1.0)))

    @property
    def sweeps(self) -> tuple[Branch, ...]:
        """Every frequency response computed, those of the optimum last."""
        return tuple(branch for _, branch in self._responses())

    @property
    def sweep_values(self) -> tuple[Mapping[str, float], ...]:
        """The designs of `sweeps`, in the same order."""
        return tuple(values for values, _ in self._responses())

    def _responses(self) -> list[tuple[Mapping[str, float], Branch]]:
        others = [evaluation for evaluation in self.history if evaluation is not self.evaluation]
        last = [] if self.evaluation is None else [self.evaluation]
        return [(e.values, response.branch) for e in [*others, *last] for response in e.responses]

    def with_errors(self) -> DesignResult:
        """Return it with the errors of the peaks of the optimum estimated; a search leaves that out."""
        if self.evaluation is None:
            return self
        found = self.evaluation.with_errors(self.problem.limit)
        history = tuple(found if one is self.evaluation else one for one in self.history)
        return replace(self, evaluation=found, history=history)

    def known_parts(self) -> Iterable[Known]:
        """The response of each case over its band."""
        return () if self.evaluation is None else [known for _, known in self.evaluation.known_parts]

    def to_json(self) -> dict[str, Any]:
        """Return the result as one JSON object."""
        tried = [one for one in self.history if one.good and one.peaks]
        return self._json(
            looked_at=[_looked_json(one) for one in self.looked_at if one.good],
            newton_iterations=sum(branch.newton_iterations for branch in self.sweeps),
            tried=[{"values": e.values, "peak": e.peaks[0].value, "at": e.peaks[0].at_hz} for e in tried],
            broken=[
                {**row.to_json(), "by": json_number(row.told - (row.bound_told or 0.0))}
                for row in self.broken
            ],
            **self.stability.to_json(),
            **(_NOTHING if self.evaluation is None else self.evaluation.to_json()),
        )  # fmt: skip


_NOTHING: dict[str, Any] = {"peaks": [], "bands": [], "objective": None, "rows": [], "errors": []}


def _looked_json(one: DesignEvaluation) -> dict[str, object]:
    """Return a design of the look over the whole range."""
    kept = all(row.bound is None or row.value <= row.bound for row in one.rows)
    return {
        "values": dict(one.values), "objective": json_number(one.objective_told), "feasible": kept,
        "n_harmonics": one.harmonics or None,
    }  # fmt: skip


def at_limit(row: CriterionRow) -> bool:
    """Return whether a limited row holds a design in place."""
    if row.bound is None:
        return False
    return row.value >= row.bound - AT_LIMIT * (abs(row.bound) or 1.0)


def limit_words(row: CriterionRow) -> str:
    """Return the limit of a row in words."""
    return row.quantity.limit_words(row)
