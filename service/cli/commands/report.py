"""`stickslip report`: the design report of a job, as a page or a PDF."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from service.cli.options import inputs
from service.cli.options import parameters as options
from service.errors import InputError
from service.rendering.text import say

if TYPE_CHECKING:
    from service.client.client import Client
    from service.rendering.report.sections import Designed

SUFFIXES = (".html", ".pdf")


def report(
    client: Client,
    job: options.Job,
    out: Annotated[
        str, typer.Option("--out", metavar="F", help="The report: .html or .pdf.")
    ] = "report.html",
) -> None:
    """Write the report of a design or an identification that the service computed.

    A page that needs nothing else, or a PDF of a few sheets (with the extra `pdf`).
    """
    import solver
    from service.rendering.report.about import about_run
    from service.rendering.report.sections import KINDS, Designed, problem_of_request

    target = inputs.output_path("--out", out, SUFFIXES)
    asked = client.job(job)
    if asked.kind not in KINDS:
        raise InputError(
            f"`JOB` must be a design, pareto or identify job, {job!r} is of the kind {asked.kind!r}, "
            f"which has no report: `stickslip results {job} --plot F` draws it, without --plot prints it"
        )
    answer = client.results(job)
    scene = solver.Scene.from_dict(client.job_scene(job))
    run = client.run(job)
    project = None if run.project is None else client.project(run.project)
    problem = problem_of_request(asked.request or {})
    if target is not None:
        about = about_run(run, project)
        write(Designed(scene=scene, problem=problem, result=answer.result, about=about), target)
        say(f"{target} is written")


def write(given: Designed, target: Path) -> None:
    """Write a report as its suffix says.

    Raises
    ------
    InputError
        A PDF, where what writes it is not installed.
    """
    from service.rendering.report.making import report_of
    from solver.results.files import whole

    made = report_of(given, target.suffix.lower().removeprefix("."))
    with whole(target) as temporary:
        temporary.write_bytes(made)
