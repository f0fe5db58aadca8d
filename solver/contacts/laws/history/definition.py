"""What a law with a history is made of: its functions, its parameters, what is said of it."""

from __future__ import annotations

import math
import re
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from enum import Enum
from typing import Any

from solver.contacts.fields import LARGEST, LEAST_SAMPLES, MOST_SAMPLES
from solver.contacts.kernels.columns import MOST_OWN, OWN
from solver.contacts.laws.contact_parts import LawQuantity
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
    """A law given by functions, see `solver.contacts.laws.history.register.register_law`; each is its own."""

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
        object.__setattr__(self, "columns", {key: OWN + i for i, key in enumerate(self.parameters)})

    @property
    def functions(self) -> dict[str, Callable[..., Any]]:
        """Its functions by their place in `solver.jit.law_functions`."""
        slopes = "rate_slopes" if self.step is None else "step_slopes"
        named = {"rate": self.rate, "force": self.force, "step": self.step, slopes: self.slopes}
        return {place: function for place, function in named.items() if function is not None}


def _check_names(law: HistoryLaw) -> None:
    if not isinstance(law.name, str) or not _NAME.match(law.name):
        raise SettingError("name", law.name, "must be lower-case letters, digits and - after a letter")
    if not 1 <= len(law.parameters) <= MOST_OWN:
        raise SettingError("parameters", len(law.parameters), f"must be 1 to {MOST_OWN}")
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
