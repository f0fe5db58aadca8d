"""The commands that pose a design problem, by options, by a file, or by both: design and pareto."""

from __future__ import annotations

from collections.abc import Callable
from typing import Annotated

import typer

from optim.problem.problem_keys import options as key_options
from service.cli.commands.report import SUFFIXES, write
from service.cli.options import inputs, problem_inputs
from service.cli.options import parameters as options
from service.cli.options.problem_inputs import ProblemFlags, takes_problem
from service.cli.study_command import Outputs, give, watched
from service.jobs.common.problem_requests import ProblemRequest
from service.jobs.studies.design_study import Design
from service.jobs.studies.pareto_study import Pareto

Report = Annotated[
    str | None, typer.Option("--report", metavar="F", help="Write a design report: .html or .pdf.")
]


def command_of_problem(study: type[ProblemRequest]) -> Callable[..., None]:
    """Return the command of a study that poses a design problem."""

    def command(
        flags: ProblemFlags,
        name: options.AnyScene = None,
        plot: options.Plot = None,
        out: options.Out = None,
        report: Report = None,
        as_json: options.Json = False,
    ) -> None:
        told = problem_inputs.description(name, flags, study.NAME)
        outputs = Outputs.asked(plot, out)
        page = inputs.output_path("--report", report, SUFFIXES)
        scene, given = problem_inputs.posed(told, study)
        with told.named(), watched(study) as watch:
            answer = study.compute(scene, given, watch)
        if page is not None:
            from service.rendering.report.sections import Designed

            write(Designed(scene=scene, problem=given, result=answer.json), page)
        give(study, answer, outputs, scene, as_json=as_json)

    command.__doc__ = study.__doc__
    return takes_problem(key_options(study))(command)


design, pareto = command_of_problem(Design), command_of_problem(Pareto)
