"""The commands that compute here and now: scenes, plan, solve, sweep.

What is heavy is imported inside the commands: `stickslip solve` starts without CVXPY, Matplotlib or the
service.
"""

from __future__ import annotations

from functools import partial

from service.cli.failures import end
from service.cli.options import inputs
from service.cli.options import shared as options
from service.cli.output_files import Outputs
from service.cli.progress import bar
from service.errors import InputError
from service.rendering.tables import results as reports
from service.rendering.tables.text import print_json, show


def scenes(as_json: options.Json = False) -> None:
    """List the shipped scenes."""
    import solver

    known = [solver.load_scene(name) for name in solver.shipped_scenes()]
    if as_json:
        print_json({"scenes": [scene.name for scene in known]})
    else:
        reports.scenes(known)


def plan(
    name: options.Scene,
    values: options.Values = None,
    harmonics: options.Harmonics = 11,
    effects: options.Effects = "auto",
    as_json: options.Json = False,
) -> None:
    """Say which effects a scene calls for, and why."""
    import solver

    asked = solver.Effects.read(effects)
    found = solver.plan(inputs.scene(name, values), harmonics=harmonics, effects=asked)
    show(found.to_json(), reports.plan, as_json=as_json)


def sweep(
    name: options.Scene,
    parameter: options.Parameter = "frequency",
    start: options.From = None,
    stop: options.To = None,
    frequency: options.FixedFrequency = None,
    values: options.Values = None,
    limit: options.Limit = None,
    harmonics: options.Harmonics = 11,
    accuracy: options.Accuracy = None,
    effects: options.Effects = "auto",
    multipliers: options.Multipliers = False,
    switched: options.SwitchedBranches = False,
    plot: options.Plot = None,
    out: options.Out = None,
    as_json: options.Json = False,
) -> None:
    """Follow the response over a parameter.

    By continuation: folds are passed, and only converged points count.
    """
    import solver

    outputs = Outputs.asked(plot, out)
    if parameter == "frequency" and frequency is not None:
        raise InputError(
            f"`--frequency` is for sweeps of another --parameter, got {frequency!r}: try --from, --to"
        )
    scene, asked = inputs.scene(name, values), solver.Effects.read(effects)
    with inputs.path_of("--parameter"), bar("sweep") as on_progress:
        branch = solver.sweep(
            scene, parameter, start, stop, harmonics=harmonics, accuracy=accuracy, frequency_hz=frequency,
            limit=limit, effects=asked, on_progress=on_progress,
        )  # fmt: skip
    outputs.write(branch, partial(branch.plot, limit=limit) if len(branch.values) else None)
    found = branch.to_json()
    if multipliers:
        found |= solver.bifurcations(branch, multipliers=True).of_a_branch()
    if switched:
        found["branches"] = [each.to_json() for each in solver.switch_branches(branch)]
    show(found, reports.branch, as_json=as_json)
    end(branch.completed, branch.status.value)
