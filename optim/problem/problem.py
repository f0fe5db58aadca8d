"""The description of a design problem: what may be chosen, what is minimised, what is limited."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from enum import Enum

from optim.criteria.rows import Quantity
from optim.errors import DesignError
from optim.problem.cases import Case, number_pair, positive, read_cases
from optim.problem.variables import Variable, check_variables
from solver.balance.balance import check_harmonics
from solver.scene.scene import Contact, FrictionContact, Scene

Ranges = tuple[tuple[float, float], ...]
MOST_BASINS = 20
NEVER_SEPARATES = "never-separates"


class Method(Enum):
    """How the optimum is searched; the value is the word users write."""

    AUTO = "auto"
    TRACKED = "tracked"
    MINIMAX = "minimax"
    IPOPT = "ipopt"


@dataclass(frozen=True, slots=True, kw_only=True)
class Limits:
    """What a design must keep.

    Attributes
    ----------
    peak : float or None
        Largest amplitude over the band of any case [m].
    band_hz : float or None
        Widest resonance band of any case [Hz].
    forbidden_hz : mapping of case name to ranges
        Frequencies [Hz] in which the amplitude must not exceed the limit that defines the band.
    friction_work : mapping of contact to float
        Largest friction work in a cycle at any frequency of the band [J].
    in_contact : tuple of str
        Contacts that must never separate.
    """

    peak: float | None
    band_hz: float | None
    forbidden_hz: Mapping[str, Ranges]
    friction_work: Mapping[str, float]
    in_contact: tuple[str, ...]

    @property
    def any(self) -> bool:
        """Whether there is a limit at all."""
        given = (self.forbidden_hz, self.friction_work, self.in_contact)
        return self.peak is not None or self.band_hz is not None or any(given)


@dataclass(frozen=True, slots=True, kw_only=True)
class Problem:
    """A design problem, checked.

    Attributes
    ----------
    scene : Scene
        What is designed.
    variables : tuple of Variable
        What may be chosen.
    cases : tuple of Case
        The responses it is judged by.
    limit : float or None
        Amplitude [m] above which the resonance band is measured; half power of the highest peak if None.
    weights : mapping of Quantity to float
        What is minimised: the largest peak [m] and the widest band [Hz], each times its weight, summed.
    limits : Limits
        What must be kept.
    harmonics : int
        Highest harmonic kept.
    start : mapping or None
        A design to start from, variable name to value.
    method : Method
        How it is searched.
    basins : int
        How many local optima are looked for.
    """

    scene: Scene
    variables: tuple[Variable, ...]
    cases: tuple[Case, ...]
    limit: float | None
    weights: Mapping[Quantity, float]
    limits: Limits
    harmonics: int
    start: Mapping[str, float] | None
    method: Method
    basins: int

    @property
    def paths(self) -> tuple[str, ...]:
        """Every parameter path of every variable."""
        return tuple(path for variable in self.variables for path in variable.paths)

    @property
    def plain(self) -> bool:
        """Whether it asks for nothing but the least peak of one case."""
        return len(self.cases) == 1 and not self.limits.any and self.weights[Quantity.BAND] == 0.0

    @property
    def why_not_tracked(self) -> str | None:
        """Why this is no problem for the method of the tracked peak; None if it is one."""
        if not self.plain:
            return "tracked is for the highest peak of one case alone, without limits"
        if len(self.paths) != 1:
            return "tracked takes one variable with one parameter path"
        others = [contact.name for contact in self.scene.contacts if not isinstance(contact, Contact)]
        if others:
            return f"tracked knows the law coulomb alone, not that of {', '.join(others)}"
        return None


def pose(
    scene: Scene,
    *,
    variables: Mapping[str, tuple[float, float]] | None = None,
    scaling: Mapping[str, str] | None = None,
    cases: Sequence[Mapping[str, object]] | None = None,
    limit: float | None = None,
    weights: Mapping[str, float] | None = None,
    max_peak: float | None = None,
    max_band_hz: float | None = None,
    forbidden_hz: Sequence[Sequence[float]] | None = None,
    speeds_rpm: Sequence[Sequence[float]] | None = None,
    max_friction_work: Mapping[str, float] | float | None = None,
    contact_states: Mapping[str, str] | None = None,
    harmonics: int = 11,
    start: Mapping[str, float] | None = None,
    method: str | Method = Method.AUTO,
    basins: int = 2,
) -> Problem:
    """Check a design problem and put it together; the arguments are those of `optim.design`.

    Raises
    ------
    SettingError, SceneError, DesignError
        What is wrong: the argument, the value, and what would be right.
    """
    chosen = check_variables(scene, variables, scaling)
    read = read_cases(scene, cases)
    for name, value in (("limit", limit), ("max_peak", max_peak), ("max_band_hz", max_band_hz)):
        if value is not None:
            positive(name, value)
    limits = Limits(
        peak=max_peak, band_hz=max_band_hz, forbidden_hz=_forbidden(read, forbidden_hz, speeds_rpm),
        friction_work=_friction_work(scene, max_friction_work), in_contact=_in_contact(scene, contact_states),
    )  # fmt: skip
    if limits.forbidden_hz and limit is None:
        raise DesignError("limit", None, "must be given with forbidden ranges: the amplitude allowed there")
    if isinstance(basins, bool) or not isinstance(basins, int) or not 1 <= basins <= MOST_BASINS:
        raise DesignError("basins", basins, f"must be a whole number from 1 to {MOST_BASINS}")
    problem = Problem(
        scene=scene, variables=chosen, cases=read, limit=limit, weights=_weights(weights), limits=limits,
        harmonics=check_harmonics(harmonics), start=_start(chosen, start), method=_method(method),
        basins=basins,
    )  # fmt: skip
    if problem.method is Method.TRACKED and problem.why_not_tracked is not None:
        raise DesignError("method", method, f"must be another one: {problem.why_not_tracked}")
    return problem


def _weights(weights: Mapping[str, float] | None) -> dict[Quantity, float]:
    """Return the weights of peak and band; the peak alone without any."""
    if weights is None:
        return {Quantity.PEAK: 1.0, Quantity.BAND: 0.0}
    if not isinstance(weights, Mapping):
        raise DesignError("weights", weights, 'must be a table such as {"peak": 1.0, "band": 0.0}')
    found = {Quantity.PEAK: 0.0, Quantity.BAND: 0.0}
    for name, value in weights.items():
        quantity = next((q for q in found if q.value == name), None)
        if quantity is None:
            raise DesignError(f"weights.{name}", value, "is not known; `peak` and `band` can be minimised")
        number = isinstance(value, (int, float)) and not isinstance(value, bool)
        if not number or not math.isfinite(value) or value < 0.0:
            raise DesignError(f"weights.{name}", value, "must be a number >= 0")
        found[quantity] = float(value)
    if not any(found.values()):
        raise DesignError("weights", dict(weights), "must have at least one number > 0")
    return found


def _forbidden(
    cases: tuple[Case, ...], forbidden_hz: object, speeds_rpm: object
) -> dict[str, Ranges]:  # fmt: skip
    """Return the forbidden frequencies of every case: those given, and those of the speeds by its order."""
    hertz, speeds = _ranges("forbidden_hz", forbidden_hz), _ranges("speeds_rpm", speeds_rpm)
    found = {}
    for case in cases:
        ranges = hertz + tuple((low * case.order / 60.0, high * case.order / 60.0) for low, high in speeds)
        if ranges:
            found[case.name] = ranges
    return found


def _ranges(name: str, ranges: object) -> Ranges:
    if ranges is None:
        return ()
    if not isinstance(ranges, Sequence) or isinstance(ranges, str) or not ranges:
        raise DesignError(name, ranges, "must be a list of ranges, [[low, high], …]")
    found = tuple(number_pair(f"{name}[{i}]", pair) for i, pair in enumerate(ranges))
    for i, (low, high) in enumerate(found):
        if not 0.0 < low < high:
            raise DesignError(f"{name}[{i}]", [low, high], "must have 0 < low < high")
    return found


def _friction_work(scene: Scene, limits: object) -> dict[str, float]:
    """Return the limit of every contact named; a single number is that of every friction contact."""
    if limits is None:
        return {}
    names = [contact.name for contact in scene.contacts]
    if not isinstance(limits, Mapping):
        rubbing = [contact.name for contact in scene.contacts if isinstance(contact, FrictionContact)]
        return dict.fromkeys(rubbing, positive("max_friction_work", limits))
    for name in limits:
        if name not in names:
            raise DesignError("max_friction_work", name, f"must name contacts: {', '.join(names)}")
    return {name: positive(f"max_friction_work.{name}", value) for name, value in limits.items()}


def _in_contact(scene: Scene, states: object) -> tuple[str, ...]:
    if states is None:
        return ()
    if not isinstance(states, Mapping):
        raise DesignError(
            "contact_states", states, f'must be a table such as {{"damper": "{NEVER_SEPARATES}"}}'
        )
    names = [contact.name for contact in scene.contacts if isinstance(contact, FrictionContact)]
    for name, state in states.items():
        if name not in names:
            raise DesignError("contact_states", name, f"must name friction contacts: {', '.join(names)}")
        if state != NEVER_SEPARATES:
            raise DesignError(f"contact_states.{name}", state, f"must be {NEVER_SEPARATES}")
    return tuple(states)


def _start(variables: tuple[Variable, ...], start: Mapping[str, float] | None) -> dict[str, float] | None:
    """Return the start with every variable in it, or None."""
    if start is None:
        return None
    if not isinstance(start, Mapping):
        raise DesignError("start", start, "must be a table of variables and values")
    names = [variable.name for variable in variables]
    for name in start:
        if name not in names:
            raise DesignError("start", name, f"must name the variables {', '.join(names)}")
    for variable in variables:
        value = start.get(variable.name)
        number = isinstance(value, (int, float)) and not isinstance(value, bool)
        if not number or not variable.low <= value <= variable.high:  # type: ignore[operator]
            raise DesignError(
                f"start.{variable.name}", value, f"must be from {variable.low} to {variable.high}"
            )
    return {name: float(start[name]) for name in names}


def _method(method: object) -> Method:
    if isinstance(method, Method):
        return method
    known = [one.value for one in Method]
    if method not in known:
        raise DesignError("method", method, f"must be one of {', '.join(known)}")
    return Method(method)
