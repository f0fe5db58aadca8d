"""What studies of a design problem have in common: the keys of the design layer, with those of a job."""

from __future__ import annotations

from dataclasses import replace
from functools import partial
from typing import TYPE_CHECKING, Any, ClassVar

from optim.criteria.key import Name as Name
from optim.criteria.key import Pair as Pair
from optim.criteria.key import Ranges as Ranges
from optim.problem.problem_keys import OPTIONS, ROBUST, ProblemKeys
from service.jobs.common.scene_parameters import designed
from service.jobs.common.scene_requests import HarmonicRequest
from service.jobs.common.sizes import POINTS_OF_A_SWEEP, balance_issues
from service.jobs.common.study_keys import NOTHING_DESIGNED
from service.jobs.kind_registry import ABOUT_THE_JOB, JobKind
from service.jobs.study import Proposed, Study
from solver.errors import Issue
from solver.lab import from_lab

if TYPE_CHECKING:
    from solver.scene.scene import Scene

CERTIFY = "certify"
_OF_OTHERS = ("points", CERTIFY, OPTIONS, *ROBUST)


class ProblemRequest(ProblemKeys, Study, HarmonicRequest):
    """A design problem as a study, in the words of `optim.design`; kinds add the keys of the criteria."""

    COUNTED = "computed"
    KEYS: ClassVar[str] = ""

    @classmethod
    def propose(cls, scene: Scene) -> Proposed | str:
        """Return what is designed by itself, with its range."""
        found = designed(scene)
        return Proposed({"variables": dict(found)}) if found else NOTHING_DESIGNED

    def issues(self, scene: Scene) -> list[Issue]:
        """Return everything wrong with the problem."""
        from optim.problem.issues import problem_issues, reading_issues

        given = arguments(self)
        known = {key: value for key, value in given.items() if key not in _OF_OTHERS}
        if OPTIONS not in given:
            return problem_issues(scene, known)
        catalogue = from_lab("catalogue.catalogue")
        found = problem_issues(scene, catalogue.with_variables(known))
        return found or reading_issues(partial(catalogue.check_options, scene, given[OPTIONS], known), given)

    def sizes(self, scene: Scene) -> list[Issue]:
        """Return what is too large."""
        points, words = POINTS_OF_A_SWEEP * len(self.cases or [1]), "points of one design's responses"
        return balance_issues("cases", scene, self.harmonics, points, words)

    def spec(self, scene: Scene) -> dict[str, Any]:
        """Return what was given, with the variables that stand for none: a spec says what is chosen."""
        from optim.problem.variables import check_variables

        given = arguments(self)
        if "variables" not in given:
            given["variables"] = {v.name: [v.low, v.high] for v in check_variables(scene, None)}
        return given

    @classmethod
    def as_kind(cls) -> JobKind:
        """Return the kind of job, whose keys are described elsewhere."""
        kind = super().as_kind()
        return replace(kind, view=replace(kind.view, keys=cls.KEYS))


ABOUT_THE_SCENE = ("scene", "set")


def arguments(request: ProblemRequest) -> dict[str, Any]:
    """The keys of a description that were given, as arguments of the design layer; JSON too."""
    given: dict[str, Any] = request.model_dump(
        mode="json", exclude_none=True, exclude={*ABOUT_THE_SCENE, *ABOUT_THE_JOB}
    )
    if request.cases is not None:
        given["cases"] = [case.model_dump(mode="json", exclude_unset=True) for case in request.cases]
        given["cases"] = [{k: v for k, v in case.items() if v is not None} for case in given["cases"]]
    return given
