"""``/`` and ``/page/…``: the page, from the package; ``/docs``: the API for people, from its description.

The modules of the page are sent as two scripts, so that a browser asks once where it asked a hundred times:
one of all that the first look needs, one of what only `import("./x.js")` reaches, fetched when first asked
for. Each module becomes a function that runs once and returns what it exports, behind those that it imports:
`import { a, b as c } from "./x.js"` is `const { a, b: c } = x`. What stands under `vendor` stays a file of
its own, imported by its address. The page is written so that this is enough: imports are of names, in one
line, exports are declarations that are never assigned again, and nothing goes in a circle.
"""

from __future__ import annotations

import hashlib
import json
import posixpath
import re
from collections.abc import Callable, Iterator, Mapping
from functools import cache, partial
from html import escape
from pathlib import Path
from typing import Any

from fastapi import APIRouter, Request, Response

from service.errors import NotFoundError
from service.http.dependencies import TEXT, InContext, media
from service.http.made_once import Constant
from service.http.middleware.admission import LOGIN
from solver.lab import files_of

router = APIRouter(include_in_schema=False)

POLICY = (
    "default-src 'self'; img-src 'self' blob:; object-src 'none'; base-uri 'none'; "
    "form-action 'none'; frame-ancestors 'none'"
)
_HEADERS = {"Content-Security-Policy": POLICY}
_TYPES = {
    ".html": "text/html; charset=utf-8",
    ".js": "text/javascript; charset=utf-8",
    ".css": "text/css; charset=utf-8",
    ".svg": "image/svg+xml",
}
_FOLDER = Path(__file__).resolve().parents[2] / "page"
_FOR_EVER = "public, max-age=31536000, immutable"
_VERSION = "%VERSION%"
_ENTRY, _SCRIPT, _LATER, _STYLE = "js/main.js", "js/page.js", "js/later.js", "css/page.css"
_SHEET = re.compile(r'<link rel="stylesheet" href="/page/%VERSION%/css/([\w-]+\.css)">\n')


@cache
def files() -> dict[str, bytes]:
    """Every file of the page by its path, its modules as two scripts and its sheets as one; read once.

    A folder of the lab has its view in `view.js`: they are modules of `js/lab/`, `js/lab.js` lists them.
    """
    kept = [path for path in _FOLDER.rglob("*") if path.suffix in _TYPES]
    found = {path.relative_to(_FOLDER).as_posix(): path.read_bytes() for path in kept}
    views = files_of("view.js")
    found |= {f"js/lab/{room}.js": view for room, view in views.items()}
    imports = "".join(f'import {{ view as {room} }} from "./lab/{room}.js";\n' for room in views)
    found["js/lab.js"] = f"{imports}export const LAB = [{', '.join(views)}];\n".encode()
    texts = {path: data.decode() for path, data in found.items() if path.endswith(".js")}
    found |= {path: script.encode() for path, script in bundle(texts, _ENTRY).items()}
    found[_STYLE] = b"".join(found[f"css/{name}"] for name in _SHEET.findall(found["index.html"].decode()))
    return found


@cache
def version() -> str:
    """The hash of all files: part of every address, so that each may be kept for ever."""
    found = hashlib.sha256()
    for path, data in sorted(files().items()):
        found.update(f"{path} {len(data)} ".encode() + data)
    return found.hexdigest()[:16]


def _index() -> bytes:
    """The page, with its style sheets and its modules as one file each."""
    html = files()["index.html"].decode()
    sheets = "".join(sheet[0] for sheet in _SHEET.finditer(html))
    html = html.replace(sheets, f'<link rel="stylesheet" href="/page/{_VERSION}/{_STYLE}">\n')
    return html.replace(_ENTRY, _SCRIPT).replace(_VERSION, version()).encode()


INDEX = Constant(_index, _TYPES[".html"], {**_HEADERS, "Cache-Control": "no-cache"})


@router.get("/")
async def index(request: Request) -> Response:
    """The page."""
    return await INDEX.answer(request)


@router.get(LOGIN)
async def ways_in(context: InContext) -> dict[str, str | None]:
    """The address at which people log in, None where the service takes keys alone."""
    return {"url": None if context.service.settings.oidc_issuer is None else f"{LOGIN}/begin"}


