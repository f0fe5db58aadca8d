"""A law given by functions of the motion and its history: its definition, its contacts, `register_law`."""

from __future__ import annotations

import inspect
import math
import re
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from enum import Enum
from typing import Annotated, Any, ClassVar, Literal, ParamSpec, Self, TypeVar

import numpy as np
from pydantic import Field, create_model

from solver.contacts.fields import LARGEST, LEAST_SAMPLES, MOST_SAMPLES, Real, Samples
from solver.contacts.kernels import columns
from solver.contacts.laws import law_registry as registry
from solver.contacts.laws.contact_law import AnyContact, RateContact
from solver.contacts.laws.contact_parts import Follows, LawQuantity, RestStiffness, Row
from solver.errors import SettingError

MOST_STATES = 200
_NAME = re.compile(r"[a-z][a-z0-9-]*\Z")
_KEY = re.compile(r"[A-Za-z][A-Za-z0-9_]*\Z")
_TAKEN = {"name", "law", "between", "group", "samples", "at", "normal", "tangents", "motions"}


class Derivatives(Enum):
    """How the derivatives of a law's functions are found; the value is what a plan says."""

    BY_HAND = "derivatives by hand"
    COMPLEX_STEP = "derivatives by a complex step of its functions, exact to rounding"
    DIFFERENCES = "derivatives by central differences of its functions, to about 1e-8"


@dataclass(frozen=True, slots=True, kw_only=True)
class LawParameter:
    """A parameter of a law.

    Attributes
    ----------
    unit : str
        Empty of a pure number.
    words : str
        What it is, for the schema of scenes and the page.
    least, most : float
        Its bounds.
    above : bool
        Whether it must be above `least`, not at it.
    below : bool
        Whether it must be below `most`, not at it.
    default : float or None
        Its value where a scene leaves it out; None: a scene must give it.
    symbol : str
        How people write it; as its key if empty.
    """

    unit: str = ""
    words: str = ""
    least: float = -LARGEST
    most: float = LARGEST
    above: bool = False
    below: bool = False
    default: float | None = None
    symbol: str = ""

    @property
    def wanted(self) -> str:
        """What a value must be, for the message of a bad one."""
        low = f"{'>' if self.above else '>='} {self.least:g}"
        high = f"{'<' if self.below else '<='} {self.most:g}"
        return f"must be a number {low} and {high}" + (f" [{self.unit}]" if self.unit else "")

    def accepts(self, value: float) -> bool:
        """Whether it may have a value."""
        low = value > self.least if self.above else value >= self.least
        return math.isfinite(value) and low and (value < self.most if self.below else value <= self.most)

    def quantity(self, column: int) -> LawQuantity:
        """Return it as a column of the contact table."""
        return LawQuantity(
            column=column, unit=self.unit, wanted=self.wanted, least=self.least, symbol=self.symbol
        )  # fmt: skip


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class HistoryLaw:
    """A law given by functions, see `register_law`; each is its own."""

    name: str = field(kw_only=False)
    parameters: Mapping[str, LawParameter]
    force: Callable[..., Any] | None = None
    rate: Callable[..., Any] | None = None
    step: Callable[..., Any] | None = None
    slopes: Callable[..., Any] | None = None
    derivatives: Derivatives | None = None
    states: int = 0
    samples: int | None = None
    reversals: bool = False
    independent: bool = False
    odd: bool = False
    monotone: bool = False
    rubs: bool = True
    formula: str = ""
    words: str = ""
    columns: Mapping[str, int] = field(init=False, default_factory=dict)

    def __post_init__(self) -> None:
        object.__setattr__(self, "parameters", dict(self.parameters))
        _check_names(self)
        _check_functions(self)
        object.__setattr__(self, "columns", {key: columns.OWN + i for i, key in enumerate(self.parameters)})

    @property
    def functions(self) -> dict[str, Callable[..., Any]]:
        """Its functions by their place in `solver.jit.law_functions`."""
        slopes = "rate_slopes" if self.step is None else "step_slopes"
        named = {"rate": self.rate, "force": self.force, "step": self.step, slopes: self.slopes}
        return {place: function for place, function in named.items() if function is not None}


def _check_names(law: HistoryLaw) -> None:
    if not isinstance(law.name, str) or not _NAME.match(law.name):
        raise SettingError("name", law.name, "must be lower-case letters, digits and - after a letter")
    if not 1 <= len(law.parameters) <= columns.MOST_OWN:
        raise SettingError("parameters", len(law.parameters), f"must be 1 to {columns.MOST_OWN}")
    for key, parameter in law.parameters.items():
        if not isinstance(key, str) or not _KEY.match(key) or key in _TAKEN:
            wanted = "must be letters, digits and _ after a letter, and no key that every contact has"
            raise SettingError("parameters", key, wanted)
        if not isinstance(parameter, LawParameter):
            raise SettingError(f"parameters.{key}", parameter, "must be a `solver.LawParameter`")
        if not -LARGEST <= parameter.least < parameter.most <= LARGEST:
            bounds = (parameter.least, parameter.most)
            raise SettingError(f"parameters.{key}", bounds, "must have least < most, from -1e15 to 1e15")
        if parameter.default is not None and not parameter.accepts(parameter.default):
            raise SettingError(f"parameters.{key}.default", parameter.default, parameter.wanted)


