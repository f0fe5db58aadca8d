"""What jobs that are design problems have in common: the keys of the design layer, with those of a job."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from pydantic import ConfigDict

from optim.criteria.json_types import Name as Name
from optim.criteria.json_types import Pair as Pair
from optim.criteria.json_types import Ranges as Ranges
from optim.problem.keys import ProblemKeys
from service.jobs.common.scenes import HarmonicRequest
from service.jobs.registry import ABOUT_THE_RUN
from solver.scene.scene import Scene


class ProblemRequest(ProblemKeys, HarmonicRequest):
    """A design problem as a job, in the words of `optim.design`; kinds add the keys of the criteria."""

    model_config = ConfigDict(defer_build=True)


ABOUT_THE_SCENE = ("scene", "set")
ABOUT_THE_JOB = ("fresh", "priority", "max_seconds", *ABOUT_THE_RUN)


def arguments(request: ProblemRequest) -> dict[str, Any]:
    """The keys of a description that were given, as arguments of the design layer; JSON too."""
    given: dict[str, Any] = request.model_dump(
        mode="json", exclude_none=True, exclude={*ABOUT_THE_SCENE, *ABOUT_THE_JOB}
    )
    if request.cases is not None:
        given["cases"] = [case.model_dump(mode="json", exclude_unset=True) for case in request.cases]
        given["cases"] = [{k: v for k, v in case.items() if v is not None} for case in given["cases"]]
    return given


def default_variables(scene: Scene, given: Mapping[str, Any]) -> dict[str, Any]:
    """The variables that stand for none, so that a spec says what is chosen."""
    # Loaded here: it brings the compiled loops along, which a service that only lists does not need.
    from optim.problem.variables import check_variables

    if "variables" in given:
        return {}
    return {"variables": {v.name: [v.low, v.high] for v in check_variables(scene, None)}}


def problem_of(spec: Mapping[str, Any]) -> dict[str, Any]:
    """The arguments of the design layer in a spec; those of an older version name what was not given too."""
    return {key: value for key, value in spec.items() if key != "scene" and value is not None}
