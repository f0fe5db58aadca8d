"""The commands that choose parameters: design."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import TYPE_CHECKING, Any

import typer

from service.cli import design_reports, inputs, options, problem_inputs, robust_reports
from service.cli.failures import FELL_SHORT
from service.cli.output import print_json
from service.cli.problem_options import ProblemFlags, takes_problem
from service.cli.progress import bar
from service.plots import SUFFIXES

if TYPE_CHECKING:
    from solver.scene import Scene


@takes_problem
def design(
    flags: ProblemFlags,
    name: options.AnyScene = None,
    plot: options.Plot = None,
    as_json: options.Json = False,
) -> None:
    """Find the best damper.

    Parameters are chosen within bounds so that the highest peak over the scene's band is least, or what a
    problem file describes. An option given beside the file replaces the key it stands for.
    """
    from service.kinds.design import UNCERTAIN, DesignRequest, design_issues

    picture = inputs.output_path("--plot", plot, SUFFIXES)
    told = problem_inputs.description(name, flags, "design")
    scene, given = problem_inputs.posed(told, DesignRequest, design_issues)
    if UNCERTAIN in given:
        _robust(scene, given, picture, as_json=as_json)
        return
    with bar("design", "designs") as on_progress:
        import optim

        result = optim.design(scene, **given, on_progress=on_progress)
    if picture is not None and result.sweeps:
        from service.plots.designs import design_figure
        from service.plots.style import save

        save(design_figure(result), picture)
    if as_json:
        print_json(result.to_json())
    else:
        design_reports.design(result.to_json())
    end(result.reached, result.status.value)


def _robust(scene: Scene, given: Mapping[str, Any], picture: Path | None, *, as_json: bool) -> None:
    """A design with uncertain parameters: the nominal and the robust optimum side by side."""
    with bar("robust design", "responses") as on_progress:
        import optim

        result = optim.robust_design(scene, **given, on_progress=on_progress)
    if picture is not None and result.nominal is not None:
        from service.plots.designs import robust_figure
        from service.plots.style import save

        save(robust_figure(result), picture)
    if as_json:
        print_json(result.to_json())
    else:
        robust_reports.robust(result.to_json())
    end(result.reached, result.status.value)


def end(reached: bool, status: str) -> None:
    """Leave with status 1 and the reason, if the goal was not reached."""
    if not reached:
        typer.echo(f"stickslip: {status}", err=True)
        raise typer.Exit(FELL_SHORT)