def _check_functions(law: HistoryLaw) -> None:
    for key in ("force", "rate", "step", "slopes"):
        function = getattr(law, key)
        if function is not None and not callable(function):
            raise SettingError(key, function, "must be a function")
    if (law.step is None) == (law.force is None):
        raise SettingError("force", law.force, "must be given, or `step` in its place")
    if law.step is not None and law.rate is not None:
        raise SettingError("rate", law.rate, "goes with `force`, not with `step`")
    whole = isinstance(law.states, int) and not isinstance(law.states, bool)
    if not whole or not 0 <= law.states <= MOST_STATES:
        raise SettingError("states", law.states, f"must be a whole number from 0 to {MOST_STATES}")
    if law.step is None and (law.rate is not None) != (law.states > 0):
        raise SettingError("states", law.states, "must be above 0 with a `rate`, and 0 without")
    samples = law.samples
    if samples is not None and not (
        isinstance(samples, int)
        and LEAST_SAMPLES <= samples <= MOST_SAMPLES
        and not isinstance(samples, bool)
    ):
        wanted = f"must be a whole number from {LEAST_SAMPLES} to {MOST_SAMPLES}"
        raise SettingError("samples", samples, wanted)
    if law.derivatives is Derivatives.BY_HAND and law.slopes is None:
        raise SettingError("derivatives", law.derivatives.name, "needs `slopes`, the derivatives by hand")


NODES_A_HARMONIC, BETWEEN_REVERSALS = 32, 16
_SMALL = 1e-9  # m; the motion whose force tells the stiffness at rest
_FORM = {"steps": 1, "reversals": 2, "alone": 4}  # bits of `solver.contacts.kernels.history.history_law`


