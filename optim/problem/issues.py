"""Everything wrong with the description of a design problem, each thing with the pointer of its field.

A description is read as a whole; if that is refused, it is read once more key by key, each alone.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping
from functools import partial
from typing import Any

from optim.criteria.criterion import CriterionContext, criteria
from optim.problem.cases import read_case, read_cases
from optim.problem.checks import positive
from optim.problem.design_problem import READERS, pose, read_start
from optim.problem.uncertainty_input import read_uncertain
from optim.problem.variables import beside_cases, check_variables
from solver.errors import Issue, Place, SceneError, SettingError
from solver.scene.scene import Scene

Refusal = SettingError | SceneError
Piece = tuple[Place, Callable[[], object]]
ANY_LIMIT = 1.0  # [m], for what is refused without one: which it is does not matter to them


def problem_issues(scene: Scene, given: Mapping[str, Any]) -> list[Issue]:
    """Return everything wrong with a description.

    Parameters
    ----------
    scene : what is designed.
    given : the arguments of `optim.problem.design_problem.pose`, as tables and lists.
    """
    whole = _refusal((), partial(pose, scene, **given))
    if whole is None:
        return []
    refused = _refused(_variables(scene, given))
    sound = not refused
    refused += _refused(_cases(scene, given)) + _refused(_others(scene, given, sound=sound))
    return [issue for error in refused or [whole] for issue in _told(error, given)]


def uncertainty_issues(scene: Scene, given: Mapping[str, Any], uncertain: object) -> list[Issue]:
    """Return what is wrong with the key `uncertain`; nothing if the variables are wrong: it depends on them.

    Parameters
    ----------
    scene : what is designed.
    given : the other keys.
    uncertain : tables or a list, see `optim.problem.uncertainty_input.read_uncertain`.
    """
    read = partial(check_variables, scene, given.get("variables"))
    if _refused(_variables(scene, given)) or _refusal(("variables",), read) is not None:
        return []
    variables = read()
    read_all = partial(read_cases, scene, given.get("cases"), variables)
    cases = read_all() if _refusal(("cases",), read_all) is None else ()
    refused = _refused([(("uncertain",), partial(read_uncertain, scene, variables, uncertain, cases))])
    return [issue for error in refused for issue in _told(error, {"uncertain": uncertain})]


def reading_issues(read: Callable[[], object], given: Mapping[str, Any]) -> list[Issue]:
    """Return what the reading of keys of a description refuses, at the innermost field that is there."""
    error = _refusal((), read)
    return [] if error is None else _told(error, given)


def _variables(scene: Scene, given: Mapping[str, Any]) -> Iterator[Piece]:
    """Yield the reading of each variable alone, or of the default."""
    variables: Mapping[str, Any] | None = given.get("variables")
    if variables is None:
        yield ("variables",), partial(check_variables, scene, None)
    for name, bounds in (variables or {}).items():
        yield ("variables", name), partial(check_variables, scene, {name: bounds})


def _cases(scene: Scene, given: Mapping[str, Any]) -> Iterator[Piece]:
    """Yield the reading of each case alone, beside the variables if those are right."""
    bounds = given.get("variables")
    read = partial(check_variables, scene, bounds)
    variables = beside_cases(read(), bounds) if _refusal(("variables",), read) is None else ()
    for index, case in enumerate(given.get("cases", ())):
        yield ("cases", index), partial(read_case, scene, index, case, variables)


def _others(scene: Scene, given: Mapping[str, Any], *, sound: bool) -> Iterator[Piece]:
    """Yield the reading of each other key alone; what needs the variables only if those are `sound`."""
    variables = given.get("variables")
    owners = {key.name: (one, key) for one in criteria() for key in one.keys}
    for name, value in given.items():
        if name in owners:
            one, key = owners[name]
            limit = ANY_LIMIT if key.needs_limit else None
            values = {word: given[word] for word in (name, key.beside) if word in given}
            asked = CriterionContext(scene=scene, cases=read_cases(scene, None), limit=limit, values=values)
            yield (name,), partial(one.read, asked)
        elif name in READERS:
            yield (name,), partial(READERS[name], value)
        elif name == "limit":
            yield (name,), partial(positive, name, value)
        elif name == "scaling" and sound:
            yield (name,), partial(check_variables, scene, variables, value)
        elif name == "start" and sound:
            yield (name,), partial(_start, scene, variables, value)


def _start(scene: Scene, variables: Mapping[str, Any] | None, start: Mapping[str, Any]) -> object:
    return read_start(check_variables(scene, variables), start)


def _refused(pieces: Iterator[Piece] | list[Piece]) -> list[Refusal]:
    """Return the refusals of pieces that speak of the piece itself."""
    found = [(where, _refusal(where, read)) for where, read in pieces]
    return [error for where, error in found if error is not None and error.place[:1] == where[:1]]


def _refusal(where: Place, read: Callable[[], object]) -> Refusal | None:
    """Return the exception that `read` raises, which speaks of `where` at least; None without one."""
    try:
        read()
    except (SettingError, SceneError) as error:
        if error.place == where[: len(error.place)]:
            error.place = where
        return error
    return None


def _told(error: Refusal, given: Mapping[str, Any]) -> list[Issue]:
    """Return a refusal as issues, at the innermost field of its place that is there."""
    there: Place = ()
    value: Any = given
    for step in error.place:
        steps = range(len(value)) if isinstance(value, list) else value
        if not isinstance(steps, Mapping | range) or step not in steps:
            break
        there, value = (*there, step), value[step]
    # A key that is missing is named all the same.
    there = there or error.place[:1]
    issues = error.issues if isinstance(error, SceneError) else (error.issue,)
    return [one.at(*there) for one in issues]
