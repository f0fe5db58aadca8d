"""What a criterion of a design says of itself: words, units, values with gradients, and limits; all of them.

The methods, problem files, REST bodies, options of the command, results, reports and the docs follow from
it. What it judges (`Judged`) and what it gives (`CriterionRow`) stand here too: each speaks of the others. A
module of a criterion imports what computes inside its functions: a service that only lists loads none of it.

To add a criterion, write a module with `CRITERION`, one or several, and name it in `SHIPPED`; one from
outside the package is named by `solver.extensions`, or registered for one process.
"""

from __future__ import annotations

import math
import operator
from collections.abc import Callable, Container, Mapping
from dataclasses import dataclass, field
from functools import cached_property, partial
from typing import TYPE_CHECKING, Annotated, Any, ClassVar

from optim.criteria.key import WORD
from optim.criteria.key import Form as Form  # with `Criterion` and `Key` all that a criterion is made of
from optim.criteria.key import Key as Key
from solver.arrays import FloatOrNaN
from solver.extensions import Kinds
from solver.results.told import Piece, json_number
from solver.wording import documented

if TYPE_CHECKING:
    from optim.criteria.response_gradients import Sensitivity
    from optim.problem.cases import LoadCase
    from optim.problem.variables import BoundedVariable, Real
    from solver.continuation.branch import Branch
    from solver.response.wear import WearSensitivity
    from solver.scene.scene import AnyContact, Scene


Ranges = tuple[tuple[float, float], ...]


@dataclass(frozen=True, slots=True, kw_only=True)
class CriterionContext:
    """What the keys of a criterion are read in."""

    scene: Annotated[Scene, "What is designed."]
    cases: Annotated[tuple[LoadCase, ...], "The responses it is judged by."]
    limit: Annotated[float | None, "Amplitude [m] at which bands are measured."]
    values: Annotated[Mapping[str, object], "The criterion's keys that were given."]


def positive_limit(asked: CriterionContext) -> object:
    """Read the one key of a criterion as a number above 0.

    Raises
    ------
    DesignError
        It is none.
    """
    from optim.problem.checks import positive

    ((name, value),) = asked.values.items()
    return positive(name, value)


def registered(name: str) -> Criterion:
    """Return the criterion of a name; KeyError if there is none here."""
    return {one.name: one for one in criteria()}[name]


@documented
@dataclass(frozen=True, slots=True, kw_only=True, eq=False, repr=False)
class Criterion:
    """A quantity that designs are judged by: minimised, limited, or both. Only itself is equal to it."""

    name: Annotated[str, "The word in results and reports (``quantity`` of a row)."]
    unit: Annotated[str, "Of its values."]
    help: Annotated[str, "What it is, a sentence of Markdown."]
    rows: Annotated[
        Callable[[Judged], list[CriterionRow]],
        "The rows of a response: each smooth number with its gradient, and its second derivatives if the "
        "solver has them. `Judged.row` makes them.",
    ]
    smaller_is_better: Annotated[
        bool,
        "If not, rows have its negative (they are kept from above), and it can be limited from below alone.",
    ] = True
    weight: Annotated[str, "The word in `weights` by which it is minimised; empty if it is only limited."] = (
        ""
    )
    needs: Annotated[str, "The key without which it cannot be minimised; empty without such."] = ""
    keys: Annotated[tuple[Key, ...], "The keys of its limit."] = ()
    read: Annotated[
        Callable[[CriterionContext], object],
        "What its keys that were given come to, as its `rows` use it; raises DesignError.",
    ] = positive_limit
    ranges: Annotated[
        Callable[[Any, LoadCase], Ranges] | None,
        "Frequencies [Hz] beyond the band of a case at which it is judged, from what was read; None for "
        "the response over the band.",
    ] = None
    told: Annotated[
        Callable[[float], float],
        "What results say of a value of a row, inf if there is no end to it; a search may count it on.",
    ] = float
    endless: Annotated[str, "Why a value is inf, in words."] = ""
    scale: Annotated[
        Callable[[Scene], float], "What an excess over a limit of 0 is relative to, in a scene."
    ] = lambda _scene: 1.0
    lacking: Annotated[
        Callable[[Scene], str], "Why a scene has nothing of it to be minimised; empty if it has."
    ] = lambda _scene: ""
    always: Annotated[bool, "Whether its rows are wanted if nobody asks: results show them."] = False
    each_blade: Annotated[bool, "Whether it is that of every blade of a mistuned disk."] = False
    limit_name: Annotated[str, "How results call its limit."] = ""
    with_place: Annotated[bool, "Whether they say which row has the limit."] = True
    on_a_front: Annotated[bool, "Whether its limit may be given for a front of peak against band."] = True

    def __post_init__(self) -> None:
        if not self.keys and not self.weight:
            raise ValueError(f"the criterion {self.name!r} must have `keys` of a limit or a `weight`")
        if self.weight and not self.smaller_is_better:
            raise ValueError(f"the criterion {self.name!r} is minimised by its `weight`: smaller is better")
        if self.weight and not WORD.fullmatch(self.weight):
            raise ValueError(f"`weight` of {self.name!r} must be a word such as peak, got {self.weight!r}")

    def __reduce__(self) -> tuple[Callable[[str], Criterion], tuple[str]]:
        """Be sent to another process by name: there too, a criterion is one object."""
        return registered, (self.name,)

    def __repr__(self) -> str:
        return f"Criterion({self.name})"

    @property
    def per_unit(self) -> str:
        """The unit of its weight, behind a word."""
        return "" if self.unit == "1" else f" [1/{self.unit}]"

    def limit_words(self, row: CriterionRow) -> str:
        """Return the limit of a row in words."""
        where, bound = f" ({row.what})" if self.with_place else "", row.bound_told
        if bound is None:
            return f"an end to the {self.name}{where}"
        bound = bound if self.smaller_is_better else 0.0 - bound
        return f"{self.limit_name or f'{self.name} limit'} of {bound:g} {self.unit}{where}"


