"""What the routes share: reading bodies strictly, waiting without holding a thread, the host check.

A body is a type that FastAPI describes and checks; it is read here all the same, where limits of size and
time hold and JSON has no loopholes (`TypedRoute`).
"""

from __future__ import annotations

import asyncio
import hashlib
import re
from collections.abc import AsyncIterator, Callable, Coroutine, Mapping, Sequence
from concurrent.futures import ThreadPoolExecutor
from contextlib import asynccontextmanager
from dataclasses import dataclass
from typing import Annotated, Any, BinaryIO, TypeVar

from anyio import to_thread
from fastapi import Body, Depends, Request, Response
from fastapi.exceptions import RequestValidationError
from fastapi.routing import APIRoute
from pydantic import BaseModel
from starlette.datastructures import Headers
from starlette.types import ASGIApp, Receive, Scope, Send

from service.auth.callers import KEYLESS, Caller
from service.db.repositories import JobRow
from service.errors import (
    BodyTooLargeError,
    HostRefusedError,
    InvalidRequestError,
    MalformedBodyError,
    SlowBodyError,
    UnsupportedMediaError,
)
from service.http.made_once import known_by
from service.jobs import strict_json
from service.jobs.strict_json import MOST_TOLD, issues_of
from service.queue.core import Service
from service.queue.running import Event
from service.rendering.representations import JSON, LIST_MEDIA, chosen, csv_of_items
from service.schemas.answers import Page
from service.schemas.problems import service_problem

SMALL_BYTES = 32 * 1024
"""A body that is read in a millisecond, on the event loop."""
_LARGE_AT_ONCE = 2


async def chunks(request: Request, limit: int, seconds: float) -> AsyncIterator[bytes]:
    """Yield a body piece by piece.

    UnsupportedMediaError if it is compressed; BodyTooLargeError, SlowBodyError if it has more than `limit`
    bytes, or needs more than `seconds` to arrive.
    """
    encoding = request.headers.get("content-encoding", "identity").strip().lower()
    if encoding != "identity":
        raise UnsupportedMediaError(f"`Content-Encoding` must be left out here, got {encoding!r:.100}")
    declared = request.headers.get("content-length", "")
    if declared.isdigit() and int(declared) > limit:
        raise BodyTooLargeError(f"the body may have {limit} bytes, this one has {declared[:30]}")
    size = 0
    end = asyncio.get_running_loop().time() + seconds
    stream = request.stream()
    while True:
        try:
            async with asyncio.timeout_at(end):
                piece = await anext(stream, None)
        except TimeoutError as error:
            raise SlowBodyError(f"the body did not arrive within {seconds:g} s") from error
        if piece is None:
            return
        size += len(piece)
        if size > limit:
            raise BodyTooLargeError(f"the body may have {limit} bytes, this one has more")
        if piece:
            yield piece


async def whole(request: Request, limit: int, seconds: float) -> bytes:
    """A body at once; `chunks` lists the errors."""
    return b"".join([piece async for piece in chunks(request, limit, seconds)])


class BodyTurns:
    """Large bodies take turns once they have arrived: parsed, each takes ten times its length.

    One of an owner at a time, a few of all. They are parsed in threads of their own: what a thread has freed
    stays with it, and the many threads of the routes would keep the memory of one body each.
    """

    def __init__(self, at_once: int = _LARGE_AT_ONCE) -> None:
        self._all = asyncio.Semaphore(at_once)
        self._threads = ThreadPoolExecutor(at_once, thread_name_prefix="stickslip body")
        self._owners: dict[str, tuple[asyncio.Lock, int]] = {}

    async def parsed(self, data: bytes) -> object:
        """A body as JSON; `service.jobs.strict_json.loads` lists the errors."""
        if len(data) <= SMALL_BYTES:
            return strict_json.loads(data)
        return await asyncio.get_running_loop().run_in_executor(self._threads, strict_json.loads, data)

    @asynccontextmanager
    async def of(self, owner: str, size: int) -> AsyncIterator[None]:
        """The turn of a body of `size` bytes; a small one waits for nobody."""
        if size <= SMALL_BYTES:
            yield
            return
        lock, waiting = self._owners.get(owner, (asyncio.Lock(), 0))
        self._owners[owner] = (lock, waiting + 1)
        try:
            async with lock, self._all:
                yield
        finally:
            lock, waiting = self._owners[owner]
            self._owners[owner] = (lock, waiting - 1)
            if waiting == 1:
                del self._owners[owner]


