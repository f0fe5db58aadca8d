"""`stickslip schema`: what editors need to complete and check the files people write."""

from __future__ import annotations

import json
from typing import Annotated

import typer

from service.cli import completion
from service.errors import InputError
from service.rendering.tables.text import say


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
