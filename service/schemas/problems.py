"""Every error as a problem document (RFC 9457): the one place where exceptions meet HTTP."""

from __future__ import annotations

import asyncio
import logging
import secrets
from collections.abc import Mapping
from http import HTTPStatus
from typing import Any

from fastapi import FastAPI, Request
from fastapi.exceptions import RequestValidationError
from fastapi.responses import JSONResponse
from sqlalchemy.exc import DataError, OperationalError
from sqlalchemy.exc import TimeoutError as PoolTimeoutError
from starlette.exceptions import HTTPException
from starlette.requests import ClientDisconnect
from starlette.routing import Match
from starlette.types import ASGIApp, Message, Receive, Scope, Send

from service import errors
from service.jobs.strict_json import issues_of
from solver.errors import Issue
from solver.wording import nearest

log = logging.getLogger("stickslip.http")

MEDIA_TYPE = "application/problem+json"
_RETRY_SECONDS = 5
_METHODS = ("GET", "HEAD", "POST", "PUT", "PATCH", "DELETE")
# Not the service's fault, and no news for its log.
_EXPECTED = frozenset({"queue-full", "overloaded", "storage-full"})
_CHALLENGE = 'Bearer realm="stickslip"'

STATUS: dict[type[errors.ServiceError], tuple[int, str, str]] = {
    errors.InvalidRequestError: (422, "invalid-request", "The request is not valid"),
    errors.MalformedBodyError: (400, "malformed-body", "The body cannot be read"),
    errors.UnsupportedMediaError: (415, "unsupported-media-type", "A body of this kind is not read here"),
    errors.SlowBodyError: (408, "body-too-slow", "The body did not arrive in time"),
    errors.UnreadableUploadError: (422, "unreadable-upload", "The file cannot be used"),
    errors.NotAcceptableError: (406, "not-acceptable", "Not available in a form you accept"),
    errors.BodyTooLargeError: (413, "body-too-large", "The body is too large"),
    errors.HostRefusedError: (421, "host-refused", "This service does not answer to this host name"),
    errors.OriginRefusedError: (403, "origin-refused", "A web page elsewhere may not ask for this"),
    errors.UnauthorizedError: (401, "unauthorized", "A key is needed"),
    errors.ForbiddenError: (403, "forbidden", "The key does not allow this"),
    errors.TooManyRequestsError: (429, "too-many-requests", "Too many requests"),
    errors.NotFoundError: (404, "not-found", "Not found"),
    errors.ConflictError: (409, "conflict", "The request does not fit the present state"),
    errors.ChangedMeanwhileError: (412, "changed-meanwhile", "It was changed meanwhile"),
    errors.IdempotencyError: (
        422,
        "idempotency-key-reused",
        "The idempotency key belongs to another request",
    ),
    errors.QueueFullError: (503, "queue-full", "The queue is full"),
    errors.OverloadedError: (503, "overloaded", "The service has too much to do"),
    errors.StorageFullError: (507, "storage-full", "No more may be stored"),
    errors.DatabaseAwayError: (503, "database-away", "The database does not answer"),
    errors.PreviewError: (503, "preview", "The preview was not finished"),
    errors.JobFailedError: (409, "job-failed", "The job failed"),
    errors.DatabaseError: (500, "database", "The database cannot be used"),
}


def problem(
    request: Request, status: int, slug: str, title: str, detail: str,
    issues: list[dict[str, str]] | None = None, headers: Mapping[str, str] | None = None,
) -> JSONResponse:  # fmt: skip
    """A problem document about a request."""
    body: dict[str, Any] = {
        "type": f"urn:stickslip:problem:{slug}", "title": title, "status": status, "detail": detail,
        "instance": request.url.path, "errors": issues or [],
    }  # fmt: skip
    # For the audit line; the outermost layer reads it from the same request.
    request.state.problem = (slug, detail)
    return JSONResponse(body, status_code=status, headers=headers, media_type=MEDIA_TYPE)


def install(app: FastAPI) -> None:
    """Have every error of `app` answered with a problem document."""
    app.add_exception_handler(errors.ServiceError, _known)
    app.add_exception_handler(RequestValidationError, _validation_error)
    app.add_exception_handler(HTTPException, _http_error)
    app.add_exception_handler(ClientDisconnect, _gone)
    app.add_exception_handler(DataError, _unstorable)
    for away in AWAY:
        app.add_exception_handler(away, _known)
    app.add_middleware(_Boundary)


def service_problem(request: Request, error: errors.ServiceError) -> JSONResponse:
    """The problem document of one of the service's own errors."""
    known = next((STATUS[kind] for kind in type(error).__mro__ if kind in STATUS), None)
    if known is None:
        return _unexpected(request, error)
    status, slug, title = known
    if status >= HTTPStatus.INTERNAL_SERVER_ERROR and slug not in _EXPECTED:
        log.error("%s %s: %s", request.method, request.url.path, error.detail)
    issues: list[dict[str, str]] = []
    headers: dict[str, str] = {}
    if isinstance(error, errors.InvalidRequestError):
        issues = [_entry(issue, error.source) for issue in error.issues]
    elif isinstance(error, errors.BodyTooLargeError | errors.SlowBodyError):
        # What is still to come of the body is not waited for.
        headers["Connection"] = "close"
    elif isinstance(error, errors.NotAcceptableError):
        headers["Vary"] = "Accept"
    elif isinstance(error, errors.UnauthorizedError):
        headers["WWW-Authenticate"] = _CHALLENGE + (', error="invalid_token"' if error.presented else "")
    elif isinstance(error, errors.NotFoundError):
        request.state.withheld = error.withheld
    elif isinstance(error, errors.RetryLaterError):
        headers["Retry-After"] = str(error.retry_after)
    elif isinstance(error, errors.JobFailedError):
        found = error.error.get("issues")
        issues = list(found) if isinstance(found, list) else []
    return problem(request, status, slug, title, error.detail, issues, headers)


