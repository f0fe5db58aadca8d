"""`stickslip report`: the design report of a job, as a page or a PDF."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from service.cli.options import inputs
from service.cli.options import shared as options
from service.errors import InputError
from service.rendering.tables.text import say

if TYPE_CHECKING:
    from service.rendering.report.sections import Designed

SUFFIXES = (".html", ".pdf")
_KINDS = ("design", "pareto")


def report(
    job: options.Job,
    out: Annotated[
        str, typer.Option("--out", metavar="F", help="The report: .html or .pdf.")
    ] = "report.html",
    url: options.Url = options.DEFAULT_URL,
) -> None:
    """Write the report of a design that the service computed.

    A page that needs nothing else; a PDF where Chromium or Chrome is there.
    """
    import solver
    from service.cli.commands.client.jobs import client_of
    from service.jobs.registry import ABOUT_THE_RUN
    from service.rendering.report.sections import Designed

    target = inputs.output_path("--out", out, SUFFIXES)
    with client_of(url) as client:
        asked = client.job(job)
        if asked.kind not in _KINDS:
            raise InputError(
                f"`JOB` must be a design or a pareto job, {job!r} is of the kind {asked.kind!r} and has no "
                f"optimum to report: `stickslip results {job} --plot F` draws it, without --plot prints it"
            )
        answer = client.results(job)
        scene = solver.Scene.from_dict(client.job_scene(job))
    apart = (*_NOT_OF_A_PROBLEM, *ABOUT_THE_RUN)
    problem = {k: v for k, v in (asked.request or {}).items() if k not in apart}
    if target is not None:
        write(Designed(scene=scene, problem=problem, result=answer.result), target)
        say(f"{target} is written")


_NOT_OF_A_PROBLEM = ("kind", "scene", "set", "fresh", "priority", "max_seconds")


def write(given: Designed, target: Path) -> None:
    """Write a report as its suffix says.

    Raises
    ------
    InputError
        No browser for a PDF.
    """
    from service.rendering.report.design import design_report
    from service.rendering.report.robust import robust_report
    from solver.results.files import whole

    made = robust_report if "nominal" in given.result else design_report
    if target.suffix.lower() == ".pdf":
        from service.rendering.report.pdf import browser, write_pdf

        program = browser()
        write_pdf(made(given), target, program)
        return
    page = made(given)
    with whole(target) as temporary:
        temporary.write_text(page, "utf-8")
