"""The study `march`: time marching, the independent referee."""

from __future__ import annotations

from collections.abc import Mapping
from functools import partial
from typing import TYPE_CHECKING, Annotated, Any

from pydantic import Field

from service.jobs.common.result_models import Table, answered
from service.jobs.common.scene_requests import FrequencyHz, check
from service.jobs.common.sizes import is_quick, march_issues, marched_for_hours
from service.jobs.common.study_keys import of_keys
from service.jobs.kind_registry import Flag
from service.jobs.study import Answer, Proposed, Question, Study, Watch, middle_hz
from solver.errors import Issue

if TYPE_CHECKING:
    from solver.scene.scene import Scene


SAMPLES = 512
_Steps = Annotated[int, Field(strict=True, ge=16, le=1_000_000)]


class March(Study):
    """March in time until the motion repeats.

    The independent referee of solve; of a cyclic scene the whole annulus is marched.
    """

    EXAMPLES = ({"scene": "two-dof", "frequency_hz": 1.2},)
    NAME, FUNCTION = "march", "solver:march"
    RESULT = answered(
        "solver.marching.march_result:MarchResult", "MarchResult", harmonics=list[float | None] | None,
        history=(Table | None, None),
    )  # fmt: skip
    ASKS = Question("Does time marching agree?", "checks", 3_000)
    TOLD = "solver.views.tables.responses:march"
    SHOWS, COUNTED = "amplitude and periods marched", "periods"
    EMPTY = ("harmonics", "no response was found")
    FIGURE = "service.jobs.drawing:harmonics_of"

    frequency_hz: Annotated[FrequencyHz, Flag("--frequency", "HZ")] = Field(
        description="Excitation frequency [Hz]."
    )
    steps_per_period: Annotated[_Steps | None, Flag("--steps", "N")] = Field(
        default=None, description="Steps of the finer run; chosen by the solver if left out."
    )
    tolerance: Annotated[float, Field(strict=True, ge=1e-13, le=1e-2), Flag(metavar="E")] = Field(
        default=1e-10, description="Largest change over a period, relative."
    )
    max_periods: Annotated[int, Field(strict=True, ge=1, le=1_000_000), Flag(metavar="N")] = Field(
        default=20_000, description="Periods marched at most."
    )
    history: Annotated[bool, Field(strict=True)] = Field(
        default=False, description="Give the last period too: motion and loops of the contacts."
    )

    @classmethod
    def propose(cls, scene: Scene) -> Proposed | str:
        """The middle of the band."""
        return marched_for_hours(scene) or Proposed({"frequency_hz": middle_hz(scene)})

    def sizes(self, scene: Scene) -> list[Issue]:
        """Return what is too large."""
        from solver.marching.march import marched

        steps = partial(marched, scene, self.frequency_hz, self.steps_per_period)
        large = march_issues(scene, self.steps_per_period, self.max_periods)
        return large or (of_keys(check(steps), self.own_keys()) if is_quick(scene) else [])

    @classmethod
    def compute(cls, scene: Scene, asked: Mapping[str, Any], watch: Watch) -> Answer:
        """March; what has not settled is not drawn."""
        import solver

        given = {name: value for name, value in asked.items() if name != "history"}
        found = solver.march(scene, **given, **watch._asdict())
        result = found.to_json()
        if asked.get("history"):
            from service.jobs.common.periods import history_of

            result["history"] = history_of(found, SAMPLES)
        shown = found if found.converged else None
        return Answer(shown, result, found.converged, found.status.value, partial(found.plot, scene=scene))
