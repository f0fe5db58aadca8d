"""The arguments and options that several commands share, in one wording."""

from __future__ import annotations

from typing import Annotated

import typer

from service.cli import completion
from service.cli.options.inputs import count
from solver.scene.descriptions import DISK_LOAD

Scene = Annotated[
    str,
    typer.Argument(
        metavar="SCENE", help="Name of a shipped scene, or a scene file (.toml, .json).",
        autocompletion=completion.scenes,
    ),
]  # fmt: skip
AnyScene = Annotated[
    str | None,
    typer.Argument(
        metavar="SCENE", help="Name of a shipped scene, or a scene file; the one of the --problem file.",
        autocompletion=completion.scenes,
    ),
]  # fmt: skip
Values = Annotated[
    list[str] | None,
    typer.Option(
        "--set", metavar="PATH=VALUE", help=f"Value of a parameter, for example {DISK_LOAD}=150; repeatable.",
        autocompletion=completion.settings,
    ),
]  # fmt: skip
Harmonics = Annotated[int, count("--harmonics", "H", "Highest harmonic kept.")]
Json = Annotated[bool, typer.Option("--json", help="Print one JSON object.")]
Plot = Annotated[
    str | None,
    typer.Option("--plot", metavar="F", help="Draw a picture: .png, .svg, .pdf or .html."),
]
Out = Annotated[
    str | None,
    typer.Option(
        "--out", metavar="F",
        help="Write the numbers: F ends in .csv, .parquet, .nc, .npz, .mat or .json.",
    ),
]  # fmt: skip
Database = Annotated[
    str | None,
    typer.Option(
        "--database",
        metavar="URL",
        help="sqlite:///path or postgresql://user@host/name; STICKSLIP_DATABASE sets it too.",
    ),
]
Workers = Annotated[
    int | None,
    count("--workers", "N", "Worker processes; one a processor."),
]
Url = Annotated[
    str,
    typer.Option("--url", metavar="URL", envvar="STICKSLIP_URL", help="Where the service is."),
]
Wait = Annotated[bool, typer.Option("--wait", help="Wait for the end and print the results.")]
Job = Annotated[str, typer.Argument(metavar="JOB", help="Id of a job.")]

DEFAULT_URL = "http://127.0.0.1:8000"
