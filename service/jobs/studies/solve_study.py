"""The study `solve`: the periodic response at one frequency, or all that are found."""

from __future__ import annotations

from collections.abc import Mapping
from functools import cache
from typing import TYPE_CHECKING, Annotated, Any

from pydantic import Field

from service.jobs.common.result_models import Curve, KindResult, Table, result_model
from service.jobs.common.scene_requests import FrequencyHz, HarmonicRequest
from service.jobs.common.study_keys import (
    AUTO,
    Accuracy,
    EffectsWord,
    effects_issues,
    solved_issues,
    with_effects,
)
from service.jobs.kind_registry import Flag
from service.jobs.study import Answer, Proposed, Question, Study, Watch, middle_hz
from solver.errors import Issue, Naming, Shown
from solver.first_use import on_demand
from solver.response.stability import MOST_STARTS
from solver.scene.descriptions import DAMPER_LOAD

if TYPE_CHECKING:
    from solver.scene.scene import Scene

_STOPPED = "The search was stopped: these are the solutions found until then."
_NONE = "No solution was found: try more starts or more harmonics."


@cache
def solve_result() -> type[KindResult]:
    """Return the schema of one periodic response: of a search for all, the largest, with what was found."""
    from solver.response.solution import Solution

    further: dict[str, Any] = {
        "solutions": (list[Table], "Of a search for all: each solution with its stability, largest first."),
        "complete": (bool, "Whether these are proven to be all."),
        "missing_by_signs": (int, "How many are missing at least, by the signs of the determinants."),
        "starts": (int, "Random starts that were made."),
        "stopped": (bool, "Whether the search was ended before its end."),
        "note": (str, "What is known of the list."),
        "certificate": (Table, "Of `certify`: whether it is proved, in which bounds, and the proof."),
    }
    beside: dict[str, Any] = {
        key: (kind | None, Field(None, description=words)) for key, (kind, words) in further.items()
    }
    return result_model(
        Solution, "SolveResult", harmonics=list[float] | None, contacts=dict[str, str],
        unique=(str, Field(description="Whether it is the only response: proven or not known.")),
        unique_ground=(str, Field(description="Why.")), mean_range=(Curve | None, None),
        drift_per_period=(float | None, None), **beside,
    )  # fmt: skip


class Solve(Study, HarmonicRequest):
    """Compute one periodic response, or look for all of them."""

    EXAMPLES = (
        {"scene": "two-dof", "frequency_hz": 1.2, "set": {DAMPER_LOAD: 80}},
        {"scene": "two-dof", "frequency_hz": 1.05, "all": True, "starts": 8},
    )
    NAME, FUNCTION, RESULT = "solve", "solver:solve", solve_result
    ASKS = Question("What happens at one frequency?", "checks", 20)
    TOLD = "solver.views.tables.responses:solution"
    SHOWS, COUNTED = "the response at one frequency", "solutions"
    EMPTY = ("harmonics", "no response was found")
    FIGURE = "service.jobs.drawing:harmonics_of"

    frequency_hz: Annotated[FrequencyHz, Flag("--frequency", "HZ")] = Field(
        description="Excitation frequency [Hz]."
    )
    accuracy: Accuracy = None
    effects: EffectsWord = AUTO
    exact: Annotated[bool, Field(strict=True)] = Field(
        default=False, description="Follow the events of the contacts in place of harmonics, to rounding."
    )
    certify: Annotated[bool, Field(strict=True)] = Field(
        default=False,
        description="Prove the response and enclose its amplitude, where contacts are piecewise linear.",
    )
    multipliers: Annotated[bool, Field(strict=True)] = Field(
        default=False, alias="stability", description="Floquet multipliers, however long they take."
    )
    every: Annotated[bool, Field(strict=True)] = Field(
        default=False,
        alias="all",
        description="Look for all solutions, with their stability, by random starts, deflation and branches.",
    )
    starts: Annotated[int, Field(strict=True, ge=0, le=MOST_STARTS), Flag(metavar="N")] = Field(
        default=40, description="Random starts of `all`."
    )
    seed: Annotated[int, Field(strict=True, ge=0, lt=2**63), Flag(metavar="N")] = Field(
        default=0, description="Of the random starts of `all`."
    )

    @classmethod
    def propose(cls, scene: Scene) -> Proposed | str:
        """The middle of the band."""
        return Proposed({"frequency_hz": middle_hz(scene)})

    def issues(self, _scene: Scene) -> list[Issue]:
        """Return what does not go together, and words of effects that are none."""
        alone: dict[str, Any] = {}
        if self.every:
            alone = {"accuracy": self.accuracy, "exact": self.exact or None, "certify": self.certify or None}
        return effects_issues(self.effects) + [
            Issue((key,), Naming("does not go with {all}"), Shown(f"{given!r}: leave one of them out"))
            for key, given in alone.items()
            if given is not None
        ]

    def sizes(self, scene: Scene) -> list[Issue]:
        """Return what is too large."""
        return solved_issues("harmonics", scene, self.harmonics, self.effects, accuracy=self.accuracy)

    @classmethod
    def compute(cls, scene: Scene, asked: Mapping[str, Any], watch: Watch) -> Answer:
        """Solve the balance, once or from many starts: the answer is then the largest solution, with all."""
        import solver

        given = with_effects(asked)
        search = {key: given.pop(key) for key in ("starts", "seed") if key in given}
        proof, judged = given.pop("certify", False), given.pop("multipliers", False)
        if not given.pop("every", False):
            one = solver.solve(scene, **given)
            plain = one if one.converged else None
            judge = "solver.response.stability.multipliers:verdict_of" if judged and one.converged else ""
            stable = on_demand(judge)(solver.stability(one)).to_json() if judge else {}
            answer = Answer(plain, one.to_json() | stable, one.reached, one.status.value, one.plot)
            if not proof or not one.converged:
                return answer
            proved = solver.certify(one, should_stop=watch.should_stop)
            return answer._replace(
                json=answer.json | {"certificate": proved.to_json()}, reached=one.reached and proved.reached,
                status=answer.status if proved.reached else proved.status.value,
            )  # fmt: skip
        given = {key: value for key, value in given.items() if key != "exact"}
        found = solver.solve_all(scene, **given, **search, **watch._asdict())
        largest = found.solutions[0].solution if found.solutions else solver.solve(scene, **given)
        reached, status = bool(found.solutions) and not found.stopped, _STOPPED if found.stopped else _NONE
        shown = largest if found.solutions else None
        return Answer(shown, largest.to_json() | found.to_json(), reached, status, largest.plot)