class HistoryContact(RateContact):
    """A law given by functions of the motion and its history."""

    DEFINITION: ClassVar[HistoryLaw]
    KERNEL: ClassVar[str] = "solver.contacts.kernels.history.history_law:history_law"
    HELD: ClassVar[tuple[RestStiffness, ...]] = (RestStiffness(columns.KT),)
    WORDS: ClassVar[Mapping[str, str]] = {}

    samples: Annotated[
        Samples | None,
        "Nodes of a period at which the law is followed; 32 for each harmonic if left out, or 16 where "
        "they begin anew at every reversal.",
    ] = None

    def __reduce__(self) -> tuple[Any, ...]:
        """Be sent to another process by the word of its law: the class is made there as it was here."""
        return _of_law, (self.LAW,), self.__getstate__()

    @classmethod
    def prepare(cls) -> None:
        """Compile the functions of the law."""
        from solver.contacts.laws.history.functions import ready

        ready(cls.DEFINITION)

    @property
    def numbers(self) -> Real:
        """Its parameters as its functions take them, (MOST_OWN,)."""
        found = np.zeros(columns.MOST_OWN)
        for i, key in enumerate(self.DEFINITION.parameters):
            found[i] = getattr(self, key)
        return found

    @property
    def stiffness(self) -> float:
        """Its stiffness at rest, of a small motion from where nothing has happened [N/m]; 0 if it is none."""
        return self._slope_at_rest(_SMALL, 1.0, 1.0)

    @property
    def damping(self) -> float:
        """Its damping at rest, of a small velocity where nothing has happened [N s/m]; 0 if it is none."""
        return self._slope_at_rest(0.0, 0.0, _SMALL)

    def _slope_at_rest(self, u: float, v: float, after: float) -> float:
        """Return the slope of the force over a motion `u`, or a velocity that goes from `v` to `after`."""
        law, p = self.DEFINITION, self.numbers
        plain = {place: getattr(one, "py_func", one) for place, one in law.functions.items()}
        state, moved = np.zeros(law.states), np.zeros(law.states)
        with np.errstate(all="ignore"):
            if "step" in plain:
                here = plain["step"](0.0, v, 0.0, _SMALL, state, moved, p)
                there = plain["step"](u, after, u, _SMALL, state, moved, p)
            else:
                if "rate" in plain:
                    plain["rate"](0.0, after, state, p, moved)
                here = plain["force"](0.0, v, state, p)
                there = plain["force"](u, after, state + u / after * moved, p)
        found = (float(there) - float(here)) / _SMALL
        return found if math.isfinite(found) and found > 0.0 else 0.0

    @property
    def stiffnesses(self) -> tuple[float, ...]:
        """A stiffness of each relative motion [N/m]: what holds it when the contact is closed and stuck."""
        return (self.stiffness,)

    def fill(self, row: Real, highest: int) -> None:
        """Put its numbers into its row of the contact table, with the nodes for harmonics up to `highest`."""
        from solver.contacts.laws.history.functions import WAYS, ready

        super().fill(row, highest)
        law, found = self.DEFINITION, ready(self.DEFINITION)
        row[columns.KT] = self.stiffness
        row[columns.NODES] = self.nodes(highest)
        row[columns.HISTORY_LAW], row[columns.HISTORY_STATES] = found.number, law.states
        bits = {"steps": law.step is not None, "reversals": law.reversals, "alone": law.independent}
        row[columns.HISTORY_FORM] = sum(_FORM[name] for name, has in bits.items() if has)
        row[columns.HISTORY_WAY] = WAYS[found.derivatives]

    def nodes(self, highest: int) -> int:
        """Return the nodes of a period for harmonics up to `highest`: at least four of the shortest wave."""
        given = self.samples or self.DEFINITION.samples
        return max(given, 4 * highest) if given else max(self._nodes_a_harmonic * highest, 2 * LEAST_SAMPLES)

    @property
    def _nodes_a_harmonic(self) -> int:
        return BETWEEN_REVERSALS if self.DEFINITION.reversals else NODES_A_HARMONIC

    def with_numbers(self, row: Real) -> Self:
        """The contact with the numbers of a row of the contact table."""
        moved = super().with_numbers(row)
        if self.samples is None:
            return moved
        return moved.model_copy(update={"samples": int(row[columns.NODES])})

    @property
    def answers_unlike(self) -> str | None:
        """Why it answers a motion and its negative half a period later differently, or None."""
        return None if self.DEFINITION.odd else f"the law of {self.name} is not said to be odd"

    @property
    def several_responses(self) -> str | None:
        """Why a half-wave symmetric response need not be the only one, or None."""
        if self.DEFINITION.monotone:
            return None
        return f"the law of {self.name} is not said to keep motions together, so others are possible"

    @property
    def keeps_together(self) -> bool:
        """Whether it never lets two motions under the same forces move apart."""
        return self.DEFINITION.monotone

    @property
    def evaluation(self) -> str:
        """How its force is found, in the words of a plan."""
        from solver.contacts.laws.history.functions import ready

        law, found = self.DEFINITION, ready(self.DEFINITION)
        given = self.samples or law.samples
        nodes = f"{given} nodes" if given else f"{self._nodes_a_harmonic} nodes a harmonic"
        between = " between its reversals" if law.reversals else ""
        slow = "" if found.compiled else "; its functions are called as Python, which is slow"
        return f"the law {law.name} followed over {nodes}{between}, {found.derivatives.value}{slow}"

    def force_at(self, motions: Real, load: Real, tau: Real) -> Real:
        """Return the force along the first motion [N] at the angles `tau`, evenly spaced from 0.

        Raises
        ------
        SettingError
            The frequency is not known (`at_frequency`), or the law gives no finite force that repeats.
        """
        from solver.contacts.kernels.history.history_law import history_forces
        from solver.jit import fourier

        del load
        row, highest = np.zeros(columns.COLUMNS), (motions.shape[1] - 1) // 2
        self.fill(row, highest)
        row[columns.OMEGA] = self.omega
        finer = max(1, math.ceil(4 * self.nodes(highest) / tau.size))
        force = np.empty(finer * tau.size)
        if not history_forces(motions[0], fourier.all_harmonics(highest), row, force.size, force):
            raise SettingError("contact", self.name, "must have a law whose force is finite and repeats")
        return force[::finer]

    def rows(self) -> tuple[Row, ...]:
        """Return its row of the time march, which follows the same functions in its own steps."""
        from solver.contacts.laws.history.functions import ready

        law = self.DEFINITION
        return (
            Row(
                name=self.name, follows=Follows.HISTORY, kt=self.stiffness, history=ready(law).number,
                in_steps=law.step is not None, states=law.states, damping=self.damping,
                numbers=tuple(self.numbers.tolist()),
            ),
        )  # fmt: skip


def _of_law(word: str) -> AnyContact:
    """A contact of a law, as yet without numbers."""
    law = registry.laws()[word]
    return law.__new__(law)


_P = ParamSpec("_P")
_T = TypeVar("_T")
_FORMULA = "a function of the motion and its history"


