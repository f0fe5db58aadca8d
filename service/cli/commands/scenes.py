"""`stickslip scenes`: the scenes that come with the package."""

from __future__ import annotations

from service.cli.options import shared as options
from service.rendering.tables import results as reports
from service.rendering.tables.text import print_json


def scenes(as_json: options.Json = False) -> None:
    """List the shipped scenes."""
    import solver

    known = [solver.load_scene(name) for name in solver.shipped_scenes()]
    if as_json:
        print_json({"scenes": [scene.name for scene in known]})
    else:
        reports.scenes(known)
