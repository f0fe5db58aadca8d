"""The scene file as JSON Schema (2020-12), so that editors complete and check it.

Types, ranges, defaults and descriptions are those of the models' fields; what a schema cannot say (a DOF that
must exist, low < high) is left to `load_scene`.
"""

from __future__ import annotations

import re
from collections.abc import Mapping
from inspect import cleandoc
from typing import Any

from pydantic import BaseModel
from pydantic.json_schema import GenerateJsonSchema, JsonSchemaValue
from pydantic_core import core_schema

from solver.contacts.laws import load_harmonics as load_harmonics
from solver.contacts.laws.contact_law import AnyContact
from solver.contacts.laws.law_registry import laws
from solver.matrices.values import UNITS
from solver.scene import linear_terms, materials
from solver.scene import matrices_structure as matrices_part
from solver.scene import scene_records as scene_parts
from solver.scene.bodies import body as scene_bodies
from solver.scene.bodies import body_shapes as scene_shapes
from solver.scene.bodies.body_validation import further_ends
from solver.scene.descriptions import EXAMPLES, WORDS
from solver.scene.scene import Scene
from solver.wording import every_field_said

DIALECT = "https://json-schema.org/draft/2020-12/schema"
_ENTRY = re.compile(r"^(\w+) : .*\n((?:    .*\n?)+)", re.MULTILINE)
_HOMES = (scene_parts, scene_bodies, scene_shapes, linear_terms, matrices_part, load_harmonics, materials)


class _Generator(GenerateJsonSchema):
    """Matrices are read by code: whatever holds them is described by hand below."""

    def handle_invalid_for_json_schema(
        self, schema: core_schema.CoreSchema, error_info: str
    ) -> JsonSchemaValue:  # fmt: skip
        del schema, error_info
        return {}


def scene_schema() -> dict[str, Any]:
    """The schema of a scene file: every table and key with unit, range, default and examples."""
    found = Scene.model_json_schema(schema_generator=_Generator)
    definitions: dict[str, Any] = found["$defs"]
    for name, definition in definitions.items():
        kinds = (*laws().values(), *linear_terms.coupling_kinds().values())
        by_name: dict[str, type[BaseModel]] = {each.__name__: each for each in kinds}
        model = by_name.get(name) or next(getattr(home, name) for home in _HOMES if hasattr(home, name))
        _describe(definition, model, name)
    _describe(found, Scene, "Scene")
    _matrices(definitions["MatricesStructure"]["properties"])
    properties = definitions["CyclicBoundary"]["properties"]
    nodes = {"anyOf": [{"type": "string"}, {"type": "array", "items": {"type": "integer"}, "minItems": 1}]}
    properties |= {
        "low": dict(nodes), "high": dict(nodes), "nodes": {"type": "string"},
        "pair_by": {"enum": ["position", "order"], "default": "position"},
        "tolerance": {"type": "number", "exclusiveMinimum": 0.0},
        "keep_modes": {"type": "integer", "minimum": 0},
    }  # fmt: skip
    for key, text in WORDS["CyclicBoundary"].items():
        properties[key]["description"] = text
    number = {"type": "number", "exclusiveMinimum": 0.0, "description": "Mass [kg]."}
    for name in ("LumpedStructure", "CyclicStructure"):
        masses = definitions[name]["properties"]["masses"]
        entry = {"anyOf": [number, {"$ref": "#/$defs/MassEntry"}]}
        masses["patternProperties"] = dict.fromkeys(masses["patternProperties"], entry)
        masses["additionalProperties"] = False
    for definition in definitions.values():
        if {"N1", "N1_ratio"} <= set(definition["properties"]):
            definition["not"] = {"required": ["N1", "N1_ratio"]}
            _load_list(definition)
    for word, law in laws().items():
        if ends := further_ends(word):
            ways = (list(ends), ["normal"], ["motions"])
            definitions[law.__name__]["anyOf"] = [{"required": keys} for keys in ways]
    forces = found["properties"]["excitation"]
    forces.pop("type")
    many = {"type": "array", "minItems": 1, "items": forces.pop("items")}
    found["properties"]["excitation"] = {**forces, "anyOf": [{"$ref": "#/$defs/Excitation"}, many]}
    return {"$schema": DIALECT, "title": "stickslip scene", **plain(found)}