@router.get("/page/{hashed}/{path:path}")
async def file(hashed: str, path: str, request: Request) -> Response:
    """A file of the page; one asked for by the address of another version is not kept."""
    await INDEX.answer(request)  # the files are read with it
    if (found := _constants().get(path)) is None:
        raise NotFoundError(f"there is nothing at {request.url.path}")
    return await found.answer(request, {"Cache-Control": _FOR_EVER if hashed == version() else "no-cache"})


@cache
def _constants() -> dict[str, Constant]:
    made = {path: partial(bytes, data) for path, data in files().items() if path != "index.html"}
    return {
        path: Constant(make, _TYPES[posixpath.splitext(path)[1]], _HEADERS) for path, make in made.items()
    }


docs = APIRouter(prefix="/docs", tags=["health"])

_POLICY = "default-src 'none'; style-src 'self'; base-uri 'none'; form-action 'none'; frame-ancestors 'none'"
_REFERENCE_STYLE = """
body { font: 16px/1.5 system-ui, sans-serif; color: #222; max-width: 60rem;
margin: 2rem auto; padding: 0 1rem }
h2 { margin-top: 2.5rem; font-size: 1.1rem; border-top: 1px solid #ccc; padding-top: 1rem }
code, pre { font: 0.9rem/1.4 ui-monospace, monospace; background: #f4f4f4 }
code { padding: 0 0.2rem } pre { padding: 0.6rem; overflow-x: auto }
.method { color: #0072b2; font-weight: bold; text-transform: uppercase }
table { border-collapse: collapse; width: 100% } td, th { text-align: left; vertical-align: top;
padding: 0.2rem 0.6rem 0.2rem 0; border-bottom: 1px solid #eee }
summary { cursor: pointer }
"""


def reference(description: Callable[[], dict[str, Any]]) -> Constant:
    """The reference, made of the description of the API."""
    headers = {"Content-Security-Policy": _POLICY}
    return Constant(lambda: "".join(_page(description())).encode(), _TYPES[".html"], headers)


@docs.get("", response_class=Response, responses={200: media({"text/html": TEXT})})
async def page(request: Request) -> Response:
    """This reference."""
    found: Constant = request.app.state.reference
    return await found.answer(request)


_STYLE_OF_REFERENCE = Constant(_REFERENCE_STYLE.encode, _TYPES[".css"])


@docs.get("/style.css", response_class=Response, responses={200: media({"text/css": TEXT})})
async def style(request: Request) -> Response:
    """How the reference looks."""
    return await _STYLE_OF_REFERENCE.answer(request)


def _page(description: dict[str, Any]) -> Iterator[str]:
    info = description["info"]
    yield '<!doctype html><html lang="en"><head><meta charset="utf-8">'
    yield '<meta name="viewport" content="width=device-width, initial-scale=1">'
    yield f"<title>{escape(info['title'])} API</title>"
    yield '<link rel="stylesheet" href="/docs/style.css"></head><body>'
    yield f"<h1>{escape(info['title'])} {escape(info['version'])}</h1><p>{escape(info['description'])} "
    yield 'For programs: <a href="/openapi.json">openapi.json</a>.</p><ul>'
    paths = description["paths"].items()
    operations = [(method, path, one) for path, methods in paths for method, one in methods.items()]
    for method, path, operation in operations:
        yield f'<li><a href="#{escape(operation["operationId"])}">{method.upper()} {escape(path)}</a></li>'
    yield "</ul>"
    for method, path, operation in operations:
        yield from _operation(method, path, operation, description)
    yield "</body></html>"


def _operation(method: str, path: str, operation: dict[str, Any], whole: dict[str, Any]) -> Iterator[str]:
    yield f'<h2 id="{escape(operation["operationId"])}"><span class="method">{method}</span> '
    yield f"<code>{escape(path)}</code></h2>"
    yield from (f"<p>{_words(paragraph)}</p>" for paragraph in operation.get("description", "").split("\n\n"))
    if parameters := operation.get("parameters", ()):
        yield "<h3>Parameters</h3><table>"
        for one in parameters:
            text = one.get("description") or one["schema"].get("description", "")
            yield f"<tr><td><code>{escape(one['name'])}</code></td><td>{escape(one['in'])}</td>"
            yield f"<td>{_words(text)}</td></tr>"
        yield "</table>"
    for form, content in operation.get("requestBody", {}).get("content", {}).items():
        yield f"<h3>Body: {escape(form)}</h3>"
        yield from _examples(content, whole)
    yield "<h3>Answers</h3><table>"
    for status, answer in operation["responses"].items():
        forms = ", ".join(f"<code>{escape(form)}</code>" for form in answer.get("content", {}))
        yield f"<tr><td>{escape(status)}</td><td>{_words(answer['description'])}</td><td>{forms}</td></tr>"
    yield "</table>"


