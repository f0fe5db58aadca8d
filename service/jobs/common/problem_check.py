"""Does a design problem fit its scene? The design layer answers; here it is asked key by key."""

from __future__ import annotations

import re
from collections.abc import Callable, Mapping
from functools import partial
from typing import Any

from optim.criteria.registry import limit_keys
from optim.errors import DesignError
from service.jobs.strict_json import pointer
from solver.errors import Issue, SceneError, SettingError
from solver.scene.scene import Scene

_REFUSALS = (DesignError, SettingError, SceneError)
_NEED_VARIABLES = ("scaling", "start")


def problem_issues(scene: Scene, given: Mapping[str, Any]) -> list[Issue]:
    """Everything wrong with a description, each thing with the pointer of its field.

    Parameters
    ----------
    scene : what is designed.
    given : the arguments of `optim.problem.problem.pose`, as tables and lists.
    """
    # Loaded here: it brings the compiled loops along, which a service that only lists does not need.
    from optim.problem.problem import pose

    whole = _refused(partial(pose, scene, **given), partial(_issues, given=given))
    return (_variable_issues(scene, given) + _key_issues(scene, given) or whole) if whole else []


def uncertainty_issues(scene: Scene, given: Mapping[str, Any], uncertain: object) -> list[Issue]:
    """What is wrong with the key `uncertain`; nothing if the variables are wrong, which it depends on."""
    from optim.problem.uncertainty_input import read_uncertain
    from optim.problem.variables import check_variables

    if _variable_issues(scene, given):
        return []
    variables = check_variables(scene, given.get("variables"))
    return _refused(
        partial(read_uncertain, scene, variables, uncertain), partial(_in_uncertain, uncertain=uncertain)
    )


def _variable_issues(scene: Scene, given: Mapping[str, Any]) -> list[Issue]:
    """What is wrong with the variables, each looked at alone."""
    from optim.problem.variables import check_variables

    variables: Mapping[str, Any] | None = given.get("variables")
    if variables is None:
        return _refused(partial(check_variables, scene, None), partial(_at, where=pointer("variables")))
    return [
        issue
        for name, bounds in variables.items()
        for issue in _refused(
            partial(check_variables, scene, {name: bounds}), partial(_at, where=pointer("variables", name))
        )
    ]


def _key_issues(scene: Scene, given: Mapping[str, Any]) -> list[Issue]:
    """What is wrong with the other keys, each looked at alone."""
    from optim.problem.cases import read_cases
    from optim.problem.problem import pose

    issues: list[Issue] = []
    sound = not _variable_issues(scene, given)
    variables = {"variables": given["variables"]} if sound and "variables" in given else {}
    for index, case in enumerate(given.get("cases", ())):
        issues += _refused(partial(read_cases, scene, [case]), partial(_in_case, index=index, case=case))
    # Refused without a limit, whatever they are; which limit does not matter to them.
    need_limit = {key.name for key in limit_keys() if key.needs_limit}
    for key, value in given.items():
        if key in ("variables", "cases") or (key in _NEED_VARIABLES and not sound):
            continue
        alone = variables | {key: value} | ({"limit": 1.0} if key in need_limit else {})
        found = _refused(partial(pose, scene, **alone), partial(_issues, given=given))
        issues += [issue for issue in found if issue.pointer.split("/")[1] == key]
    return issues


def _refused(attempt: Callable[[], object], read: Callable[[Exception], list[Issue]]) -> list[Issue]:
    """Nothing if `attempt` goes through; what `read` makes of its refusal otherwise."""
    try:
        attempt()
    except _REFUSALS as error:
        return read(error)
    return []


def _at(error: Exception, where: str) -> list[Issue]:
    return [Issue(pointer=where, message=str(error))]


def _issues(error: Exception, given: Mapping[str, Any]) -> list[Issue]:
    """The refusal of an argument, at the field its name and value speak of."""
    if isinstance(error, SceneError):
        return list(error.issues)
    if not isinstance(error, (DesignError, SettingError)):
        raise error
    key = re.split(r"[.\[ ]", error.name, maxsplit=1)[0]
    parts = _place(given.get(key), error.name[len(key) :])
    if not parts and isinstance(given.get(key), Mapping) and isinstance(error.value, str):
        # The name is that of the table, the value the member that does not fit.
        parts = [error.value] if error.value in given[key] else []
    return _at(error, pointer(key, *parts))


def _place(value: object, rest: str) -> list[object]:
    """The members of nested tables and lists that a name such as ``[0].set.damper.mu`` goes through.

    Keys may have dots in them, so the longest key that fits is taken; what is missing has no place.
    """
    if isinstance(value, list) and (index := re.match(r"\[(\d+)\]", rest)):
        number = int(index[1])
        return [number, *_place(value[number], rest[index.end() :])]
    if isinstance(value, Mapping) and rest.startswith("."):
        fitting = [key for key in value if re.match(re.escape(key) + r"(?=[.\[ ]|$)", rest[1:])]
        key = max(fitting, key=len, default=None)
        return [] if key is None else [key, *_place(value[key], rest[1 + len(key) :])]
    return []


def _in_case(error: Exception, index: int, case: Mapping[str, Any]) -> list[Issue]:
    """The refusal of a case that was looked at alone, at its place in the list."""
    if isinstance(error, SceneError):
        return [_of_scene(issue, index, case) for issue in error.issues]
    if isinstance(error, SettingError):
        path = error.value if error.name == "path" else error.name
        return _at(error, pointer("cases", index, "set", path))
    if not isinstance(error, DesignError):
        raise error
    key = error.name.partition(".")[2]
    message = str(error).replace("`cases[0]", f"`cases[{index}]", 1)
    where = pointer("cases", index, key) if key in case else pointer("cases", index)
    return [Issue(pointer=where, message=message)]


def _in_uncertain(error: Exception, uncertain: object) -> list[Issue]:
    """The refusal of an uncertain parameter or of a mistuned disk."""
    names = list(uncertain) if isinstance(uncertain, Mapping) else []
    disk = pointer("uncertain", *[name for name in names if name == "mistuning"])
    if isinstance(error, SceneError):
        return [Issue(pointer=disk, message=issue.message) for issue in error.issues]
    if isinstance(error, SettingError) and error.name == "scene":
        return _at(error, disk)
    if isinstance(error, SettingError) and not error.name.startswith("uncertain"):
        found = [name for name in names if str(error.value) in [part.strip() for part in name.split(",")]]
        return _at(error, pointer("uncertain", *found[:1]))
    return _issues(error, {"uncertain": uncertain})


def _of_scene(issue: Issue, index: int, case: Mapping[str, Any]) -> Issue:
    """A refusal of the scene of a case, at the key of the case that made it so."""
    key = "observe" if issue.pointer.startswith("/observe") else "engine_order"
    return Issue(pointer=pointer("cases", index, *([key] if key in case else [])), message=issue.message)
