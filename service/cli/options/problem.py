"""The options of a design problem, the same for every command that takes one.

Each option stands for one key of the description; given beside ``--problem FILE`` it replaces that key of the
file, whole.
"""

from __future__ import annotations

import functools
import inspect
from collections.abc import Callable, Sequence
from dataclasses import dataclass, fields
from typing import Annotated, Any, get_type_hints

import typer

from service.cli import completion
from service.cli.options.inputs import number, whole_number

FLAGS = "flags"

File = Annotated[
    str | None,
    typer.Option(
        "--problem", metavar="FILE",
        help="The problem in a file (.toml, .json), with the keys of the REST body: scene, set, variables, "
        "scaling, cases, limit, weights, max_peak, max_band_hz, forbidden_hz, speeds_rpm, max_friction_work, "
        "contact_states, harmonics, start, method, basins, uncertain, points. An option beside it replaces "
        "the key it stands for.",
    ),
]  # fmt: skip
Variables = Annotated[
    list[str] | None,
    typer.Option(
        "--variable", metavar="PATH LO HI",
        help="A parameter and its bounds, for example shroud.N0 20 3000; paths that share a value are "
        "separated by commas; repeatable. If left out, the normal load of the contact whose load varies.",
        autocompletion=completion.paths,
    ),
]  # fmt: skip
Scaling = Annotated[
    list[str] | None,
    typer.Option(
        "--scaling", metavar="PATH=HOW", help="Scale a variable linear or logarithmic; by its bounds.",
        autocompletion=completion.settings,
    ),
]  # fmt: skip
Limit = Annotated[
    float | None,
    typer.Option(
        "--limit", metavar="A", parser=number,
        help="Amplitude [m] above which the resonance band is measured; peak/√2 if left out.",
    ),
]  # fmt: skip
Weights = Annotated[
    list[str] | None,
    typer.Option("--weight", metavar="peak=W|band=W", help="What is minimised; the peak alone if left out."),
]
MaxPeak = Annotated[
    float | None,
    typer.Option("--max-peak", metavar="A", parser=number, help="Largest amplitude allowed [m]."),
]
MaxBand = Annotated[
    float | None,
    typer.Option("--max-band", metavar="HZ", parser=number, help="Widest resonance band allowed [Hz]."),
]
Forbidden = Annotated[
    list[str] | None,
    typer.Option(
        "--forbidden", metavar="LO HI",
        help="Frequencies [Hz] at which the amplitude stays below --limit; repeatable.",
    ),
]  # fmt: skip
Speeds = Annotated[
    list[str] | None,
    typer.Option(
        "--speeds", metavar="LO HI",
        help="Running speeds [1/min]: forbidden frequencies by the engine order; repeatable.",
    ),
]  # fmt: skip
MaxWork = Annotated[
    list[str] | None,
    typer.Option(
        "--max-work",
        metavar="J|CONTACT=J",
        help="Largest friction work in a cycle [J]; repeatable by contact.",
    ),
]
NeverSeparates = Annotated[
    list[str] | None,
    typer.Option(
        "--never-separates", metavar="CONTACT", help="A contact that must stay closed; repeatable.",
        autocompletion=completion.contacts,
    ),
]  # fmt: skip
Method = Annotated[
    str | None,
    typer.Option(
        "--method", metavar="M", help="auto, tracked, minimax or ipopt; auto.",
        autocompletion=completion.words("auto", "tracked", "minimax", "ipopt"),
    ),
]  # fmt: skip
Basins = Annotated[
    int | None,
    typer.Option("--basins", metavar="N", parser=whole_number, help="Local optima looked for; 2."),
]
Start = Annotated[
    list[str] | None,
    typer.Option(
        "--start", metavar="PATH=VALUE", help="A design to start from; repeatable.",
        autocompletion=completion.settings,
    ),
]  # fmt: skip
Values = Annotated[
    list[str] | None,
    typer.Option(
        "--set", metavar="PATH=VALUE", help="Value of a parameter, for example shroud.N0=150; repeatable.",
        autocompletion=completion.settings,
    ),
]  # fmt: skip
Harmonics = Annotated[
    int | None,
    typer.Option("--harmonics", metavar="H", parser=whole_number, help="Highest harmonic kept; 11."),
]


@dataclass(frozen=True, slots=True, kw_only=True)
class ProblemFlags:
    """What was given on the command line of a design problem, as it was written."""

    problem: File = None
    variables: Variables = None
    scaling: Scaling = None
    limit: Limit = None
    weights: Weights = None
    max_peak: MaxPeak = None
    max_band: MaxBand = None
    forbidden: Forbidden = None
    speeds: Speeds = None
    max_work: MaxWork = None
    never_separates: NeverSeparates = None
    start: Start = None
    method: Method = None
    basins: Basins = None
    values: Values = None
    harmonics: Harmonics = None


Command = Callable[..., None]
NOT_OF_A_FRONT = ("weights", "max_band", "basins")


def takes_problem(command: Command, without: Sequence[str] = ()) -> Command:
    """Give a command the options of a design problem (but those `without`) in place of its `flags`."""
    hints = get_type_hints(ProblemFlags, include_extras=True)
    options = [
        inspect.Parameter(
            field.name, inspect.Parameter.KEYWORD_ONLY, default=None, annotation=hints[field.name]
        )
        for field in fields(ProblemFlags)
        if field.name not in without
    ]

    @functools.wraps(command)
    def wrapped(**given: Any) -> None:
        flags = ProblemFlags(**{option.name: given.pop(option.name) for option in options})
        command(**given, **{FLAGS: flags})

    parameters: list[inspect.Parameter] = []
    for parameter in inspect.signature(command, eval_str=True).parameters.values():
        keyword = parameter.replace(kind=inspect.Parameter.KEYWORD_ONLY)
        parameters += options if parameter.name == FLAGS else [keyword]
    wrapped.__signature__ = inspect.Signature(parameters)  # type: ignore[attr-defined]
    wrapped.__annotations__ = {parameter.name: parameter.annotation for parameter in parameters}
    return wrapped
