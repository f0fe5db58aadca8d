"""`stickslip scenes` and `schema`: the scenes that come with the package; what editors check files with."""

from __future__ import annotations

import json
from typing import Annotated

import typer

from service.cli import completion
from service.cli.options import shared as options
from service.errors import InputError
from service.rendering.tables import results as reports
from service.rendering.tables.text import print_json, say


def scenes(as_json: options.Json = False) -> None:
    """List the shipped scenes."""
    import solver

    known = [solver.load_scene(name) for name in solver.shipped_scenes()]
    if as_json:
        print_json({"scenes": [scene.name for scene in known]})
    else:
        reports.scenes(known)


def schema(
    what: Annotated[
        str,
        typer.Argument(
            metavar="[scene|problem|job]",
            help="What the schema is of.",
            autocompletion=completion.words("scene", "problem", "job"),
        ),
    ] = "scene",
) -> None:
    """Print the JSON Schema of scene files, design problems or jobs, for editors."""
    from service.schemas.json_schema import Described, schema_of

    words = [one.value for one in Described]
    if what not in words:
        raise InputError(f"`schema` takes {', '.join(words)}, got {what!r}")
    say(json.dumps(schema_of(Described(what)), indent=2, ensure_ascii=False))