@dataclass(frozen=True, slots=True, kw_only=True)
class Goals:
    """What a design is to reach, and by what."""

    variables: Annotated[tuple[BoundedVariable, ...], "What may be chosen."]
    limit: Annotated[
        float | None,
        "Amplitude [m] above which the resonance band is measured; half power of the highest peak if None.",
    ]
    weights: Annotated[
        Mapping[Criterion, float], "What is minimised: of each the largest value times its weight, summed."
    ]
    limits: Annotated[
        Mapping[Criterion, Any], "What must be kept: what the keys of each criterion that is limited came to."
    ]

    @property
    def paths(self) -> tuple[str, ...]:
        """Every parameter path of every variable."""
        return tuple(path for variable in self.variables for path in variable.paths)


@dataclass(frozen=True, slots=True, kw_only=True, repr=False)
class CriterionRow(Piece):
    """One smooth number of a design."""

    JSON: ClassVar = (
        "quantity=quantity.name case what value unit=quantity.unit at=at_hz bound weight"
        " smaller_is_better=quantity.smaller_is_better"
    )

    quantity: Annotated[Criterion, "What it measures."]
    case: Annotated[str, "Name of the load case."]
    what: Annotated[str, "In words, for example ``peak at 753.28 Hz``."]
    value: Annotated[
        FloatOrNaN,
        "In the unit of its criterion; the negative where larger is better. A search may count it on where "
        "there is no end to it: then it is null in JSON.",
    ]
    gradient: Annotated[
        Real, "By each variable, per unit of it; NaN where it does not exist, (n_variables,)."
    ]
    at_hz: Annotated[float, "Its frequency; NaN for what has none."]
    weight: Annotated[float, "Multiplies it in what is minimised; 0 if it is only limited."]
    bound: Annotated[float | None, "The most it may be."]
    second: Annotated[
        Callable[[], Real] | None,
        "Computes the exact second derivatives by the variables, (n_variables, n_variables), NaN where "
        "they do not exist; None where the solver has none.",
    ] = field(default=None, compare=False, repr=False)
    flags: Annotated[tuple[str, ...], "Names of what its value assumes or leaves open."] = ()

    def to_json(self) -> dict[str, Any]:
        """Return it as one JSON object, value and bound as results say them."""
        return self._json(value=json_number(self.told), bound=self.bound_told)

    @property
    def told(self) -> FloatOrNaN:
        """The value as results say it; inf if there is no end to it, which is null in JSON."""
        return self.quantity.told(self.value)

    @property
    def bound_told(self) -> float | None:
        """The bound as results say it; None without one, and where all that it asks is an end."""
        if self.bound is None or not math.isfinite(bound := self.quantity.told(self.bound)):
            return None
        return bound

    def excess(self, scale: float) -> float:
        """Return how far it is above its bound, relative to the bound (to `scale` if that is 0)."""
        if self.bound is None:
            return -math.inf
        return (self.value - self.bound) / self.unit_of(scale)

    def unit_of(self, scale: float) -> float:
        """Return what an excess is relative to."""
        return abs(self.bound) if self.bound else scale


def _after(change: Callable[[Real], Real], compute: Callable[[], Real]) -> Real:
    """What is computed, changed: a row keeps what computes so that it can be sent to another process."""
    return change(compute())


def of_sector(contact: AnyContact) -> str:
    """Return the name a contact has in one sector: that of ``shroud@3`` is ``shroud``."""
    return contact.name.partition("@")[0]