def _entry(issue: Issue, source: str) -> dict[str, str]:
    entry = {"pointer": issue.pointer, "detail": issue.said()}
    return entry if source == "body" else {**entry, "in": source}


AWAY = (OperationalError, PoolTimeoutError)
"""What is raised if the database does not answer, or no connection to it is free in time."""


def answered(request: Request, error: Exception) -> JSONResponse:
    """The problem document of the service's own errors, and of a database that does not answer."""
    if isinstance(error, errors.ServiceError):
        return service_problem(request, error)
    # It is away, full or locked: nothing was written.
    log.error("%s %s: the database failed: %s", request.method, request.url.path, error)
    detail = "the database does not answer at present; nothing was written, try again later"
    headers = {"Retry-After": str(_RETRY_SECONDS)}
    return problem(request, 503, "database-away", "The database does not answer", detail, headers=headers)


async def _known(request: Request, error: Exception) -> JSONResponse:
    return answered(request, error)


async def _gone(request: Request, _error: Exception) -> JSONResponse:
    """The client left before its body was here; nobody reads this."""
    return problem(request, 400, "body-incomplete", "The body is incomplete", "the body ended too early")


async def _unstorable(request: Request, error: Exception) -> JSONResponse:
    """A value that no row can hold, such as a text with a zero character in PostgreSQL."""
    log.warning("%s %s holds what the database refuses: %s", request.method, request.url.path, error)
    status, slug, title = STATUS[errors.InvalidRequestError]
    detail = "the request holds a character or a number that cannot be stored or looked for"
    return problem(request, status, slug, title, detail)


async def _validation_error(request: Request, error: Exception) -> JSONResponse:
    """What FastAPI refuses: bad query, path or header parameters; bodies are checked by the routes."""
    if not isinstance(error, RequestValidationError):
        return _unexpected(request, error)
    entries: list[dict[str, str]] = []
    for item in error.errors():
        source, *rest = item["loc"]
        issue = issues_of([{**item, "loc": rest}])[0]
        entries.append(_entry(issue, str(source)))
    detail = "; ".join(entry["detail"] for entry in entries)
    status, slug, title = STATUS[errors.InvalidRequestError]
    return problem(request, status, slug, title, detail, entries)


async def _http_error(request: Request, error: Exception) -> JSONResponse:
    """What Starlette refuses: unknown routes, wrong methods."""
    if not isinstance(error, HTTPException):
        return _unexpected(request, error)
    title = HTTPStatus(error.status_code).phrase
    detail = str(error.detail)
    headers = dict(error.headers or {})
    if error.status_code == HTTPStatus.NOT_FOUND:
        detail = (
            f"there is nothing at {request.url.path}{nearest(request.url.path, [*request.app.state.own])}"
        )
    elif error.status_code == HTTPStatus.METHOD_NOT_ALLOWED:
        headers["Allow"] = ", ".join(_allowed(request))
        detail = f"{request.method} is not possible at {request.url.path}, use {headers['Allow']}"
    slug = title.lower().replace(" ", "-").replace("'", "")
    return problem(request, error.status_code, slug, title, detail, headers=headers)


def _allowed(request: Request) -> list[str]:
    """The methods of every route at the path of a request; Starlette names those of the first one only."""
    own = request.app.state.own.get(request.url.path, ())

    def possible(method: str) -> bool:
        asked = "GET" if method == "HEAD" else method
        if own:
            return asked in own
        scope = {**request.scope, "method": asked}
        return any(route.matches(scope)[0] is Match.FULL for route in request.app.routes)

    return [method for method in _METHODS if possible(method)]


class _Boundary:
    """Answers what nothing else caught; Starlette's own boundary would break the connection afterwards."""

    def __init__(self, app: ASGIApp) -> None:
        self._app = app

    async def __call__(self, scope: Scope, receive: Receive, send: Send) -> None:
        """Pass the request on; if that fails before an answer began, answer 500, or 503 at the end."""
        began = False

        async def watch(message: Message) -> None:
            nonlocal began
            began = True
            await send(message)

        try:
            await self._app(scope, receive, watch)
        except asyncio.CancelledError:
            # The server cancels what has not ended when its grace is over, and answers 500 to it by itself.
            if began:
                raise
            await _ended_with_the_service(Request(scope))(scope, receive, send)
        except Exception as error:
            if began:
                raise
            await _unexpected(Request(scope), error)(scope, receive, send)


def _ended_with_the_service(request: Request) -> JSONResponse:
    """A request that the end of the service interrupts; what it had begun in a thread may still be done."""
    detail = (
        "the service stops and did not finish this; what was to be written may have been: "
        "repeat the request, a submission with its Idempotency-Key"
    )
    headers = {"Retry-After": str(_RETRY_SECONDS)}
    return problem(request, 503, "stopping", "The service is stopping", detail, headers=headers)


def _unexpected(request: Request, error: Exception) -> JSONResponse:
    """An error of the program: details to the log, a reference to the client."""
    reference = secrets.token_hex(6)
    log.error("%s %s failed, reference %s", request.method, request.url.path, reference, exc_info=error)
    detail = f"an unexpected error; the service's log has the details under {reference}"
    return problem(request, 500, "internal", "Internal error", detail)
