"""The arguments and options that several commands share, in one wording."""

from __future__ import annotations

from typing import Annotated

import typer

from service.cli import completion
from service.cli.options.numeric import amount, count
from solver.scene.descriptions import DISK_LOAD

EFFECTS = ("even-harmonics", "every-contact", "every-port", "every-sector", "whole-matrices")

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
Frequency = Annotated[float, amount("--frequency", "HZ", "Excitation frequency [Hz].")]
FixedFrequency = Annotated[
    float | None,
    amount("--frequency", "HZ", "Excitation frequency [Hz], needed when another parameter is swept."),
]
Harmonics = Annotated[int, count("--harmonics", "H", "Highest harmonic kept.")]
Accuracy = Annotated[
    float | None,
    amount(
        "--accuracy",
        "E",
        "Estimated error relative to the amplitude; chooses the harmonics, in place of --harmonics.",
    ),
]
EverySolution = Annotated[
    bool,
    typer.Option(
        "--all",
        help="Look for all solutions, with their stability: random starts, deflation, branches followed.",
    ),
]
Starts = Annotated[int, count("--starts", "N", "Random starts of --all.")]
Seed = Annotated[int, count("--seed", "N", "Of the random starts of --all.")]
Multipliers = Annotated[
    bool,
    typer.Option(
        "--stability",
        help="Floquet multipliers at every point: period doublings and second frequencies are marked too.",
    ),
]
SwitchedBranches = Annotated[
    bool,
    typer.Option(
        "--branches", help="Follow the branches that leave at branch points, to the ends of the range."
    ),
]
Effects = Annotated[
    str,
    typer.Option(
        "--effects", metavar="auto|all|NAME,…",
        help="What to pay for though the scene does not call for it: even-harmonics, every-contact, "
        "every-port, every-sector, whole-matrices.",
        autocompletion=completion.words("auto", "all", *EFFECTS),
    ),
]  # fmt: skip
Parameter = Annotated[
    str,
    typer.Option(
        "--parameter", metavar="PATH", help=f"What is swept: frequency, {DISK_LOAD}, …",
        autocompletion=completion.parameters,
    ),
]  # fmt: skip
From = Annotated[
    float | None,
    amount("--from", "A", "Start of the range; for the frequency, the scene's band if left out."),
]
To = Annotated[float | None, amount("--to", "B", "End of the range.")]
Limit = Annotated[
    float | None,
    amount("--limit", "A", "Amplitude [m] above which the resonance band is measured; peak/√2 if left out."),
]
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
