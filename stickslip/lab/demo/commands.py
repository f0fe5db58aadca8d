"""`stickslip demo`."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from service.errors import InputError


def demo(
    out: Annotated[
        str, typer.Option("--out", metavar="DIR", help="Folder of the database and the pictures.")
    ] = "demo-output",
) -> None:
    """Run the main job end to end, with pictures.

    Designs the dampers of two-dof and bladed-disk on an embedded service and its database.
    """
    from stickslip.lab.demo.demo_cases import first_told

    folder = Path(out)
    if folder.exists() and not folder.is_dir():
        raise InputError(f"`--out` must be a folder, got {out!r}")
    told = first_told()
    # Database, client and drawing are loaded after the first optimum, which needs none of them.
    from stickslip.lab.demo.demonstration import run

    run(folder, told=told)
