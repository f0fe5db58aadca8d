"""The study `transient`: a run through a range of frequencies in time."""

from __future__ import annotations

import math
from collections.abc import Collection
from functools import partial
from typing import TYPE_CHECKING, Annotated

from pydantic import Field

from service.jobs.common.result_models import answered
from service.jobs.common.scene_requests import NotNegative, PositiveNumber, check
from service.jobs.common.sizes import is_quick, march_issues, marched_for_hours
from service.jobs.common.study_keys import of_keys
from service.jobs.kind_registry import Flag
from service.jobs.study import Proposed, Question, Study, middle_hz, rounded
from solver.errors import Issue, SettingError

if TYPE_CHECKING:
    from solver.marching.transient import Ramp
    from solver.scene.scene import Scene

_PERIODS = 400  # of the middle of the band, in which a run is proposed
_Rates = Annotated[list[PositiveNumber], Field(min_length=1, max_length=50)]


class Transient(Study):
    """Run through a range of frequencies in time.

    A run-up, run-down or sine sweep at a constant rate, with a ring-down behind it if wanted.
    """

    EXAMPLES = ({"scene": "two-dof", "begin_hz": 0.5, "end_hz": 1.6, "rate_hz_per_s": 0.01},)
    NAME, FUNCTION = "transient", "solver:transient"
    RESULT = answered("solver.marching.march_result:TransientResult", "TransientResult")
    ASKS = Question("What does a run-up do?", "engine", 25_000)
    TOLD = "solver.views.tables.responses:transient"
    SHOWS, COUNTED = "the largest amplitude of a run ([transients](transients.md))", "turns"
    FIGURE, EMPTY = "solver.views.plots.motion:transient_figure", ("time", "nothing was run through")

    begin_hz: Annotated[NotNegative | None, Flag("--from", "F")] = Field(
        default=None, description="Frequency at the beginning [Hz]; that of the scene's band."
    )
    end_hz: Annotated[NotNegative | None, Flag("--to", "F")] = Field(
        default=None, description="Frequency at the end [Hz]; below the first one in a run-down."
    )
    rate_hz_per_s: Annotated[PositiveNumber | None, Flag("--rate", "R")] = Field(
        default=None, description="How fast the frequency changes [Hz/s]; or give `ramp_seconds`."
    )
    ramp_seconds: Annotated[PositiveNumber | None, Flag(metavar="T")] = Field(
        default=None, description="How long it takes from the one to the other [s]."
    )
    rates: Annotated[_Rates | None, Flag("--rates", "R")] = Field(
        default=None,
        description="Several rates [Hz/s] in place of these: the largest amplitude over the rate.",
    )
    ring_down_seconds: Annotated[NotNegative, Flag(metavar="T")] = Field(
        default=0.0, description="How long the motion is followed after that without excitation [s]."
    )
    from_rest: Annotated[bool, Field(strict=True)] = Field(
        default=False, description="Begin at rest instead of in the motion that repeats at the beginning."
    )
    tolerance: Annotated[float, Field(strict=True, ge=1e-12, le=0.1), Flag(metavar="E")] = Field(
        default=1e-6, description="Of the largest amplitude, relative."
    )
    steps_per_period: Annotated[int | None, Field(strict=True, ge=16, le=1_000_000), Flag("--steps", "N")] = (
        Field(default=None, description="Steps in a period of the highest frequency; chosen if left out.")
    )

    @classmethod
    def propose(cls, scene: Scene) -> Proposed | str:
        """Through the band in some hundred periods: how fast, the scene does not say."""
        (low, high), middle = scene.observe.band, middle_hz(scene)
        rate = rounded((high - low) * middle / _PERIODS, 2)
        body = {"begin_hz": float(low), "end_hz": float(high), "rate_hz_per_s": rate}
        return marched_for_hours(scene) or Proposed(body, ("rate_hz_per_s",))

    @classmethod
    def lacks(cls, given: Collection[str]) -> bool:
        """Return whether nothing says how fast."""
        return not {"rate_hz_per_s", "ramp_seconds", "rates"} & set(given)

    def runs(self, scene: Scene) -> list[tuple[Ramp, ...]]:
        """Return what is to be run through at each rate; SettingError names what is wrong."""
        from solver.marching.transient import ramps_of

        keys = ("begin_hz", "end_hz", "rate_hz_per_s", "ramp_seconds", "ring_down_seconds")
        given = {key: getattr(self, key) for key in keys}
        if self.rates is None:
            return [ramps_of(scene, **given)]
        if self.rate_hz_per_s is not None:
            raise SettingError("rate_hz_per_s", self.rate_hz_per_s, "must not be given beside `rates`")
        return [ramps_of(scene, **{**given, "rate_hz_per_s": rate}) for rate in self.rates]

    def issues(self, scene: Scene) -> list[Issue]:
        """Return what is wrong with the range and the rate."""
        return check(partial(self.runs, scene))

    def sizes(self, scene: Scene) -> list[Issue]:
        """Return what is too large."""
        from solver.marching.transient import check_passage

        runs = self.runs(scene)
        first, slowest = runs[0][0], max(runs, key=lambda run: run[0].seconds)
        periods = sum(ramp.seconds for run in runs for ramp in run) * max(first.begin_hz, first.end_hz)
        key = "rate_hz_per_s" if self.ramp_seconds is None else "ramp_seconds"
        large = march_issues(scene, self.steps_per_period, math.ceil(periods), key)
        passable = partial(check_passage, scene, slowest, self.steps_per_period, from_rest=self.from_rest)
        return large or (of_keys(check(passable), self.own_keys()) if is_quick(scene) else [])
