"""The description of the API: what FastAPI gathers, made whole where a body is no model of ours; errors."""

from __future__ import annotations

import json
import threading
from typing import Any

from fastapi import APIRouter, FastAPI, Request, Response
from pydantic import BaseModel

from service import errors
from service.http.made_once import Constant
from service.http.middleware.admission import OPEN
from service.http.routes.form_routes import constants
from service.http.routes.page import reference
from service.http.routes.upload_routes import upload_media
from service.jobs.kind_registry import Registry
from service.queue.core import Service
from service.schemas.problems import MEDIA_TYPE, STATUS
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
    """Have ``/openapi.json`` describe the request bodies and the problem documents; it and ``/docs``."""
    gather, making = app.openapi, threading.Lock()

    def openapi() -> dict[str, Any]:
        with making:
            described = app.openapi_schema
            if described is None:
                _complete(described := gather(), registry)
        return described

    app.openapi = openapi  # type: ignore[method-assign]
    app.state.description = Constant(lambda: json.dumps(openapi(), separators=(",", ":")).encode())
    app.state.reference = reference(openapi)
    app.include_router(router)


router = APIRouter(include_in_schema=False)


@router.get("/openapi.json")
async def description(request: Request) -> Response:
    """The description for programs."""
    found: Constant = request.app.state.description
    return await found.answer(request)


def prepare(app: FastAPI) -> None:
    """Make what the page and strangers ask for first, which is kept."""
    service: Service = app.state.service
    asked = (*constants(service.registry), app.state.description, app.state.reference)
    for made in [one.prepared() for one in asked]:
        made.result()


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
    describe(description, _PROBLEM)
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
    known = {kind.name: made for kind in registry if (made := kind.answers) is not None}
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


_BAD = [{"pointer": "/contacts/0/mu", "detail": "`mu` must be >= 0, got -0.1"}]
_BAD_QUERY = [{"pointer": "/limit", "detail": "`limit` must be >= 1, got 0", "in": "query"}]