_WRITTEN_BYTES = 1 << 18


async def saved(request: Request, file: BinaryIO, limit: int, seconds: float) -> tuple[int, str]:
    """Write a body to a file; its size and SHA-256. `chunks` lists the errors.

    The disk may be slow: nobody but this request waits for it.
    """
    size, found, held = 0, hashlib.sha256(), bytearray()

    def write() -> None:
        file.write(held)
        found.update(held)
        held.clear()

    async for piece in chunks(request, limit, seconds):
        held += piece
        size += len(piece)
        if len(held) >= _WRITTEN_BYTES:
            await to_thread.run_sync(write)
    await to_thread.run_sync(write)
    return size, found.hexdigest()


_PREFER_WAIT = re.compile(r"(?:^|[,;\s])wait\s*=\s*\"?(\d{1,6})\"?(?:$|[,;\s])", re.IGNORECASE)
_KEY = re.compile(r"[\x21-\x7e]{1,200}")
_LOOK_AGAIN_SECONDS = 2.0

AnswerT = TypeVar("AnswerT")


def service_behind(request: Request) -> Service:
    """The service behind the app."""
    service: Service = request.app.state.service
    return service


@dataclass(frozen=True, slots=True)
class Context:
    """What every look-up has: the request, the service behind the app, and who asks."""

    request: Request
    service: Service
    caller: Caller
    token: str = ""
    """Of the link that it is asked by, if it is."""

    @property
    def sees(self) -> str | None:
        """The owner whose things are seen; None for everybody's."""
        return self.caller.sees


# Dependencies are asynchronous: others would be run in a thread each, which costs more than they do.
async def context_of(request: Request) -> Context:
    """The context of a request; who asks was put there on admission."""
    return Context(request, service_behind(request), getattr(request.state, "caller", KEYLESS))


InContext = Annotated[Context, Depends(context_of)]


async def json_body(context: InContext) -> AsyncIterator[dict[str, Any]]:
    """The body of a request as a JSON object, no larger than the settings allow, until it is answered.

    UnsupportedMediaError, BodyTooLargeError, SlowBodyError, MalformedBodyError, InvalidRequestError for a
    body that is not that.
    """
    request, settings = context.request, context.service.settings
    kind = request.headers.get("content-type", "").split(";")[0].strip().lower()
    if kind != "application/json" and not kind.endswith("+json"):
        raise UnsupportedMediaError(f"`Content-Type` must be application/json, got {kind or 'none'}")
    data = await whole(request, settings.max_body_bytes, settings.body_seconds)
    turns: BodyTurns = request.app.state.turns
    async with turns.of(context.caller.owner, len(data)):
        value = await turns.parsed(data)
        del data
        if not isinstance(value, dict):
            raise MalformedBodyError(f"the body must be a JSON object, got {type(value).__name__}")
        yield value


reading = asynccontextmanager(json_body)
JsonBody = Annotated[dict[str, Any], Depends(json_body)]

Handler = Callable[[Request], Coroutine[Any, Any, Response]]


