"""``/docs``: the API for people, one page made of its description, without scripts or other sites."""

from __future__ import annotations

import json
from collections.abc import Iterator
from html import escape
from typing import Any

from fastapi import APIRouter, Request, Response

from service.http.dependencies import TEXT, media

router = APIRouter(prefix="/docs", tags=["health"])

_POLICY = "default-src 'none'; style-src 'self'; base-uri 'none'; form-action 'none'; frame-ancestors 'none'"
_STYLE = """
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


@router.get("", response_class=Response, responses={200: media({"text/html": TEXT})})
def page(request: Request) -> Response:
    """This reference."""
    html = "".join(_page(request.app.openapi()))
    return Response(html, media_type="text/html", headers={"Content-Security-Policy": _POLICY})


@router.get("/style.css", response_class=Response, responses={200: media({"text/css": TEXT})})
def style() -> Response:
    """How the reference looks."""
    return Response(_STYLE, media_type="text/css")


def _page(description: dict[str, Any]) -> Iterator[str]:
    info = description["info"]
    yield '<!doctype html><html lang="en"><head><meta charset="utf-8">'
    yield '<meta name="viewport" content="width=device-width, initial-scale=1">'
    yield f"<title>{escape(info['title'])} API</title>"
    yield '<link rel="stylesheet" href="/docs/style.css"></head><body>'
    yield f"<h1>{escape(info['title'])} {escape(info['version'])}</h1><p>{escape(info['description'])} "
    yield 'For programs: <a href="/openapi.json">openapi.json</a>.</p><ul>'
    operations = [
        (method, path, operation)
        for path, methods in description["paths"].items()
        for method, operation in methods.items()
    ]
    for method, path, operation in operations:
        yield f'<li><a href="#{escape(operation["operationId"])}">{method.upper()} {escape(path)}</a></li>'
    yield "</ul>"
    for method, path, operation in operations:
        yield from _operation(method, path, operation, description)
    yield "</body></html>"


def _operation(method: str, path: str, operation: dict[str, Any], whole: dict[str, Any]) -> Iterator[str]:
    yield f'<h2 id="{escape(operation["operationId"])}"><span class="method">{method}</span> '
    yield f"<code>{escape(path)}</code></h2>"
    for paragraph in operation.get("description", "").split("\n\n"):
        yield f"<p>{_words(paragraph)}</p>"
    parameters = operation.get("parameters", ())
    if parameters:
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
    found = [example["value"] for example in content.get("examples", {}).values()]
    for example in found:
        yield f"<pre>{escape(json.dumps(example, indent=1))}</pre>"
    schema = content["schema"]
    if "$ref" in schema:
        schema = whole["components"]["schemas"][schema["$ref"].rpartition("/")[2]]
    yield f"<details><summary>Schema</summary><pre>{escape(json.dumps(schema, indent=1))}</pre></details>"


def _words(text: str) -> str:
    """Text with what stands between backticks as code."""
    pieces = escape(text).split("`")
    return "".join(f"<code>{piece}</code>" if index % 2 else piece for index, piece in enumerate(pieces))
