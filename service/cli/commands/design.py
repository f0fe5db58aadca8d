"""The commands that choose parameters: design and pareto."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from optim.problem.keys import DesignKeys, FrontKeys
from optim.problem.keys import options as key_options
from service.cli.commands.report import SUFFIXES, write
from service.cli.failures import FELL_SHORT
from service.cli.options import inputs, problem_inputs
from service.cli.options import shared as options
from service.cli.options.problem import ProblemFlags, takes_problem
from service.cli.output_files import Outputs
from service.cli.progress import bar
from service.rendering.tables import design as design_reports
from service.rendering.tables import robust as robust_reports
from service.rendering.tables.text import print_json

if TYPE_CHECKING:
    from solver.scene.scene import Scene


Report = Annotated[
    str | None, typer.Option("--report", metavar="F", help="Write a design report: .html or .pdf.")
]


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

    outputs = Outputs.asked(plot, out)
    page = inputs.output_path("--report", report, SUFFIXES)
    told = problem_inputs.description(name, flags, "design")
    scene, given = problem_inputs.posed(told, DesignRequest, design_issues)
    if UNCERTAIN in given:
        _robust(scene, given, outputs, page, as_json=as_json)
        return
    with bar("design", "designs") as on_progress:
        import optim

        result = optim.design(scene, **given, on_progress=on_progress)
    outputs.write(result, result.plot if result.sweeps else None)
    _report(scene, given, result.to_json(), page)
    if as_json:
        print_json(result.to_json())
    else:
        design_reports.design(result.to_json())
    end(result.reached, result.status.value)


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

    outputs = Outputs.asked(plot, out)
    page = inputs.output_path("--report", report, SUFFIXES)
    told = problem_inputs.description(name, flags, "pareto")
    scene, given = problem_inputs.posed(told, ParetoRequest, pareto_issues)
    with bar("pareto", "designs") as on_progress:
        import optim

        found = optim.pareto_front(scene, **given, on_progress=on_progress)
    outputs.write(found, found.plot if found.points else None)
    _report(scene, given, found.to_json(), page)
    if as_json:
        print_json(found.to_json())
    else:
        design_reports.front(found.to_json())
    end(found.reached, found.status.value)


def _robust(
    scene: Scene, given: Mapping[str, Any], outputs: Outputs, page: Path | None, *, as_json: bool
) -> None:
    """A design with uncertain parameters: the nominal and the robust optimum side by side."""
    with bar("robust design", "responses") as on_progress:
        import optim

        result = optim.robust_design(scene, **given, on_progress=on_progress)
    outputs.write(result, result.plot if result.nominal is not None else None)
    _report(scene, given, result.to_json(), page)
    if as_json:
        print_json(result.to_json())
    else:
        robust_reports.robust(result.to_json())
    end(result.reached, result.status.value)


def _report(scene: Scene, given: Mapping[str, Any], found: Mapping[str, Any], page: Path | None) -> None:
    """Write the report, if one was asked for."""
    if page is not None:
        from service.rendering.report.sections import Designed

        write(Designed(scene=scene, problem=given, result=found), page)


def end(reached: bool, status: str) -> None:
    """Leave with status 1 and the reason, if the goal was not reached."""
    if not reached:
        typer.echo(f"stickslip: {status}", err=True)
        raise typer.Exit(FELL_SHORT)