class _ReadRequest(Request):
    """A request whose body was read before; FastAPI gets the value."""

    def __init__(self, request: Request, value: dict[str, Any]) -> None:
        super().__init__(request.scope, request.receive)
        self._value = value
        kept = [(name, text) for name, text in request.headers.raw if name != b"content-type"]
        # Other media types of JSON were let through; FastAPI need not know them.
        self._typed = Headers(raw=[*kept, (b"content-type", b"application/json")])

    @property
    def headers(self) -> Headers:
        """Those that came, with one media type for every kind of JSON."""
        return self._typed

    async def body(self) -> bytes:
        """Something, so that `json` is asked."""
        return b"{}"

    async def json(self) -> dict[str, Any]:
        """The value."""
        return self._value


class TypedRoute(APIRoute):
    """A route whose body is a model: read strictly, refused with everything that is wrong with it."""

    def get_route_handler(self) -> Handler:
        """FastAPI's own handler behind the strict reading of the body."""
        handle, field = super().get_route_handler(), self.body_field
        if field is None:
            return handle
        of_kinds = getattr(field.field_info, "discriminator", None) is not None

        async def read_and_handle(request: Request) -> Response:
            async with reading(await context_of(request)) as value:
                try:
                    return await handle(_ReadRequest(request, value))
                except RequestValidationError as error:
                    # The place of an error begins with "body" and, of several kinds, with the name of the
                    # kind.
                    errors = error.errors()[:MOST_TOLD]
                    found = [{**one, "loc": one["loc"][1:]} for one in errors]
                    known = [{**one, "loc": one["loc"][1:]} if of_kinds else one for one in found]
                    kinds: Any = (await context_of(request)).service.registry if of_kinds else {}
                    kind = value.get("kind") if isinstance(value, dict) else None
                    model = kinds[kind].request if isinstance(kind, str) and kind in kinds else None
                    raise InvalidRequestError(issues_of(known, model)) from error

        return read_and_handle


def takes_body(
    endpoint: Callable[..., Any], model: Any, examples: Mapping[str, Any], by: str | None = None
) -> None:
    """Give an endpoint the type of its parameter `body`, where that is not known before a service is.

    Parameters
    ----------
    endpoint : of a `TypedRoute`.
    model : the type of the body.
    examples : of it, by name, for the description of the API.
    by : the key that tells several models apart.
    """
    told = Body(openapi_examples=dict(examples), discriminator=by)
    endpoint.__annotations__["body"] = Annotated[model, told]


def preferred_wait(headers: Mapping[str, str], longest: float) -> float | None:
    """Seconds of ``Prefer: wait=N`` (RFC 7240), at most `longest`; None without it."""
    found = _PREFER_WAIT.search(headers.get("prefer", ""))
    return None if found is None else min(float(found.group(1)), longest)


def idempotency_key(headers: Mapping[str, str]) -> str | None:
    """The Idempotency-Key of a request, or None.

    InvalidRequestError if it is empty, longer than 200 characters or not printable ASCII.
    """
    key = headers.get("idempotency-key")
    if key is None or _KEY.fullmatch(key):
        return key
    raise InvalidRequestError.of(
        ("Idempotency-Key",),
        "must be 1 to 200 printable ASCII characters without spaces",
        key[:80],
        source="header",
    )


def tagged(
    request: Request,
    body: bytes,
    media_type: str = "application/json",
    headers: Mapping[str, str] | None = None,
) -> Response:
    """A body with its strong ETag (RFC 9110); 304 without it if the client has the same."""
    tag = f'"{hashlib.sha256(body).hexdigest()}"'
    kept = {**(headers or {}), "ETag": tag}
    if known_by(request, tag):
        return Response(status_code=304, headers=kept)
    return Response(body, media_type=media_type, headers=kept)


def as_json(answer: BaseModel, status: int = 200, headers: Mapping[str, str] | None = None) -> Response:
    """An answer as JSON, written here, in the thread that made it: FastAPI would do it on the event loop."""
    return Response(answer.__pydantic_serializer__.to_json(answer), status, headers, "application/json")


