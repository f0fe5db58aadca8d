"""The commands that choose parameters: design and pareto."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, Self

import typer

from optim.problem.keys import DesignKeys, FrontKeys
from optim.problem.keys import options as key_options
from service.cli.commands.report import SUFFIXES, write
from service.cli.failures import end
from service.cli.options import inputs, problem_inputs
from service.cli.options import shared as options
from service.cli.options.problem import ProblemFlags, takes_problem
from service.cli.options.problem_inputs import Description, IssuesOf
from service.cli.output_files import Outputs
from service.cli.progress import Reporter, bar
from service.rendering.tables import design as design_reports
from service.rendering.tables import robust as robust_reports
from service.rendering.tables.text import show

if TYPE_CHECKING:
    from optim.results.best_so_far import OnBest
    from optim.results.design import DesignResult
    from optim.robust.result import RobustResult
    from optim.studies.pareto_result import ParetoResult
    from service.jobs.common.problem import ProblemRequest
    from solver.scene.scene import Scene

    Result = DesignResult | RobustResult | ParetoResult


Report = Annotated[
    str | None, typer.Option("--report", metavar="F", help="Write a design report: .html or .pdf.")
]


@dataclass(frozen=True, slots=True, kw_only=True)
class _Asked:
    """What was asked on the command line, checked, and where its result goes."""

    scene: Scene
    given: Mapping[str, Any]
    outputs: Outputs
    page: Path | None
    as_json: bool

    @classmethod
    def of(
        cls, told: Description, model: type[ProblemRequest], issues_of: IssuesOf, *, plot: str | None,
        out: str | None, report: str | None, as_json: bool,
    ) -> Self:  # fmt: skip
        """Check it, the files that are to be written first."""
        outputs = Outputs.asked(plot, out)
        page = inputs.output_path("--report", report, SUFFIXES)
        scene, given = problem_inputs.posed(told, model, issues_of)
        return cls(scene=scene, given=given, outputs=outputs, page=page, as_json=as_json)

    def end(self, found: Result, told: Callable[[Mapping[str, Any]], None], *, drawn: bool) -> None:
        """Write and print what was found; status 1 if the goal was not reached."""
        answer = found.to_json()
        self.outputs.write(found, found.plot if drawn else None)
        if self.page is not None:
            from service.rendering.report.sections import Designed

            write(Designed(scene=self.scene, problem=self.given, result=answer), self.page)
        show(answer, told, as_json=self.as_json)
        end(found.reached, found.status.value)


@takes_problem(key_options(DesignKeys))
def design(
    flags: ProblemFlags,
    name: options.AnyScene = None,
    plot: options.Plot = None,
    out: options.Out = None,
    report: Report = None,
    as_json: options.Json = False,
) -> None:
    """Find the best damper.

    Parameters are chosen within bounds so that the highest peak over the scene's band is least, or what a
    problem file describes. An option given beside the file replaces the key it stands for.
    """
    from service.jobs.kinds.design import UNCERTAIN, DesignRequest, design_issues

    told = problem_inputs.description(name, flags, "design")
    asked = _Asked.of(told, DesignRequest, design_issues, plot=plot, out=out, report=report, as_json=as_json)
    if UNCERTAIN in asked.given:
        with bar("robust design", "responses") as on_progress:
            import optim

            robust = optim.robust_design(
                asked.scene, **asked.given, on_progress=on_progress, on_best=_telling(on_progress)
            )
        asked.end(robust, robust_reports.robust, drawn=robust.nominal is not None)
        return
    with bar("design", "designs") as on_progress:
        import optim

        found = optim.design(
            asked.scene, **asked.given, on_progress=on_progress, on_best=_telling(on_progress)
        )
    asked.end(found, design_reports.design, drawn=bool(found.sweeps))


def _telling(reporter: Reporter | None) -> OnBest:
    """What says the best design so far beside a bar."""
    return None if reporter is None else lambda found: reporter.best(found.to_json())


@takes_problem(key_options(FrontKeys))
def pareto(
    flags: ProblemFlags,
    name: options.AnyScene = None,
    plot: options.Plot = None,
    out: options.Out = None,
    report: Report = None,
    as_json: options.Json = False,
) -> None:
    """Find the front of peak against resonance band.

    Designs of which none has both a lower peak and a narrower band than another, with what a narrower band
    costs. The problem is described as for `design`, without weights and a limit on the band.
    """
    from service.jobs.kinds.pareto import ParetoRequest, pareto_issues

    told = problem_inputs.description(name, flags, "pareto")
    asked = _Asked.of(told, ParetoRequest, pareto_issues, plot=plot, out=out, report=report, as_json=as_json)
    with bar("pareto", "designs") as on_progress:
        import optim

        front = optim.pareto_front(asked.scene, **asked.given, on_progress=on_progress)
    asked.end(front, design_reports.front, drawn=bool(front.points))
