"""The commands that compute here and now: scenes, plan, solve, sweep.

What is heavy is imported inside the commands: `stickslip solve` starts without CVXPY, Matplotlib or the
service.
"""

from __future__ import annotations

from service.cli.options import inputs
from service.cli.options import shared as options
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