# Error, detail, errors; the name of each is that of a response in `components`.
_ERRORS: dict[str, tuple[type[errors.ServiceError], str, list[dict[str, str]]]] = {
    "MalformedBody": (
        errors.MalformedBodyError,
        "the body is not JSON: Expecting value in line 1, column 10", [],
    ),
    "Unauthorized": (errors.UnauthorizedError, "this needs a key: send it as `Authorization: Bearer …`", []),
    "Forbidden": (errors.ForbiddenError, "this needs a key with the scope submit, this one has read", []),
    "TooManyRequests": (errors.TooManyRequestsError, "the key may make 1200 requests a minute", []),
    "NotFound": (errors.NotFoundError, "there is no job '01a2'", []),
    "NotAcceptable": (
        errors.NotAcceptableError,
        "there is application/json, text/csv here, `Accept` takes none of it: 'image/gif'", [],
    ),
    "BodyTooSlow": (errors.SlowBodyError, "the body did not arrive within 30 s", []),
    "Conflict": (errors.ConflictError, "job 01a2 is running, it has no results yet", []),
    "Overtaken": (errors.ConflictError, "a newer preview of the same client took its place", []),
    "ChangedMeanwhile": (
        errors.ChangedMeanwhileError,
        "run 01a2 was changed meanwhile: get it again, and change that", [],
    ),
    "JobFailed": (errors.JobFailedError, "job 01a2 failed: `mu` must be >= 0, got -0.1", _BAD),
    "BodyTooLarge": (errors.BodyTooLargeError, "the body may have 4194304 bytes, this one has more", []),
    "UnsupportedMedia": (
        errors.UnsupportedMediaError,
        "`Content-Type` must be application/json, got text/plain", [],
    ),
    "InvalidRequest": (errors.InvalidRequestError, "`mu` must be >= 0, got -0.1", _BAD),
    "InvalidQuery": (errors.InvalidRequestError, "`limit` must be >= 1, got 0", _BAD_QUERY),
    "UnreadableUpload": (
        errors.UnreadableUploadError,
        "'upload.npz' must hold a square matrix, got 3 x 4", [],
    ),
    "StorageFull": (errors.StorageFullError, "an owner may have 1000 projects, with those in the bin", []),
    "QueueFull": (errors.QueueFullError, "1000 jobs wait already, the queue takes 1000: try again later", []),
    "Preview": (errors.PreviewError, "the preview took longer than 3 s: submit it as a job", []),
    "DatabaseAway": (
        errors.DatabaseAwayError,
        "the database does not answer at present; nothing was written, try again later", [],
    ),
}  # fmt: skip
_BODY = ("MalformedBody", "BodyTooSlow", "BodyTooLarge", "UnsupportedMedia", "InvalidRequest")
_KEYED = ("Unauthorized", "Forbidden", "TooManyRequests")
_LIST = ("NotAcceptable", "InvalidQuery")
_COMPUTED = ("jobs", "designs", "plan", "scenes/read", "scenes/text", "scenes/edit")
_LISTS = ("jobs", "designs", "sweeps", "results", "uploads", "projects", "runs")
_OF: dict[tuple[str, str], tuple[str, ...]] = {
    **{("post", f"/v1/{name}"): (*_BODY, "QueueFull") for name in _COMPUTED},
    **{("get", f"/v1/{name}"): _LIST for name in _LISTS},
    ("post", "/v1/scenes"): (*_BODY, "Conflict", "QueueFull"),
    ("get", "/v1/scenes"): ("InvalidQuery",),
    ("post", "/v1/previews"): (*_BODY, "Overtaken", "Preview", "QueueFull"),
    ("post", "/v1/templates"): _BODY,
    ("post", "/v1/uploads"): (
        "BodyTooSlow", "BodyTooLarge", "UnsupportedMedia", "UnreadableUpload", "QueueFull",
    ),
    ("get", "/v1/sweeps/{sweep_id}"): ("NotAcceptable", "InvalidQuery"),
    ("delete", "/v1/jobs/{job_id}"): ("Conflict",),
    **{("get", f"/v1/jobs/{{job_id}}/{name}"): ("Conflict", "JobFailed") for name in ("results", "told")},
    ("post", "/v1/projects"): (*_BODY, "StorageFull"),
    ("patch", "/v1/projects/{project_id}"): (*_BODY, "Conflict", "ChangedMeanwhile"),
    ("post", "/v1/projects/{project_id}/restore"): ("Conflict",),
    ("get", "/v1/runs/compare"): ("NotFound", "InvalidQuery"),
    ("patch", "/v1/runs/{job_id}"): (*_BODY, "Conflict", "ChangedMeanwhile"),
    ("delete", "/v1/runs/{job_id}"): ("Conflict",),
    ("post", "/v1/runs/{job_id}/restore"): ("Conflict",),
    ("post", "/v1/runs/{job_id}/shares"): (*_BODY, "Conflict", "StorageFull"),
    ("get", "/v1/shared"): ("NotFound", "InvalidQuery"),
    ("get", "/v1/shared/scene"): ("NotFound", "InvalidQuery"),
    ("get", "/v1/shared/results"): ("NotFound", "InvalidQuery", "Conflict", "JobFailed"),
    ("get", "/v1/shared/sweeps/{sweep_id}"): ("NotAcceptable", "InvalidQuery"),
}  # fmt: skip


def describe(description: dict[str, Any], problem: dict[str, Any]) -> None:
    """Give every operation of an OpenAPI document its errors, each with an example.

    `problem` is the schema of a problem document.
    """
    components = description["components"]
    components["schemas"]["Problem"] = problem
    components["examples"] = {name: {"value": _example(name)} for name in _ERRORS}
    for path, operations in description["paths"].items():
        for method, operation in operations.items():
            names = list(_OF.get((method, path), ()))
            if "{" in path:
                names.append("NotFound")
            if path not in OPEN:
                names += _KEYED
            responses = operation["responses"]
            responses.pop("422", None)
            for name in names:
                status, _, title = STATUS[_ERRORS[name][0]]
                _add(responses, str(status), title, name)
            _add(responses, "default", "Any other problem.", "DatabaseAway")


def _add(responses: dict[str, Any], status: str, title: str, name: str) -> None:
    held = responses.setdefault(status, {"description": title})
    schema = {"$ref": "#/components/schemas/Problem"}
    media = held.setdefault("content", {}).setdefault(MEDIA_TYPE, {"schema": schema})
    media.setdefault("examples", {})[name] = {"$ref": f"#/components/examples/{name}"}


def _example(name: str) -> dict[str, Any]:
    error, detail, issues = _ERRORS[name]
    status, slug, title = STATUS[error]
    return {
        "type": f"urn:stickslip:problem:{slug}", "title": title, "status": status, "detail": detail,
        "instance": "/v1/jobs/01a2", "errors": issues,
    }  # fmt: skip
