"""`stickslip new`: a scene file to begin with, of a template or a shipped scene."""

from __future__ import annotations

import re
from collections import Counter
from collections.abc import Mapping
from pathlib import Path
from typing import Annotated, Any

import typer

from service.cli import completion
from service.cli.options.inputs import output_path
from service.errors import InputError
from service.rendering.text import say
from solver.scene.descriptions import WORDS
from solver.scene.json_schema import words_of
from solver.scene.scene_records import LAW_TAG
from solver.scene.toml import load_raw, shipped_scenes, shipped_text, toml_text
from solver.scene.validation import table_of
from solver.wording import nearest
from stickslip.lab.templates.templates import TEMPLATES, template_tables

_WIDEST = 100


def known() -> list[str]:
    """The templates, and the shipped scenes that need no further file."""
    alone = [name for name in shipped_scenes() if load_raw(name)["structure"]["kind"] != "matrices"]  # type: ignore[index]
    return [*TEMPLATES, *alone]


def new(
    file: Annotated[str, typer.Argument(metavar="FILE", help="The scene file to write, .toml.")],
    like: Annotated[
        str,
        typer.Option(
            "--like", metavar="NAME",
            help=f"{', '.join(TEMPLATES)}, or a shipped scene such as two-dof and platform-wedge.",
            autocompletion=completion.words(*TEMPLATES, *shipped_scenes()),
        ),
    ] = "ground-damper",
    force: Annotated[bool, typer.Option("--force", help="Replace a file that is there.")] = False,
) -> None:  # fmt: skip
    """Write a commented scene to begin with: a template, or a copy of a shipped scene."""
    if like not in (names := known()):
        raise InputError(f"`--like` must be one of {', '.join(names)}, got {like!r}{nearest(like, names)}")
    text = file if Path(file).suffix else f"{file}.toml"
    target = output_path("FILE", text, (".toml",))
    if target is None or (target.exists() and not force):
        raise InputError(f"`FILE`: {text!r} exists already; give another name, or --force to replace it")
    name = re.sub(r"[^A-Za-z0-9_-]", "-", target.stem)[:100]
    target.write_text(commented(like, name), encoding="utf-8")
    say(f"{text} is written, like {like}. Next:\n  stickslip sweep {text}\n  stickslip design {text}")


def commented(like: str, name: str) -> str:
    """A scene of a name as a file with comments."""
    if like not in TEMPLATES:
        return re.sub(r"(?m)^name = .*$", f'name = "{name}"', shipped_text(like), count=1)
    tables = template_tables(like, {"name": name})
    head = f'{TEMPLATES[like].TITLE}. Numbers are in SI units, or texts with a unit: "0.2 mm", "35 deg".'
    lines, seen, words = [], Counter[str](), dict[str, str]()
    for line in toml_text(tables, (head,)).splitlines():
        if header := re.fullmatch(r"\[+(\w+)\]+", line):
            row = tables[header[1]]
            row = row[seen[header[1]]] if isinstance(row, list) else row
            seen[header[1]] += 1
            words = WORDS["*"] | words_of(table_of((header[1], *_kind(row), ""))[1])
        said = words.get(line.partition(" = ")[0], "").partition(". ")[0].removesuffix(".")
        if not said or said.startswith("As of"):
            lines.append(line)
        elif len(line) + len(said) < _WIDEST:
            lines.append(f"{line} # {said}")
        else:
            lines += [f"# {said}:", line]
    return "\n".join(lines) + "\n"


def _kind(row: Mapping[str, Any]) -> tuple[str, ...]:
    """What tells the kinds of a table apart."""
    if "law" in row and "shape" not in row:
        return (LAW_TAG + row["law"],)
    return tuple(row[key] for key in ("kind", "shape") if key in row)
