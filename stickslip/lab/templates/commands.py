"""`stickslip new`: a scene file to begin with, of a template or a shipped scene."""

from __future__ import annotations

import re
from pathlib import Path
from typing import Annotated

import typer

from service.cli import completion
from service.cli.options.inputs import output_path
from service.errors import InputError
from service.rendering.text import say
from solver.scene.toml import load_raw, shipped_scenes, shipped_text
from solver.wording import nearest
from stickslip.lab.templates.templates import TEMPLATES, commented, template_tables


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
    if like in TEMPLATES:
        written = commented(like, template_tables(like, {"name": name}))
    else:
        written = re.sub(r"(?m)^name = .*$", f'name = "{name}"', shipped_text(like), count=1)
    target.write_text(written, encoding="utf-8")
    say(f"{text} is written, like {like}. Next:\n  stickslip sweep {text}\n  stickslip design {text}")