def law_class(law: HistoryLaw, base: type[HistoryContact] = HistoryContact) -> type[HistoryContact]:
    """Return the class of the contacts of a law; `base` may answer more than functions do."""
    fields: dict[str, Any] = {"law": (Literal[law.name], ...)}
    fields |= {
        key: (_type(parameter), ... if parameter.default is None else parameter.default)
        for key, parameter in law.parameters.items()
    }
    made = create_model(
        "".join(part.capitalize() for part in law.name.split("-")) + "Contact",
        __base__=base, __module__=base.__module__, __doc__=law.words or f"A contact of the law {law.name}.",
        **fields,
    )  # fmt: skip
    made.DEFINITION, made.LAW = law, law.name
    made.FORCE = law.formula or _FORMULA
    made.PARAMETERS = {key: one.quantity(law.columns[key]) for key, one in law.parameters.items()}
    made.WORDS = {key: _described(one) for key, one in law.parameters.items()}
    made.RUBBING = (0,) if law.rubs else ()
    return made


def _type(parameter: LawParameter) -> Any:
    bounds: dict[str, Any] = {
        "gt" if parameter.above else "ge": parameter.least, "lt" if parameter.below else "le": parameter.most
    }  # fmt: skip
    return Annotated[float, Field(strict=True, allow_inf_nan=False, **bounds)]


def _described(parameter: LawParameter) -> str:
    words = parameter.words.rstrip(".") or "A parameter of the law"
    unit = f" [{parameter.unit}]" if parameter.unit else ""
    default = "" if parameter.default is None else f"; {parameter.default:g} if left out"
    return f"{words}{unit}{default}."


def _takes(definition: Callable[_P, HistoryLaw]) -> Callable[[Callable[..., _T]], Callable[_P, _T]]:
    """Give a function the arguments of a definition, for those who ask and those who check."""

    def with_arguments(function: Callable[..., _T]) -> Callable[_P, _T]:
        given, own = inspect.signature(definition), inspect.signature(function)
        function.__signature__ = given.replace(return_annotation=own.return_annotation)  # type: ignore[attr-defined]
        return function

    return with_arguments


@_takes(HistoryLaw)
def register_law(*name: str, **given: Any) -> type[AnyContact]:
    """Add a law in this process, given by functions of the motion and its history.

    The law is either in rate form, `force(u, v, state, p) → float` and, with states, `rate(u, v, state, p,
    out)`, which fills d(state)/dt, or in samples, `step(u, v, du, dt, last, state, p) → float`, which fills
    the state after a change du of the motion in the time dt and returns the force. u is the relative motion
    [m] of `between`, v its velocity [m/s], p the parameters in their order. A positive force pulls the first
    end towards the second. At the beginning the states are 0 and nothing has moved.

    A period is followed, from that beginning, until the state repeats: two turns or more, then by Newton's
    method on the map of a period. Where it does not repeat, or a force is not finite, the point has not
    converged.

    The functions may be plain Python, which is compiled, or compiled by `numba.njit`; what Numba cannot
    compile is called as Python. They may not call back into a scene.

    Parameters
    ----------
    name : str
        The word of `law` in a scene: lower-case letters, digits and -.
    parameters : mapping
        The numbers of the law in the order of `p`, at most 9.
    force, rate, step : functions
        See above.
    states : int
        How many states there are.
    slopes : function, optional
        The derivatives by hand: `slopes(u, v, state, p, out)` of a law in rate form fills the rows (rates,
        force) by the columns (u, v, states, parameters), `slopes(u, v, du, dt, last, state, p, out)` of one
        in samples the rows (states, force) by (u, v, du, dt, states before, parameters). An entry that is
        never set is 0. Without it derivatives are found by a complex step if the functions are found to allow
        it, else by central differences; the plan says which.
    derivatives : solver.contacts.laws.history.function_law.Derivatives, optional
        How they are found, in place of trying.
    samples : int, optional
        Nodes of a period; 32 a harmonic if left out, 16 with `reversals`. A contact may set its own
        `samples`.
    reversals : bool
        Whether nodes begin anew where the motion reverses: right for friction, whose force has corners there
        and is smooth between. Without, the nodes are even: right for a smooth force, and for one that has
        corners elsewhere.
    independent : bool
        Whether each state follows by itself, as those of sliders side by side.
    odd : bool
        Whether the negative motion has the negative force.
    monotone : bool
        Whether the law never lets two motions under the same forces move apart, as springs and dry friction.
    rubs : bool
        Whether it is friction, whose work counts as wear.
    formula, words : str
        The force in a line for the table of laws, and a sentence for the schema of scenes.

    Returns
    -------
    The class of its contacts, which `STICKSLIP_EXTENSIONS` may name.

    Raises
    ------
    SettingError
        An argument is wrong.
    ValueError
        There is a law of this name.
    """
    return registry.register(law_class(HistoryLaw(*name, **given)))
