"""The study `design`: the best damper of a scene, of what is known or in spite of what is not."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace
from functools import cache
from typing import TYPE_CHECKING, Annotated, Any

from pydantic import BaseModel, ConfigDict, Field, RootModel

import optim
from optim.criteria.key import Form, Option
from optim.problem.problem_keys import OPTIONS, ROBUST, NominalAndRobustKeys, of_design
from service.jobs.common.problem_requests import CERTIFY, ProblemRequest, arguments
from service.jobs.common.result_models import PeakAt, Table, answered
from service.jobs.common.sizes import POINTS_OF_A_SWEEP, balance_issues
from service.jobs.common.study_keys import CERTIFICATES, prepare, with_proofs
from service.jobs.kind_registry import Json, ReadSweep, StoredSweep
from service.jobs.outputs import JobOutput
from service.jobs.stored_figures import SweepRecord
from service.jobs.study import Answer, Question, Watch
from solver.errors import Issue
from solver.scene.descriptions import DISK_LOAD

if TYPE_CHECKING:
    from matplotlib.figure import Figure

    from optim import DesignResult as Optimum
    from optim import RobustResult as Robust
    from solver.results.told import Told
    from solver.scene.scene import Scene

UNCERTAIN = "uncertain"
_NOT_ROBUST = ("basins", CERTIFY, OPTIONS)


_Rows = list[Table]
_HARMONICS = "Highest harmonic kept; more than asked for where the peak needs them."


@cache
def design_result() -> type[BaseModel]:
    """Return the schema of a design, or of a robust one."""
    optimum: Any = answered(
        "optim:DesignResult", "OptimumResult", peak=PeakAt | None, peaks=_Rows, bands=_Rows, rows=_Rows,
        errors=_Rows, looked_at=_Rows, tried=_Rows, broken=_Rows, plateau=Table, conditions=Table | None,
        objective=float | None, limit=float | None, stable=str, stable_ground=str, newton_iterations=int,
        multipliers=list[float | None], certificates=CERTIFICATES,
        options=_Rows,
        n_harmonics=(int, Field(description=_HARMONICS)),
    )()  # fmt: skip
    robust: Any = answered(
        "optim:RobustResult", "RobustResult", scene=str, quantile=float | None, nominal=Table | None,
        robust=Table | None, optimality=float | None, violation=float | None, inner_look=bool | None,
        nominal_status=str, warnings=list[str],
    )()  # fmt: skip

    class DesignResult(RootModel[optimum | robust]):
        """A design; with `uncertain` a robust one."""

        model_config = ConfigDict(defer_build=True)

    return DesignResult


def _peaks_of(found: Optimum) -> tuple[list[tuple[Scene, float]], str]:
    """Return the peaks that hold a design, each with the scene it is of, and the load they are least over."""
    from optim.criteria.peak_criterion import PEAK
    from optim.results.design_result import SAME_HEIGHT, DesignStatus

    responses = () if found.evaluation is None else found.evaluation.responses
    scenes = {each.case: each.branch.posed.scene for each in responses}
    rows = [] if found.evaluation is None else found.evaluation.highest(SAME_HEIGHT)
    peaks = [(scenes[row.case], row.at_hz) for row in rows if row.quantity is PEAK]
    alone = found.problem.plain and found.status is DesignStatus.OPTIMAL and not found.plateau
    variables = found.problem.variables
    return peaks, variables[0].name if alone and len(variables) == 1 else ""


class _Design(NominalAndRobustKeys, ProblemRequest):
    """Find the best damper.

    Parameters are chosen within bounds so that the highest peak over the scene's band is least, or what a
    problem file describes. An option given beside the file replaces the key it stands for.
    """

    EXAMPLES = (
        {
            "scene": "bladed-disk",
            "variables": {DISK_LOAD: [20, 3000], "root.kt": [1e6, 1e8]},
            "cases": [
                {"name": "first bending"},
                {"name": "twice the force", "set": {"excitation.amplitude": 100}},
            ],
            "limit": 8e-5,
            "max_band_hz": 60,
            "forbidden_hz": [[520, 560]],
            "contact_states": {"shroud": "never-separates"},
            "method": "auto",
        },
    )
    NAME, FUNCTION, RESULT = "design", "optim:design", design_result
    ASKS = Question("Which damper is best?", "damper", 2_500)
    KEYS = "those of [a design problem](design.md)"
    TOLD = "optim.views.tables.design:design"
    SHOWS, SWEEPS = "the optimum and what holds it", "every response computed"

    certify: Annotated[
        Annotated[bool, Field(strict=True)] | None,
        Option(Form.FLAG, "--certify", "", help="Prove the peaks that hold the design, see `peaks`."),
    ] = Field(
        default=None,
        description="Prove the peaks that hold the design, where contacts are piecewise linear; over one "
        "load the least peak.",
    )

    def issues(self, scene: Scene) -> list[Issue]:
        """Return everything wrong with a design, robust or not."""
        from optim.problem.issues import uncertainty_issues

        given, robust = arguments(self), self.uncertain is not None
        apart, which = (_NOT_ROBUST, "without") if robust else (ROBUST, "with")
        words = f"is for a design {which} `uncertain` parameters"
        found = super().issues(scene) + [Issue((key,), words, given[key]) for key in apart if key in given]
        known = {key: value for key, value in given.items() if key not in (CERTIFY, OPTIONS, *ROBUST)}
        return found + (uncertainty_issues(scene, known, given[UNCERTAIN]) if robust else [])

    def sizes(self, scene: Scene) -> list[Issue]:
        """Return what is too large."""
        if self.samples is None or self.uncertain is None:
            return super().sizes(scene)
        points = POINTS_OF_A_SWEEP * len(self.cases or [1]) * self.samples
        words = "points of one design's responses"
        return balance_issues("samples", scene, self.harmonics, points, words)

    @classmethod
    def compute(cls, scene: Scene, asked: Mapping[str, Any], watch: Watch) -> Answer:
        """Search, over the uncertainty if there is one."""

        best = getattr(watch.on_progress, "best", None)
        on_best = None if best is None else lambda found: best(found.to_json())
        given = dict(asked)
        if proof := given.pop(CERTIFY, False):
            prepare(scene)
        if OPTIONS in given:
            found: Any = optim.catalogue(scene, **given, **watch._asdict()).design
        else:
            search = optim.robust_design if UNCERTAIN in given else optim.design
            found = search(scene, **given, **watch._asdict(), on_best=on_best)
        answer = Answer.of(found)
        return with_proofs(answer, *_peaks_of(found), watch) if proof and found.peak is not None else answer

    @classmethod
    def sweeps(cls, found: Optimum | Robust) -> tuple[SweepRecord, ...]:
        """Return the responses computed; of a robust design those of the search without uncertainty."""
        from service.jobs.common.sweep_records import sweep_records

        nominal: Any = getattr(found, "design", found)
        return sweep_records(nominal.sweeps, intermediate=True)

    @classmethod
    def output(cls, answer: Answer, sweeps: Sequence[SweepRecord]) -> JobOutput:
        """Return what a worker gives back, with the design to be stored."""
        from service.jobs.common.sweep_records import design_record, robust_record

        record: Any = robust_record if "nominal" in answer.json else design_record
        return replace(super().output(answer, sweeps), design=record(answer.result))

    @classmethod
    def result_class(cls, result: Json) -> type[Told]:
        """Return the class of a design, robust or not."""
        return optim.RobustResult if "nominal" in result else super().result_class(result)

    @classmethod
    def empty(cls, result: Json) -> str:
        """Return why there is nothing to draw."""
        if "nominal" in result:
            return "" if result["nominal"] is not None else "no design was found"
        return "" if result.get("peak") is not None else "it stored no sweep to draw"

    @classmethod
    def figure(cls, result: Json, sweeps: Sequence[StoredSweep], read: ReadSweep) -> Figure:
        """Return the response of the optimum; of a robust design both optima over the uncertainty."""
        if "nominal" in result:
            from optim.views.plots.figures import robust_figure

            return robust_figure(result)
        from service.jobs.drawing import best_sweep_figure

        return best_sweep_figure(result, sweeps, read)


Design = of_design(_Design)
