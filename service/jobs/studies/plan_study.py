"""The study `plan`: which effects a scene calls for, before anything is computed."""

from __future__ import annotations

from collections.abc import Mapping
from functools import cache
from typing import TYPE_CHECKING, Any

from pydantic import ConfigDict

from service.jobs.common.result_models import KindResult, answered
from service.jobs.common.scene_requests import HarmonicRequest
from service.jobs.common.study_keys import AUTO, EffectsWord, effects_issues, solved_issues, with_effects
from service.jobs.study import Answer, Question, Study, Watch
from solver.errors import Issue
from solver.scene.descriptions import DISK_LOAD

if TYPE_CHECKING:
    from solver.scene.scene import Scene

EXAMPLE: dict[str, Any] = {"scene": "bladed-disk", "set": {DISK_LOAD: 150}}


@cache
def plan_result() -> type[KindResult]:
    """Return the schema of a plan."""
    effect: Any = answered("solver.studies.study_results:Effect", "EffectResult")()
    return answered("solver.studies.study_results:Plan", "PlanResult", effects=list[effect])()


class Plan(Study, HarmonicRequest):
    """Say which effects a scene calls for, and why."""

    model_config = ConfigDict(defer_build=False)
    EXAMPLES = (EXAMPLE,)
    NAME, FUNCTION, RESULT = "plan", "solver:plan", plan_result
    ASKS = Question("What does this scene call for?", "checks", 1)
    TOLD = "solver.views.tables.responses:plan"
    SHOWS = "the effects in use and left out, sizes and estimated cost"

    effects: EffectsWord = AUTO

    def issues(self, _scene: Scene) -> list[Issue]:
        """Return what is wrong with the word of effects."""
        return effects_issues(self.effects)

    def sizes(self, scene: Scene) -> list[Issue]:
        """Return what is too large."""
        return solved_issues("harmonics", scene, self.harmonics, self.effects)

    @classmethod
    def compute(cls, scene: Scene, asked: Mapping[str, Any], _watch: Watch) -> Answer:
        """Plan."""
        import solver

        found = solver.plan(scene, **with_effects(asked))
        return Answer(found, found.to_json(), True, "")
