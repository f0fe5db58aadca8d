"""An example of every error, for the description of the API, and which operations answer it."""

from __future__ import annotations

from typing import Any

from service.http.middleware.admission import OPEN
from service.schemas.problems import MEDIA_TYPE

_BAD = [{"pointer": "/contacts/0/mu", "detail": "`mu` must be >= 0, got -0.1"}]
_BAD_QUERY = [{"pointer": "/limit", "detail": "`limit` must be >= 1, got 0", "in": "query"}]

# Status, slug, title, detail, errors; the name of each is that of a response in `components`.
_ERRORS: dict[str, tuple[int, str, str, str, list[dict[str, str]]]] = {
    "MalformedBody": (400, "malformed-body", "The body cannot be read",
                      "the body is not JSON: Expecting value in line 1, column 10", []),
    "Unauthorized": (401, "unauthorized", "A key is needed",
                     "this needs a key: send it as `Authorization: Bearer …`", []),
    "Forbidden": (403, "forbidden", "The key does not allow this",
                  "this needs a key with the scope submit, this one has read", []),
    "TooManyRequests": (429, "too-many-requests", "Too many requests",
                        "the key may make 1200 requests a minute", []),
    "NotFound": (404, "not-found", "Not found", "there is no job '01a2'", []),
    "NotAcceptable": (406, "not-acceptable", "Not available in a form you accept",
                      "there is application/json, text/csv here, `Accept` takes none of it: 'image/gif'", []),
    "BodyTooSlow": (408, "body-too-slow", "The body did not arrive in time",
                    "the body did not arrive within 30 s", []),
    "Conflict": (409, "conflict", "The request does not fit the present state",
                 "job 01a2 is running, it has no results yet", []),
    "Overtaken": (409, "conflict", "The request does not fit the present state",
                  "a newer preview of the same client took its place", []),
    "ChangedMeanwhile": (412, "changed-meanwhile", "It was changed meanwhile",
                         "run 01a2 was changed meanwhile: get it again, and change that", []),
    "JobFailed": (409, "job-failed", "The job failed", "job 01a2 failed: `mu` must be >= 0, got -0.1", _BAD),
    "BodyTooLarge": (413, "body-too-large", "The body is too large",
                     "the body may have 4194304 bytes, this one has more", []),
    "UnsupportedMedia": (415, "unsupported-media-type", "A body of this kind is not read here",
                         "`Content-Type` must be application/json, got text/plain", []),
    "InvalidRequest": (422, "invalid-request", "The request is not valid", "`mu` must be >= 0, got -0.1",
                       _BAD),
    "InvalidQuery": (422, "invalid-request", "The request is not valid", "`limit` must be >= 1, got 0",
                     _BAD_QUERY),
    "UnreadableUpload": (422, "unreadable-upload", "The file cannot be used",
                         "'upload.npz' must hold a square matrix, got 3 x 4", []),
    "StorageFull": (507, "storage-full", "No more may be stored",
                    "an owner may have 1000 projects, with those in the bin", []),
    "QueueFull": (503, "queue-full", "The queue is full",
                  "1000 jobs wait already, the queue takes 1000: try again later", []),
    "Preview": (503, "preview", "The preview was not finished",
                "the preview took longer than 3 s: submit it as a job", []),
    "DatabaseAway": (503, "database-away", "The database does not answer",
                     "the database does not answer at present; nothing was written, try again later", []),
}  # fmt: skip
_BODY = ("MalformedBody", "BodyTooSlow", "BodyTooLarge", "UnsupportedMedia", "InvalidRequest")
_KEYED = ("Unauthorized", "Forbidden", "TooManyRequests")
_LIST = ("NotAcceptable", "InvalidQuery")
_OF: dict[tuple[str, str], tuple[str, ...]] = {
    ("post", "/v1/jobs"): (*_BODY, "QueueFull"),
    ("post", "/v1/designs"): (*_BODY, "QueueFull"),
    ("post", "/v1/scenes"): (*_BODY, "Conflict", "QueueFull"),
    ("get", "/v1/scenes"): ("InvalidQuery",),
    ("post", "/v1/plan"): (*_BODY, "QueueFull"),
    ("post", "/v1/previews"): (*_BODY, "Overtaken", "Preview", "QueueFull"),
    ("post", "/v1/scenes/read"): (*_BODY, "QueueFull"),
    ("post", "/v1/scenes/text"): (*_BODY, "QueueFull"),
    ("post", "/v1/scenes/edit"): (*_BODY, "QueueFull"),
    ("post", "/v1/templates"): _BODY,
    ("post", "/v1/uploads"): (
        "BodyTooSlow", "BodyTooLarge", "UnsupportedMedia", "UnreadableUpload", "QueueFull",
    ),
    ("get", "/v1/jobs"): _LIST,
    ("get", "/v1/designs"): _LIST,
    ("get", "/v1/sweeps"): _LIST,
    ("get", "/v1/uploads"): _LIST,
    ("get", "/v1/sweeps/{sweep_id}"): ("NotAcceptable", "InvalidQuery"),
    ("delete", "/v1/jobs/{job_id}"): ("Conflict",),
    ("get", "/v1/jobs/{job_id}/results"): ("Conflict", "JobFailed"),
    ("get", "/v1/projects"): _LIST,
    ("post", "/v1/projects"): (*_BODY, "StorageFull"),
    ("patch", "/v1/projects/{project_id}"): (*_BODY, "Conflict", "ChangedMeanwhile"),
    ("post", "/v1/projects/{project_id}/restore"): ("Conflict",),
    ("get", "/v1/runs"): _LIST,
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

    Parameters
    ----------
    problem : dict
        The schema of a problem document.
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
                _add(responses, str(_ERRORS[name][0]), _ERRORS[name][2], name)
            _add(responses, "default", "Any other problem.", "DatabaseAway")


def _add(responses: dict[str, Any], status: str, title: str, name: str) -> None:
    held = responses.setdefault(status, {"description": title})
    schema = {"$ref": "#/components/schemas/Problem"}
    media = held.setdefault("content", {}).setdefault(MEDIA_TYPE, {"schema": schema})
    media.setdefault("examples", {})[name] = {"$ref": f"#/components/examples/{name}"}


def _example(name: str) -> dict[str, Any]:
    status, slug, title, detail, issues = _ERRORS[name]
    return {
        "type": f"urn:stickslip:problem:{slug}",
        "title": title,
        "status": status,
        "detail": detail,
        "instance": "/v1/jobs/01a2",
        "errors": issues,
    }
