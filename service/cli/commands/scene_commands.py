"""`stickslip scenes` and `schema`: the scenes that come with the package; the JSON Schemas for editors."""

from __future__ import annotations

import json
import re
from enum import Enum
from typing import Annotated, Any

import typer

from service.cli import completion
from service.cli.options import parameters as options
from service.errors import InputError
from service.rendering.text import print_json, print_table, say
from solver.results import units
from solver.results.told import UNIT
from solver.scene.json_schema import DIALECT, plain, scene_schema
from solver.wording import nearest


class Described(Enum):
    """What there is a schema of; the value is the word users write."""

    SCENE = "scene"
    PROBLEM = "problem"
    JOB = "job"


def schema_of(what: Described) -> dict[str, Any]:
    """The schema of one kind of file."""
    if what is Described.SCENE:
        found: dict[str, Any] = _with_units(scene_schema())
        return found
    return _problem() if what is Described.PROBLEM else _job()


_LIMITS = ("type", "minimum", "exclusiveMinimum", "maximum", "exclusiveMaximum")


def _text_in(unit: str) -> dict[str, Any]:
    """A number with a unit behind it that may stand for another."""
    names = {unit, *units.SUFFIXES.get(unit, {})}
    names |= {spelled for spelled, name in units.SPELLED.items() if name in names}
    said = "|".join(re.escape(name).replace("\\ ", " ?") for name in sorted(names))
    return {"type": "string", "pattern": rf"^\s*[-+]?[0-9.]+([eE][-+]?[0-9]+)?\s*({said})\s*$"}


def _with_units(schema: Any, unit: str = "") -> Any:
    """Of a scene in a file, where a number that has a unit may be a text with one, ``"35 deg"``."""
    if isinstance(schema, list):
        return [_with_units(one, unit) for one in schema]
    if not isinstance(schema, dict):
        return schema
    words = schema.get("description")
    if isinstance(words, str):
        unit = next((each for each in UNIT.findall(words) if "," not in each), "")
    # What stands below a name is described by itself.
    kept = {
        key: {name: _with_units(one) for name, one in value.items()}
        if key in ("properties", "patternProperties", "$defs")
        else _with_units(value, unit)
        for key, value in schema.items()
    }
    if not unit or kept.get("type") != "number":
        return kept
    number = {key: kept.pop(key) for key in _LIMITS if key in kept}
    return {**kept, "anyOf": [number, _text_in(unit)]}


def _problem() -> dict[str, Any]:
    """Of ``--problem FILE``: a design, with the key that only fronts have."""
    from service.jobs.studies.design_study import Design
    from service.jobs.studies.pareto_study import Pareto

    found = plain(Design.model_json_schema())
    front = plain(Pareto.model_json_schema())
    found["$defs"] = {**front.get("$defs", {}), **found.get("$defs", {})}
    found["properties"] = {**front["properties"], **found["properties"]}
    # The scene may be the command's argument instead.
    found["required"] = [key for key in found.get("required", []) if key != "scene"]
    # Beside names and objects, the name of a scene file.
    either, words = (
        [{"type": "string"}, {"type": "object"}],
        found["properties"]["scene"].get("description", ""),
    )
    found["properties"]["scene"] = {"anyOf": either, "description": words}
    return {"$schema": DIALECT, "title": "stickslip design problem", **found}


def _job() -> dict[str, Any]:
    """Of the body of ``POST /v1/jobs``."""
    from service.jobs.kinds.bodies import body_model
    from service.settings.kinds import registry_here

    kinds, definitions = [], {}
    for kind in registry_here():
        schema = plain(body_model(kind.name, kind.request).model_json_schema())
        definitions.update(schema.pop("$defs", {}))
        kinds.append({**schema, "title": kind.name})
    return {"$schema": DIALECT, "title": "stickslip job", "oneOf": kinds, "$defs": definitions}


def scenes(as_json: options.Json = False) -> None:
    """List the shipped scenes."""
    import solver

    known = [solver.load_scene(name) for name in solver.shipped_scenes()]
    if as_json:
        print_json({"scenes": [scene.name for scene in known]})
        return
    rows = [
        (
            scene.name,
            scene.structure.kind,
            str(len(scene.dofs)),
            ", ".join(contact.name for contact in scene.contacts),
            scene.observe.dof,
            units.span(*scene.observe.band, "Hz"),
        )
        for scene in known
    ]
    print_table("Shipped scenes", ("name", "kind", "DOFs", "contacts", "observed", "band"), rows)


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
    words = [one.value for one in Described]
    if what not in words:
        raise InputError(f"`schema` takes {', '.join(words)}, got {what!r}{nearest(what, words)}")
    say(json.dumps(schema_of(Described(what)), indent=2, ensure_ascii=False))
