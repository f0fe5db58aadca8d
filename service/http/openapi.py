"""The description of the API: what FastAPI gathers, and the bodies that the routes check themselves."""

from __future__ import annotations

from typing import Any

from fastapi import FastAPI
from pydantic import BaseModel

from service.http import error_examples
from service.http.routes.plan import PlanRequest
from service.http.routes.scene_text import ReadRequest, TextRequest
from service.http.routes.uploads import UPLOAD_MEDIA
from service.jobs.kinds.previews import PREVIEWS
from service.jobs.registry import Registry
from solver.scene.scene import Scene, load_scene

_REFERENCE = "#/components/schemas/{model}"
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
    kinds = {kind.name: _with_kind(_schema(kind.request, schemas), kind.name) for kind in registry}
    previews = {kind.name: _with_kind(_schema(kind.request, schemas), kind.name) for kind in PREVIEWS}
    named = {"/v1/jobs": kinds, "/v1/previews": previews}
    bodies: dict[str, dict[str, Any]] = {
        "/v1/jobs": {"oneOf": list(kinds.values())},
        "/v1/plan": _schema(PlanRequest, schemas),
        "/v1/scenes": {**_schema(Scene, schemas), "examples": [load_scene("two-dof").to_dict()]},
        "/v1/scenes/read": _schema(ReadRequest, schemas),
        "/v1/scenes/text": _schema(TextRequest, schemas),
        "/v1/previews": {"oneOf": list(previews.values())},
    }
    if "design" in kinds:
        bodies["/v1/designs"] = _schema(registry["design"].request, schemas)
    for path, schema in bodies.items():
        content = {"application/json": {"schema": schema, "examples": _examples(path, schema, named)}}
        description["paths"][path]["post"]["requestBody"] = {"required": True, "content": content}
    description["paths"]["/v1/uploads"]["post"]["requestBody"] = {
        "required": True,
        "content": {form: {"schema": _FILE, "examples": _MATRIX} for form in UPLOAD_MEDIA},
    }
    description["components"]["securitySchemes"] = {"key": _KEY}
    # Either of them: whether a key is needed is a setting.
    description["security"] = [{"key": []}, {}]
    error_examples.describe(description, _PROBLEM)
    _use_known_patterns(description)


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


def _examples(
    path: str, schema: dict[str, Any], kinds: dict[str, dict[str, dict[str, Any]]]
) -> dict[str, Any]:
    """Examples by name: those of every kind of job or preview, or those of the one body."""
    named = kinds.get(path, {path.rpartition("/")[2]: schema})
    return {
        f"{name} {number}" if number > 1 else name: {"value": example}
        for name, one in named.items()
        for number, example in enumerate(one.get("examples", ()), 1)
    }


def _schema(model: type[BaseModel], schemas: dict[str, Any]) -> dict[str, Any]:
    """The schema of a model; the models it refers to go to `schemas`."""
    schema = model.model_json_schema(by_alias=True, ref_template=_REFERENCE)
    schemas.update(schema.pop("$defs", {}))
    return schema


def _with_kind(schema: dict[str, Any], name: str) -> dict[str, Any]:
    examples = [{"kind": name, **example} for example in schema.get("examples", ())]
    return {
        **schema,
        **({"examples": examples} if examples else {}),
        "properties": {"kind": {"const": name}, **schema["properties"]},
        "required": ["kind", *schema.get("required", [])],
    }