@documented
@dataclass(frozen=True, kw_only=True)
class Judged:
    """The response of a case of a problem."""

    problem: Annotated[Goals, "What is judged."]
    case: LoadCase
    branch: Annotated[Branch, "The response, which covers its range and has a peak."]
    gradients: Annotated[bool, "Compute them (otherwise they are NaN)."]
    hertz: Annotated[
        tuple[float, float] | None,
        "(low, high) [Hz] of a response beyond the band; None for that over the band.",
    ] = None

    @cached_property
    def sensitivity(self) -> Sensitivity | None:
        """Derivatives of amplitudes by the parameter paths; None without gradients."""
        from optim.criteria.response_gradients import Sensitivity

        return Sensitivity(self.branch.balance, self.problem.paths) if self.gradients else None

    @cached_property
    def wear(self) -> WearSensitivity | None:
        """Derivatives of what contacts go through by the parameter paths; None without gradients."""
        from solver.response.wear import WearSensitivity

        return WearSensitivity(self.branch.balance, self.problem.paths) if self.gradients else None

    @property
    def measured(self) -> str:
        """What an amplitude is here, in words: max|x| as long as the mean is not free."""
        return "half peak to peak" if self.branch.balance.scene.observe.centred else "amplitude"

    def contacts(self, names: Container[str]) -> list[AnyContact]:
        """Return the contacts of these names, those of every sector of a disk that is written out."""
        return [one for one in self.branch.balance.scene.contacts if of_sector(one) in names]

    def limit(self, criterion: Criterion) -> Any:
        """Return what the keys of a criterion came to; None if none was given."""
        return self.problem.limits.get(criterion)

    def weight(self, criterion: Criterion) -> float:
        """Return the weight of a criterion in what is minimised."""
        return self.problem.weights.get(criterion, 0.0)

    def row(
        self, criterion: Criterion, what: str, value: float, by_paths: Real | None, *,
        at_hz: float = math.nan, bound: float | None = None, weight: float | None = None,
        second: Callable[[], Real] | None = None,
    ) -> CriterionRow:  # fmt: skip
        """Return a row of a criterion.

        Parameters
        ----------
        what : in words, for example ``peak at 753.28 Hz``.
        value : of the quantity itself, in the unit of the criterion.
        by_paths : its derivatives by the parameter paths, (n_paths,); None without gradients.
        at_hz : its frequency, if it has one.
        bound : the most it may be, or the least where larger is better.
        weight : in what is minimised; that of the criterion if left out.
        second : computes its second derivatives by the parameter paths, (n_paths, n_paths).
        """
        import numpy as np

        from optim.problem.variables import by_variables, by_variables_twice

        variables = self.problem.variables
        gradient = np.full(len(variables), np.nan)
        if by_paths is not None:
            gradient = by_variables(variables, by_paths)
        twice = None if second is None else partial(_after, partial(by_variables_twice, variables), second)
        weight = self.weight(criterion) if weight is None else weight
        if not criterion.smaller_is_better:
            # Kept from above like all rows; 0.0 − 0.0 is 0.0, −0.0 would show its sign.
            what, value, gradient, weight = f"-{what}", 0.0 - value, -gradient, 0.0
            bound = None if bound is None else 0.0 - bound
            twice = None if twice is None else partial(_after, operator.neg, twice)
        return CriterionRow(
            quantity=criterion, case=self.case.name, what=what, value=value, gradient=gradient, at_hz=at_hz,
            weight=weight, bound=bound, second=twice,
        )  # fmt: skip


SHIPPED = (
    "optim.criteria.peak_criterion",
    "optim.criteria.stress",
    "optim.criteria.frequency_ranges",
    "optim.criteria.friction_work",
    "stickslip.lab.wear_life.worn_peak",
    "optim.criteria.damping",
    "optim.criteria.mass",
    "optim.criteria.separation",
)


def _words(criterion: Criterion) -> tuple[str, ...]:
    flags = [word for key in criterion.keys for word in (key.name, key.flag)]
    return (criterion.name, *flags, *([f"weights.{criterion.weight}"] if criterion.weight else []))


CRITERIA: Kinds[Criterion] = Kinds(Criterion, "criterion", _words, SHIPPED, "CRITERION")
criteria, register, unregister = CRITERIA.every, CRITERIA.register, CRITERIA.unregister


def limit_keys(*, of_fronts: bool | None = None) -> tuple[Key, ...]:
    """The keys of limits, in order.

    Parameters
    ----------
    of_fronts : only those that a front takes, or only those that it does not.
    """
    return tuple(
        key for one in criteria() if of_fronts is None or one.on_a_front is of_fronts for key in one.keys
    )


def weight_words() -> tuple[str, ...]:
    """The words of `weights`, in order."""
    return tuple(one.weight for one in criteria() if one.weight)


def by_weight(word: str) -> Criterion | None:
    """The criterion of a word of `weights`."""
    return next((one for one in criteria() if one.weight == word), None)
