"""The study `accuracy`: what accuracy costs, error against time of one point."""

from __future__ import annotations

from functools import partial
from typing import TYPE_CHECKING, Annotated

from pydantic import Field

from service.jobs.common.result_models import answered
from service.jobs.common.scene_requests import FrequencyHz, Harmonics, check
from service.jobs.stored_figures import SweepRecord
from service.jobs.kind_registry import Flag
from service.jobs.study import Question, Study
from solver.errors import Issue

if TYPE_CHECKING:
    from solver.scene.scene import Scene
    from stickslip.lab.accuracy.accuracy_result import AccuracyStudy

_MOST_WAYS = 30
_MOST_SAMPLED = 50_000_000
_Harmonics = Annotated[list[Harmonics], Field(min_length=1, max_length=_MOST_WAYS)]
_Samples = Annotated[list[Annotated[int, Field(strict=True, ge=4, le=65536)]], Field(max_length=_MOST_WAYS)]
_Repeats = Annotated[int, Field(strict=True, ge=1, le=1000)]


class Accuracy(Study):
    """Measure what accuracy costs.

    Error against time of one point, for numbers of harmonics, contact forces in closed form and by samples.
    """

    EXAMPLES = ({"scene": "two-dof", "frequency_hz": 1.2, "harmonics": [1, 3, 7], "samples": [64]},)
    NAME, FUNCTION = "accuracy", "solver:accuracy_study"
    RESULT = answered("stickslip.lab.accuracy.accuracy_result:AccuracyStudy", "AccuracyResult")
    ASKS = Question("How many harmonics are enough?", "checks", 40_000)
    TOLD = "stickslip.lab.accuracy.tables:accuracy"
    SHOWS, SWEEPS, COUNTED = (
        "error against time ([accuracy](accuracy.md))",
        "the one that found the peak",
        "rows",
    )
    EMPTY = ("rows", "it has no rows")
    FIGURE = "stickslip.lab.accuracy.pictures:accuracy_figure"

    frequency_hz: Annotated[FrequencyHz | None, Flag("--frequency", "HZ")] = Field(
        default=None, description="Excitation frequency [Hz]; the highest peak of the scene's band."
    )
    harmonics: Annotated[_Harmonics | None, Flag(metavar="H")] = Field(
        default=None, description="Highest harmonics to try; nine numbers from 1 to 41."
    )
    samples: Annotated[_Samples | None, Flag(metavar="N")] = Field(
        default=None, description="Samples of a period to try with each, multiples of 4; 64 to 8192."
    )
    repeats: Annotated[_Repeats | None, Flag(metavar="N")] = Field(
        default=None, description="Of each timing; 15."
    )

    def issues(self, _scene: Scene) -> list[Issue]:
        """Return what is wrong with the samples."""
        from stickslip.lab.accuracy.accuracy_study import check_samples

        counts = enumerate(self.samples or ())
        return [issue for i, count in counts for issue in check(partial(check_samples, count), "samples", i)]

    def sizes(self, _scene: Scene) -> list[Issue]:
        """Return what is too large."""
        from stickslip.lab.accuracy.accuracy_study import HARMONICS, REPEATS, SAMPLES

        harmonics = list(HARMONICS) if self.harmonics is None else self.harmonics
        samples = list(SAMPLES) if self.samples is None else self.samples
        repeats = REPEATS if self.repeats is None else self.repeats
        sampled = repeats * len(harmonics) * sum([max(harmonics), *samples])
        if sampled <= _MOST_SAMPLED:
            return []
        words = "repetitions × numbers of harmonics × samples"
        return [Issue(("repeats",), f"{words} must be at most {_MOST_SAMPLED}", sampled, named=False)]

    @classmethod
    def sweeps(cls, found: AccuracyStudy) -> tuple[SweepRecord, ...]:
        """Return the response that found the peak, if one did."""
        from service.jobs.common.sweep_records import sweep_records

        return () if found.branch is None else sweep_records([found.branch], intermediate=True)
