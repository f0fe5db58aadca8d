"""The golden files by name, and what makes each: its parts by their headings."""

from __future__ import annotations

import contextlib
import json
from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Any

from docs_tables import SOURCES, TABLES

from service.jobs.strict_json import digest
from tests.golden.faces import DATA, Studies, asked, helped, paths, sections
from tests.golden.golden_cases import cases
from tests.golden.refused import application, bodies, refusals


def description(folder: Path) -> dict[str, str]:
    """The description of the API: bodies and results of kinds by lines, of all else what tells a change."""
    app = application(folder)
    try:
        found = app.openapi()
    finally:
        app.state.service.database.close()
    posted = found["paths"]["/v1/jobs"]["post"]["requestBody"]["content"]["application/json"]
    bodies_of = {one["properties"]["kind"]["const"]: one for one in posted["schema"].pop("oneOf")}
    schemas = found["components"].pop("schemas")
    shown = {name for name in schemas if name.endswith("Result")}
    parts = {f"body {name}": _lines(body) for name, body in bodies_of.items()}
    parts |= {name: _lines(schemas.pop(name)) for name in sorted(shown)}
    parts["schemas"] = _digests(schemas)
    for kind, named in found.pop("components").items():
        parts[kind] = _digests(named)
    every = found.pop("paths").items()
    asked = {f"{method} {path}": one for path, methods in every for method, one in methods.items()}
    return {**parts, "operations": _digests(asked), "head": _digests(found)}


def _lines(schema: Mapping[str, Any]) -> str:
    """A schema, a line for each key and for each property."""
    told = {key: value for key, value in schema.items() if key != "properties"}
    told |= {f"  {name}": value for name, value in schema.get("properties", {}).items()}
    return "\n".join(f"{key}: {json.dumps(value, ensure_ascii=False)}" for key, value in told.items())


def _digests(named: Mapping[str, Any]) -> str:
    return "\n".join(f"{name}: {digest(value)[:12]}" for name, value in named.items())


def _help(_folder: Path) -> dict[str, str]:
    return {" ".join(("stickslip", *words)): helped(words) for words in paths()}


def _commands(folder: Path) -> dict[str, str]:
    """What commands are refused for, those that the file itself names: status and words."""
    (folder / "file").write_text("in the way")
    found = {}
    with contextlib.chdir(folder):
        for line in sections((DATA / "commands.txt").read_text("utf-8")):
            status, out, said = asked(*line.split()[1:])
            found[line] = f"{status}\n{out}{said}".rstrip().replace(str(Path.cwd()), "FOLDER")
    assert [file.name for file in folder.iterdir()] == ["file"]
    return found


def _tables(_folder: Path) -> dict[str, str]:
    """The tables of docs/, and the sources that are written."""
    found = {f"docs/{page} {name}": made() for page, each in TABLES.items() for name, made in each.items()}
    return {name: text.strip() for name, text in found.items()} | {
        file: source().strip() for file, source in SOURCES.items()
    }


def _studies(folder: Path) -> dict[str, str]:
    run = Studies(folder)
    return {case.name: run.answer(case) for case in cases()}


def _printed(folder: Path) -> dict[str, str]:
    run = Studies(folder)
    return {case.name: run.table(case) for case in cases()}


FILES: Mapping[str, Callable[[Path], dict[str, str]]] = {
    "openapi.txt": description, "help.txt": _help, "docs.txt": _tables, "studies.txt": _studies,
    "printed.txt": _printed, "commands.txt": _commands,
    "refusals.txt": lambda folder: refusals(folder, list(bodies())),
}  # fmt: skip
