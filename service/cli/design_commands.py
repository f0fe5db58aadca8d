"""The commands that choose parameters: design."""

from __future__ import annotations

import typer

from service.cli import design_reports, inputs, options, problem_inputs
from service.cli.failures import FELL_SHORT
from service.cli.output import print_json
from service.cli.problem_options import ProblemFlags, takes_problem
from service.cli.progress import bar
from service.plots import SUFFIXES


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
    from service.kinds.design import DesignRequest

    picture = inputs.output_path("--plot", plot, SUFFIXES)
    scene, given = problem_inputs.posed(problem_inputs.description(name, flags, "design"), DesignRequest)
    with bar("design", "responses") as on_progress:
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


def end(reached: bool, status: str) -> None:
    """Leave with status 1 and the reason, if the goal was not reached."""
    if not reached:
        typer.echo(f"stickslip: {status}", err=True)
        raise typer.Exit(FELL_SHORT)
