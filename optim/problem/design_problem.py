"""The description of a design problem: what may be chosen, what is minimised, what is limited."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from typing import Annotated, Any

from optim.criteria.criterion import (
    Criterion,
    CriterionContext,
    Goals,
    by_weight,
    criteria,
    limit_keys,
    weight_words,
)
from optim.criteria.peak_criterion import PEAK
from optim.problem.cases import LoadCase, read_cases
from optim.problem.checks import DesignError, is_number, positive, whole, word
from optim.problem.checks import Method as Method
from optim.problem.problem_keys import BASINS, HARMONICS, MOST_BASINS, TOLERANCE
from optim.problem.variables import BoundedVariable, beside_cases, check_variables
from solver.balance.balance import check_harmonics
from solver.contacts.laws.contact_law import without_second
from solver.scene.parameter_paths import parameter_of
from solver.scene.scene import Scene
from solver.wording import nearest

MOST_WORD = "max_"  # which keys of a largest value begin with


@dataclass(frozen=True, slots=True, kw_only=True)
class Problem(Goals):
    """A design problem, checked."""

    scene: Annotated[Scene, "What is designed."]
    cases: Annotated[tuple[LoadCase, ...], "The responses it is judged by."]
    harmonics: Annotated[int, "Highest harmonic kept."]
    start: Annotated[Mapping[str, float] | None, "A design to start from, variable name to value."]
    method: Annotated[Method, "How it is searched."]
    basins: Annotated[int, "How many local optima are looked for."]
    tolerance: Annotated[float, "Relative error of the peak up to which a performance curve suffices."] = (
        TOLERANCE
    )
    keeps_measure: Annotated[
        bool,
        "Whether the measure that the scene observes stays where the mean is free: designs that are "
        "compared need one measure.",
    ] = False

    @property
    def scales(self) -> dict[Criterion, float]:
        """What an excess over a bound of 0 is relative to, of every criterion in order."""
        return {criterion: criterion.scale(self.scene) for criterion in criteria()}

    @property
    def plain(self) -> bool:
        """Whether it asks for nothing but the least peak of one case."""
        return len(self.cases) == 1 and not self.limits and self.peak_alone

    @property
    def peak_alone(self) -> bool:
        """Whether nothing but the peak is minimised."""
        return not any(weight > 0.0 for one, weight in self.weights.items() if one is not PEAK)

    @property
    def why_not_tracked(self) -> str | None:
        """Why this is no problem for the method of the tracked peak; None if it is one."""
        if not self.plain:
            return "tracked is for the highest peak of one case alone, without limits"
        if len(self.paths) != 1:
            return "tracked takes one variable with one parameter path"
        if self.scene.speed_order is not None:
            return (
                "tracked takes no engine-order line (`speed_order`), along which loads follow the frequency"
            )
        if self.cases[0].scene.observe.centred:
            return "tracked follows max|x|, and half peak to peak is observed"
        if parameter_of(self.scene, self.paths[0]).moves_contacts:
            return f"tracked follows no geometry: `{self.paths[0]}` moves the contacts"
        others = without_second(self.scene.contacts)
        if others:
            return f"tracked needs laws with second derivatives, which {others} has not"
        return None

    @property
    def why_no_curve(self) -> str | None:
        """Why this is no problem for a performance curve; None if it is one."""
        if not self.plain:
            return "performance-curve is for the highest peak of one case alone, without limits"
        if self.scene.speed_order is not None:
            return "performance-curve takes no engine-order line (`speed_order`)"
        if self.cases[0].scene.observe.centred:
            return "performance-curve is for max|x|, and half peak to peak is observed"
        if any(force.harmonic != 1 for force in self.cases[0].scene.excitation):
            return "performance-curve takes an excitation of harmonic 1 alone"
        return None


def pose(scene: Scene, limits: Sequence[Limit] = (), **given: Any) -> Problem:
    """Check a design problem and put it together.

    Parameters
    ----------
    limits : bounds with types, in place of the keys `max_peak` and its like.
    given : keys of `problem_keys.DesignKeys` but those of an uncertainty; None stands for left out.

    Raises
    ------
    SettingError, SceneError, DesignError
        What is wrong: the argument, the value, and what would be right.
    TypeError
        An argument that is no key of a problem.
    """
    given = with_limits(given, limits)
    known = {*WITH_OTHERS, *READERS, *(key.name for key in limit_keys())}
    unknown = next((name for name in given if name not in known), None)
    if unknown is not None:
        raise TypeError(f"there is no argument {unknown!r}; there are {', '.join(sorted(known))}")
    keys: dict[str, Any] = {name: given.get(name) for name in known}
    chosen = check_variables(scene, keys["variables"], keys["scaling"])
    cases = read_cases(scene, keys["cases"], beside_cases(chosen, keys["variables"]))
    limit = keys["limit"]
    if limit is not None:
        positive("limit", limit)
    kept = _limits(scene, cases, limit, keys)
    basins, weights = _basins(keys["basins"]), _weights(keys["weights"])
    for one in (one for one, weight in weights.items() if weight > 0.0 and one.lacking(scene)):
        raise DesignError(("weights", one.weight), weights[one], one.lacking(scene))
    for one in (one for one, weight in weights.items() if weight > 0.0 and one.needs):
        if one not in kept:
            raise DesignError(("weights", one.weight), weights[one], f"needs `{one.needs}`")
    problem = Problem(
        scene=scene, variables=chosen, cases=cases, limit=limit, weights=weights,
        limits=kept, harmonics=_harmonics(keys["harmonics"]), start=read_start(chosen, keys["start"]),
        method=_method(keys["method"]), basins=basins, tolerance=_tolerance(keys["tolerance"]),
    )  # fmt: skip
    if problem.method is Method.PERFORMANCE_CURVE:
        if problem.why_no_curve is not None:
            raise DesignError("method", keys["method"], f"must be another one: {problem.why_no_curve}")
    elif keys["tolerance"] is not None:
        raise DesignError("tolerance", keys["tolerance"], "is for the method performance-curve alone")
    if problem.method is Method.TRACKED and problem.why_not_tracked is not None:
        raise DesignError("method", keys["method"], f"must be another one: {problem.why_not_tracked}")
    return problem


@dataclass(frozen=True, slots=True)
class Limit:
    """An upper bound that a design must keep.

    Attributes
    ----------
    what : str
        `peak` [m], `band_hz` [Hz], `friction_work` [J], or of what another criterion has a key ``max_…``.
    at_most : float
        The bound.
    contact : str or None
        The contact that it holds for, of what is a limit for each contact.
    """

    what: str
    at_most: float
    contact: str | None = None


def with_limits(problem: Mapping[str, object], limits: Sequence[Limit]) -> dict[str, object]:
    """Return the keys of a problem with limits among them.

    Raises
    ------
    DesignError
        A limit of what is not known, or one that is given twice.
    """
    found = dict(problem)
    known = [key.name for key in limit_keys() if key.name.startswith(MOST_WORD)]
    for i, one in enumerate(limits):
        if not isinstance(one, Limit):
            raise DesignError(("limits", i), one, 'must be a Limit, such as Limit("peak", 1e-4)')
        key = f"{MOST_WORD}{one.what}"
        if key not in known:
            words = [name.removeprefix(MOST_WORD) for name in known]
            wanted = f"is not known; there are limits of {', '.join(words)}{nearest(str(one.what), words)}"
            raise DesignError(("limits", i, "what"), one.what, wanted)
        before = found.get(key)
        if one.contact is None and before is None:
            found[key] = one.at_most
        elif one.contact is not None and (before is None or isinstance(before, Mapping)):
            if before is not None and one.contact in before:
                raise DesignError(("limits", i), one.what, f"is given twice for {one.contact!r}")
            found[key] = {**(before or {}), one.contact: one.at_most}
        else:
            raise DesignError(("limits", i), one.what, "is given twice")
    return found


def _weights(weights: Mapping[str, float] | None) -> dict[Criterion, float]:
    """Return the weights of everything that can be minimised; the peak alone without any."""
    found = {one: 0.0 for one in criteria() if one.weight}
    if weights is None:
        return {**found, PEAK: 1.0}
    if not isinstance(weights, Mapping):
        raise DesignError("weights", weights, 'must be a table such as {"peak": 1.0, "band": 0.0}')
    for name, value in weights.items():
        criterion = by_weight(name)
        if criterion is None:
            *others, last = (f"`{word}`" for word in weight_words())
            known = f"{', '.join(others)} and {last}"
            raise DesignError(("weights", name), value, f"is not known; {known} can be minimised")
        if not is_number(value) or value < 0.0:
            raise DesignError(("weights", name), value, "must be a number >= 0")
        found[criterion] = float(value)
    if not any(found.values()):
        raise DesignError("weights", dict(weights), "must have at least one number > 0")
    return found


def _limits(
    scene: Scene, cases: tuple[LoadCase, ...], limit: float | None, given: Mapping[str, object]
) -> dict[Criterion, Any]:  # fmt: skip
    """Return what the keys of the criteria come to."""
    read: dict[Criterion, Any] = {}
    for one in criteria():
        values = {key.name: given[key.name] for key in one.keys if given.get(key.name) is not None}
        if values:
            read[one] = one.read(CriterionContext(scene=scene, cases=cases, limit=limit, values=values))
    return read


def read_start(
    variables: tuple[BoundedVariable, ...], start: Mapping[str, float] | None
) -> dict[str, float] | None:
    """Return the start with every variable in it, or None; DesignError if one is out of its bounds."""
    if start is None:
        return None
    if not isinstance(start, Mapping):
        raise DesignError("start", start, "must be a table of variables and values")
    names = [variable.name for variable in variables]
    for name in start:
        if name not in names:
            wanted = f"must name the variables {', '.join(names)}"
            raise DesignError("start", name, wanted, place=("start", name))
    for variable in variables:
        value = start.get(variable.name)
        number = isinstance(value, (int, float)) and not isinstance(value, bool)
        if not number or not variable.low <= value <= variable.high:  # type: ignore[operator]
            wanted = f"must be from {variable.low} to {variable.high}"
            raise DesignError(("start", variable.name), value, wanted)
    return {name: float(start[name]) for name in names}


def _harmonics(harmonics: int | None) -> int:
    return check_harmonics(HARMONICS if harmonics is None else harmonics)


def _method(method: object) -> Method:
    return Method.AUTO if method is None else word("method", method, Method)


def _basins(basins: object) -> int:
    return BASINS if basins is None else whole("basins", basins, least=1, most=MOST_BASINS)


def _tolerance(tolerance: object) -> float:
    if tolerance is None:
        return TOLERANCE
    if not is_number(tolerance) or not 0.0 < tolerance <= 1.0:
        raise DesignError("tolerance", tolerance, "must be a relative error above 0, at most 1")
    return float(tolerance)


READERS: Mapping[str, Callable[[Any], object]] = {
    "weights": _weights, "harmonics": _harmonics, "method": _method, "basins": _basins,
    "tolerance": _tolerance,
}  # fmt: skip
"""The keys whose values stand alone, with what reads them."""
WITH_OTHERS = ("variables", "scaling", "cases", "limit", "start")
"""The keys whose values depend on the scene or on other keys."""
