"""`stickslip report`: the design report of a job, as a page or a PDF."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from service.cli import inputs, options
from service.cli.failures import InputError
from service.cli.output import say

if TYPE_CHECKING:
    from service.answers import JobAnswer
    from service.report.design import Designed
    from solver.scene import Scene

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
    from service.cli.submit_commands import client_of
    from service.report.design import Designed

    target = inputs.output_path("--out", out, SUFFIXES)
    with client_of(url) as client:
        asked = client.job(job)
        if asked.kind not in _KINDS:
            raise InputError(f"`JOB` must be a design or a pareto job, {job!r} is of the kind {asked.kind!r}")
        answer = client.results(job)
        scene = _scene(asked, lambda name: client.scene(name).scene)
    problem = {k: v for k, v in (asked.request or {}).items() if k not in _NOT_OF_A_PROBLEM}
    if target is not None:
        write(Designed(scene=scene, problem=problem, result=answer.result), target)
        say(f"{target} is written")


_NOT_OF_A_PROBLEM = ("kind", "scene", "set", "fresh", "priority", "max_seconds")


def write(given: Designed, target: Path) -> None:
    """Write a report as its suffix says.

    Raises
    ------
    InputError
        A report of what has no report, or no browser for a PDF.
    """
    from service.report.design import design_report
    from solver.files import whole

    if "nominal" in given.result:
        raise InputError("a design with uncertain parameters has no report yet: use --plot and --out")
    if target.suffix.lower() == ".pdf":
        from service.report.pdf import browser, write_pdf

        program = browser()
        write_pdf(design_report(given), target, program)
        return
    page = design_report(given)
    with whole(target) as temporary:
        temporary.write_text(page, "utf-8")


def _scene(job: JobAnswer, stored: Any) -> Scene:
    """The scene of a job with its values set."""
    import solver

    request = job.request or {}
    named = request.get("scene")
    if isinstance(named, Mapping):
        scene = solver.Scene.from_dict(named)
    elif named in solver.shipped_scenes():
        scene = solver.load_scene(named)
    else:
        scene = solver.Scene.from_dict(stored(named))
    return scene.with_values(request.get("set") or {})