def with_raw(answer: BaseModel, **raw: bytes) -> bytes:
    """An answer as JSON with further keys whose JSON there is already."""
    more = b"".join(b',"%s":%s' % (name.encode(), value) for name, value in raw.items())
    return bytes(answer.__pydantic_serializer__.to_json(answer))[:-1] + more + b"}"


def raw_list(answers: Sequence[BaseModel]) -> bytes:
    """Answers as a JSON list."""
    return b"[" + b",".join(one.__pydantic_serializer__.to_json(one) for one in answers) + b"]"


def listing(context: Context, page: Page[Any]) -> Response:
    """A page of a list as JSON or CSV, with a link to the next one in its header too (RFC 8288)."""
    kind = chosen(context.request.headers.get("accept"), LIST_MEDIA)
    headers = {"Vary": "Accept"}
    if page.next is not None:
        headers["Link"] = f'<{page.next}>; rel="next"'
    if kind == JSON:
        return Response(page.model_dump_json(), media_type=kind, headers=headers)
    return Response(csv_of_items(page.model_dump(mode="json")["items"]), media_type=kind, headers=headers)


async def wait_for_end(
    context: Context,
    job_id: str,
    seconds: float,
    answer: Callable[[JobRow], AnswerT],
    known: JobRow | None = None,
) -> AnswerT:
    """Wait until a job has ended, the time is over or the service stops; holds no thread meanwhile.

    Parameters
    ----------
    context, job_id, seconds : where to look and as whom, for which job, how long [s].
    answer : makes of the row what is wanted, in the same transaction.
    known : the row as it was a moment ago: it is not looked at before something happens.
    """
    service, caller = context.service, context.caller
    loop = asyncio.get_running_loop()
    changed = asyncio.Event()

    def listen(event: Event) -> None:
        if event.ended:
            loop.call_soon_threadsafe(changed.set)

    def look() -> tuple[bool, AnswerT]:
        with service.database.reading():
            row = service.job(job_id, caller)
            return row.state.finished, answer(row)

    end = loop.time() + seconds
    with service.waiters.listening(job_id, listen):
        waits = known is not None and not known.state.finished and not service.waiters.ended_lately(job_id)
        while True:
            left = end - loop.time()
            over = service.stopping.is_set() or left <= 0.0
            if over or not waits:
                finished, found = await service.lanes.reads.run(caller.owner, look)
                if finished or over or service.stopping.is_set():
                    return found
            waits = False
            try:
                await asyncio.wait_for(changed.wait(), min(left, _LOOK_AGAIN_SECONDS))
            except TimeoutError:
                continue
            changed.clear()


class HostCheck:
    """Refuses requests for host names that are not this service's.

    Without it, a web page could reach a service on loopback under a name that its owner points there.
    """

    def __init__(self, app: ASGIApp, hosts: tuple[str, ...]) -> None:
        self._app = app
        self._hosts = frozenset(host.lower() for host in hosts)

    async def __call__(self, scope: Scope, receive: Receive, send: Send) -> None:
        """Pass the request on, or answer it with a problem."""
        if "*" not in self._hosts:
            request = Request(scope, receive)
            host = re.sub(r":\d+$", "", request.headers.get("host", "").lower())
            if host not in self._hosts:
                error = HostRefusedError(f"the host {host!r} is not one of {', '.join(sorted(self._hosts))}")
                await service_problem(request, error)(scope, receive, send)
                return
        await self._app(scope, receive, send)


Responses = dict[int | str, dict[str, Any]]

TEXT: dict[str, Any] = {"type": "string"}
BINARY: dict[str, Any] = {"type": "string", "contentMediaType": "application/octet-stream"}
UNCHANGED: Responses = {304: {"description": "`If-None-Match` has its ETag."}}


def media(schemas: Mapping[str, Mapping[str, Any]]) -> dict[str, Any]:
    """An answer in further media types."""
    return {"content": {name: {"schema": dict(schema)} for name, schema in schemas.items()}}


LISTED: Responses = {200: media({"text/csv": TEXT})}
