"""``/`` and ``/page/…``: the page, its modules and styles, served from the package."""

from __future__ import annotations

import hashlib
from functools import cache
from importlib import resources
from importlib.resources.abc import Traversable

from fastapi import APIRouter, BackgroundTasks, Request, Response

from service.errors import NotFoundError
from service.http.dependencies import InContext, tagged

router = APIRouter(include_in_schema=False)

POLICY = (
    "default-src 'self'; img-src 'self' blob:; object-src 'none'; base-uri 'none'; "
    "form-action 'none'; frame-ancestors 'none'"
)
_HEADERS = {
    "Content-Security-Policy": POLICY,
    "X-Content-Type-Options": "nosniff",
    "Referrer-Policy": "no-referrer",
}
_TYPES = {
    ".html": "text/html; charset=utf-8",
    ".js": "text/javascript; charset=utf-8",
    ".css": "text/css; charset=utf-8",
    ".svg": "image/svg+xml",
}
_FOR_EVER = "public, max-age=31536000, immutable"
_VERSION = "%VERSION%"
_MODULES = "%MODULES%"


@cache
def files() -> dict[str, bytes]:
    """Every file of the page by its path, read once."""
    found: dict[str, bytes] = {}
    pending: list[tuple[str, Traversable]] = [("", resources.files("service") / "page")]
    while pending:
        path, item = pending.pop()
        if item.is_dir():
            pending.extend((f"{path}/{child.name}".lstrip("/"), child) for child in item.iterdir())
        elif path[path.rfind(".") :] in _TYPES:
            found[path] = item.read_bytes()
    return found


@cache
def version() -> str:
    """The hash of all files: part of every address, so that each may be kept for ever."""
    found = hashlib.sha256()
    for path, data in sorted(files().items()):
        found.update(f"{path} {len(data)} ".encode() + data)
    return found.hexdigest()[:16]


@cache
def index() -> bytes:
    """The page, which names its modules so that they are fetched together."""
    modules = sorted(path for path in files() if path.endswith(".js"))
    links = "\n".join(f'<link rel="modulepreload" href="/page/{version()}/{path}">' for path in modules)
    html = files()["index.html"].decode()
    return html.replace(_MODULES, links).replace(_VERSION, version()).encode()


@router.get("/")
async def page(context: InContext, tasks: BackgroundTasks) -> Response:
    """The page, whose live response is wanted in a moment."""
    tasks.add_task(context.service.previews.begin)
    tasks.add_task(context.service.answers.begin)
    headers = {**_HEADERS, "Cache-Control": "no-cache"}
    return tagged(context.request, index(), _TYPES[".html"], headers)


@router.get("/page/{hashed}/{path:path}")
async def file(hashed: str, path: str, request: Request) -> Response:
    """A file of the page; one asked for by the address of another version is not kept."""
    data = files().get(path)
    if data is None or path == "index.html":
        raise NotFoundError(f"there is nothing at {request.url.path}")
    keep = _FOR_EVER if hashed == version() else "no-cache"
    headers = {**_HEADERS, "Cache-Control": keep}
    return tagged(request, data, _TYPES[path[path.rfind(".") :]], headers)
