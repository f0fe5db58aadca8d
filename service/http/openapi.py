"""The description of the API: what FastAPI gathers, made whole where a body is no model of ours."""

from __future__ import annotations

from typing import Any

from fastapi import FastAPI
from pydantic import BaseModel

from service.http import error_examples
from service.http.routes.uploads import upload_media
from service.jobs.registry import Registry
from solver.scene.scene import Scene, load_scene

_REFERENCE = "#/components/schemas/{model}"
# Bodies whose schema stands in the operation itself.
_ITSELF = (
    "/v1/jobs", "/v1/designs", "/v1/previews", "/v1/plan", "/v1/scenes/read", "/v1/scenes/text",
    "/v1/scenes/edit", "/v1/templates",
)  # fmt: skip
_FILE: dict[str, Any] = {"type": "string", "contentMediaType": "application/octet-stream"}
_MATRIX = {
    "MatrixMarket": {"value": "%%MatrixMarket matrix coordinate real symmetric\n2 2 2\n1 1 1.0\n2 2 2.0\n"}
}
_KEY = {"type": "http", "scheme": "bearer", "description": "Made by `stickslip keys create`."}
_PROBLEM: dict[str, Any] = {
    "type": "object",
    "description": "RFC 9457",
    "required": ["type", "title", "status", "detail", "instance", "errors"],
    "properties": {
        "type": {"type": "string"},
        "title": {"type": "string"},
        "status": {"type": "integer"},
        "detail": {"type": "string"},
        "instance": {"type": "string"},
        "errors": {
            "type": "array",
            "items": {
                "type": "object",
                "required": ["pointer", "detail"],
                "properties": {
                    "pointer": {"type": "string", "description": "RFC 6901 pointer of the bad field."},
                    "detail": {"type": "string"},
                    "in": {"type": "string", "description": "query or header; the body if left out."},
                },
            },
        },
    },
}


def install(app: FastAPI, registry: Registry) -> None:
    """Have ``/openapi.json`` describe the request bodies and the problem documents."""
    gather = app.openapi

    def openapi() -> dict[str, Any]:
        if app.openapi_schema is None:
            _complete(gather(), registry)
        described: dict[str, Any] = app.openapi_schema or gather()
        return described

    app.openapi = openapi  # type: ignore[method-assign]


def _complete(description: dict[str, Any], registry: Registry) -> None:
    schemas = description.setdefault("components", {}).setdefault("schemas", {})
    paths = description["paths"]
    scene = {**_schema(Scene, schemas), "examples": [load_scene("two-dof").to_dict()]}
    named = {"scenes": {"value": scene["examples"][0]}}
    paths["/v1/scenes"]["post"]["requestBody"] = {
        "required": True,
        "content": {"application/json": {"schema": scene, "examples": named}},
    }
    paths["/v1/uploads"]["post"]["requestBody"] = {
        "required": True,
        "content": {form: {"schema": _FILE, "examples": _MATRIX} for form in upload_media()},
    }
    for path in _ITSELF:
        _in_place(paths[path]["post"]["requestBody"]["content"]["application/json"], schemas)
    _results(schemas, registry)
    description["components"]["securitySchemes"] = {"key": _KEY}
    # Either of them: whether a key is needed is a setting.
    description["security"] = [{"key": []}, {}]
    error_examples.describe(description, _PROBLEM)
    _use_known_patterns(description)


def _in_place(content: dict[str, Any], schemas: dict[str, Any]) -> None:
    """Put the schema of a body where FastAPI refers to it, so that what a kind takes is read in one place."""

    def found(schema: dict[str, Any]) -> dict[str, Any]:
        return schemas.pop(schema["$ref"].rpartition("/")[2]) if "$ref" in schema else schema

    schema = content["schema"]
    several = [found(one) for one in schema.get("oneOf", ())]
    content["schema"] = {"oneOf": several} if several else found(schema)


def _results(schemas: dict[str, Any], registry: Registry) -> None:
    """The results of the kinds that say how theirs look; others are objects."""
    known = {kind.name: kind.result for kind in registry if kind.result is not None}
    for name, model in known.items():
        schemas[result_name(name)] = _schema(model, schemas)
    if known:
        refs = [{"$ref": _REFERENCE.format(model=result_name(name))} for name in known]
        for answer in ("ResultsAnswer", "FinishedJob"):
            held = schemas[answer]["properties"]["result"]
            held["anyOf"] = [*refs, *held.get("anyOf", [{"type": "object"}])]


def result_name(kind: str) -> str:
    """What the description calls the result of a kind."""
    return "".join(part.capitalize() for part in kind.split("-")) + "Result"


def _use_known_patterns(item: Any) -> None:
    r"""Patterns as JSON Schema has them: its regular expressions (ECMA 262) have no `\z`."""
    if isinstance(item, dict):
        if isinstance(item.get("pattern"), str):
            item["pattern"] = item["pattern"].replace(r"\z", "$")
        for inner in item.values():
            _use_known_patterns(inner)
    elif isinstance(item, list):
        for inner in item:
            _use_known_patterns(inner)


def _schema(model: type[BaseModel], schemas: dict[str, Any]) -> dict[str, Any]:
    """The schema of a model; the models it refers to go to `schemas`."""
    schema = model.model_json_schema(by_alias=True, ref_template=_REFERENCE)
    schemas.update(schema.pop("$defs", {}))
    return schema