def _load_list(definition: dict[str, Any]) -> None:
    """The list of a load as a file gives it: its mean first, which stands there or as N0."""
    load = definition["properties"]["load"]
    number, table = (
        {"type": "number", "description": "Mean normal load [N]."},
        {"$ref": "#/$defs/LoadHarmonic"},
    )
    load.pop("anyOf")
    load.pop("default", None)
    load |= {"type": "array", "prefixItems": [{"anyOf": [number, table]}], "items": table}
    definition["required"].remove("N0")
    first = {"properties": {"load": {"prefixItems": [{"type": "number"}], "minItems": 1}}}
    definition["allOf"] = [{"anyOf": [{"required": ["N0"]}, {"required": ["load"], **first}]}]


def plain(schema: Any) -> Any:
    """A schema as editors want it: TOML has no null, patterns end in ``$``, no titles made up from keys."""
    if isinstance(schema, list):
        return [plain(one) for one in schema]
    if not isinstance(schema, Mapping):
        return schema.replace(r"\z", "$") if isinstance(schema, str) else schema
    kept = dict(schema)
    choices = kept.get("anyOf")
    if isinstance(choices, list) and {"type": "null"} in choices:
        others = [one for one in choices if one != {"type": "null"}]
        del kept["anyOf"]
        kept = {**(others[0] if len(others) == 1 else {"anyOf": others}), **kept}
    if kept.get("default", 0) is None:
        del kept["default"]
    kept.pop("discriminator", None)
    if isinstance(kept.get("title"), str):
        del kept["title"]
    return {plain(key): plain(value) for key, value in kept.items()}


def _describe(definition: dict[str, Any], model: type[BaseModel], name: str) -> None:
    """Put the words of a model and of its fields into its schema."""
    words = words_of(model) | WORDS.get("*", {}) | WORDS.get(name, {})
    if issubclass(model, AnyContact):
        first, *others, last = laws()
        words |= {"law": f"{', '.join([f'{first} (also if left out)', *others])} or {last}.", **model.WORDS}
    definition["description"] = " ".join((model.__doc__ or "").partition("\nAttributes\n")[0].split())
    for key, given in definition["properties"].items():
        if key in words:
            given["description"] = words[key]
        if key in EXAMPLES:
            given["examples"] = EXAMPLES[key]


def words_of(model: type[BaseModel]) -> dict[str, str]:
    """What a model, and those it is made from, say of every field: there, or in a section of attributes."""
    found = {
        name: " ".join(text.split())
        for base in reversed(model.__mro__)
        for name, text in _ENTRY.findall(f"{cleandoc(base.__doc__ or '')}\n")
    }
    return found | {key: words for key, (_, words) in every_field_said(model).items()}


def _matrices(properties: dict[str, Any]) -> None:
    """The keys of a structure from matrices as a file gives them: names of files, rows, labels."""
    properties["modes"] |= {"anyOf": [{"type": "string"}, {"type": "object"}]}
    row = {"type": ["integer", "string"], "minimum": 0}
    names = {"type": "array", "items": {"type": "string"}, "minItems": 1}
    properties["dofs"] |= {
        "anyOf": [{"type": "object", "additionalProperties": row, "minProperties": 1}, names]
    }
    properties["keep_modes"] = {"type": "integer", "minimum": 0}
    properties["units"] = {"enum": list(UNITS), "default": "SI"}
    properties["mapping"] = {"type": "string"}
    properties["diameters"] |= {"anyOf": [{"type": "string"}, {"type": "object"}]}
    properties["outline"] |= {"type": "object"}
    for key, text in WORDS["MatricesStructure"].items():
        properties[key]["description"] = text