def _examples(content: dict[str, Any], whole: dict[str, Any]) -> Iterator[str]:
    """The examples of a body, then its schema."""
    for example in content.get("examples", {}).values():
        yield f"<pre>{escape(json.dumps(example['value'], indent=1))}</pre>"
    schema = content["schema"]
    if "$ref" in schema:
        schema = whole["components"]["schemas"][schema["$ref"].rpartition("/")[2]]
    yield f"<details><summary>Schema</summary><pre>{escape(json.dumps(schema, indent=1))}</pre></details>"


def _words(text: str) -> str:
    """Text with what stands between backticks as code."""
    return re.sub("`([^`]*)`", r"<code>\1</code>", escape(text))


_IMPORT = re.compile(r'^import \{([^}]*)\} from "([^"]+)";\n', re.MULTILINE)
_EXPORT = re.compile(r"^export (?=(?:async )?(?:function\*?|const|class) (\w+))", re.MULTILINE)
_ON_DEMAND = re.compile(r'\bimport\("([^"]+)"\)')
_OTHER = re.compile(r"^(?:import\b(?!\()|export\b).*", re.MULTILINE)


def bundle(files: Mapping[str, str], entry: str) -> dict[str, str]:
    """Return by their paths the script of what `entry` imports, and that of what is imported on demand.

    ValueError for a module that is not there, goes in a circle, is imported both ways or is written
    otherwise. `files` has the text of each module by its path; the scripts stand beside `entry`.
    """
    beside = partial(posixpath.relpath, start=posixpath.dirname(entry))
    place: dict[str, str] = {}  # the script that a module is in
    on_demand: list[str] = []
    under_way: list[str] = []

    def script(own: str, roots: list[str]) -> str:
        heads: dict[str, str] = {}
        bodies: list[str] = []

        def add(path: str) -> None:
            if path in under_way or path not in files:
                what = "imports itself" if path in under_way else "is not there"
                raise ValueError(f"the module {path!r} {what}: {' → '.join([*under_way, path])}")
            under_way.append(path)
            lines = []
            for names, source in _IMPORT.findall(files[path]):
                target = posixpath.normpath(f"{path}/../{source}")
                if "/vendor/" in target:
                    heads[target] = f'import * as {_name(target)} from "./{beside(target)}";'
                elif target not in place:
                    add(target)
                elif place[target] != own:
                    heads[target] = f'import {{ {_name(target)} }} from "./{beside(place[target])}";'
                lines.append(f"const {{{names.replace(' as ', ': ')}}} = {_name(target)};")
            body = _ON_DEMAND.sub(partial(later, path), _IMPORT.sub("", files[path]))
            exported = ", ".join(_EXPORT.findall(body))
            body = "\n".join([*lines, _EXPORT.sub("", body)])
            if odd := _OTHER.search(body):
                raise ValueError(f"{path!r}: {odd[0]!r} is no import of names and no export of a declaration")
            if path != entry:  # which nothing imports: it stays under way
                body = f"export const {_name(path)} = (() => {{\n{body}return {{ {exported} }};\n}})();"
                place[path] = own
                under_way.pop()
            bodies.append(f"// {path}\n{body}")

        for path in roots:  # what is on demand may become more meanwhile
            if place.get(path, own) != own:
                raise ValueError(f"the module {path!r} is imported at once and on demand")
            if path not in place:
                add(path)
        return "\n".join([*heads.values(), *bodies])

    def later(path: str, found: re.Match[str]) -> str:
        target = posixpath.normpath(f"{path}/../{found[1]}")
        if "/vendor/" in target:
            return f'import("./{beside(target)}")'
        on_demand.append(target)
        return f'import("./{beside(_LATER)}").then((all) => all.{_name(target)})'

    return {_SCRIPT: script(_SCRIPT, [entry]), _LATER: script(_LATER, on_demand)}


def _name(path: str) -> str:
    return "$" + re.sub(r"\W", "_", path)
