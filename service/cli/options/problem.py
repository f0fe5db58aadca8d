"""The options of a design problem, the same for every command that takes one.

Each option stands for one key of the description; given beside ``--problem FILE`` it replaces that key of the
file, whole.
"""

from __future__ import annotations

import functools
import inspect
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field, fields
from typing import Annotated, Any, get_type_hints

import typer

from optim.criteria.key import Form, Key
from optim.criteria.registry import limit_keys, weight_words
from service.cli import completion
from service.cli.options.inputs import number, whole_number

FLAGS = "flags"

File = Annotated[
    str | None,
    typer.Option(
        "--problem", metavar="FILE",
        help="The problem in a file (.toml, .json), with the keys of the REST body: scene, set, variables, "
        f"scaling, cases, limit, weights, {', '.join(key.name for key in limit_keys())}, harmonics, start, "
        "method, basins, uncertain, points. An option beside it replaces the key it stands for.",
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
    typer.Option(
        "--weight", metavar="|".join(f"{word}=W" for word in weight_words()),
        help="What is minimised; the peak alone if left out.",
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
    """What was given on the command line of a design problem, as it was written; `limits` by their keys."""

    problem: File = None
    variables: Variables = None
    scaling: Scaling = None
    limit: Limit = None
    weights: Weights = None
    start: Start = None
    method: Method = None
    basins: Basins = None
    values: Values = None
    harmonics: Harmonics = None
    limits: Mapping[str, Any] = field(default_factory=dict)


Command = Callable[..., None]
NOT_OF_A_FRONT = ("weights", "basins", *(key.name for key in limit_keys(of_fronts=False)))
_LIMITS = "limits"


@functools.cache
def _option(key: Key) -> Any:
    """The option of a key of a criterion, the same for every command."""
    words = key.option_help or key.help
    if key.form is Form.NUMBER:
        return Annotated[float | None, typer.Option(key.flag, metavar=key.metavar, parser=number, help=words)]
    offered = completion.contacts if key.form is Form.NAMES else None
    return Annotated[
        list[str] | None, typer.Option(key.flag, metavar=key.metavar, help=words, autocompletion=offered)
    ]


def takes_problem(command: Command, without: Sequence[str] = ()) -> Command:
    """Give a command the options of a design problem (but those `without`) in place of its `flags`."""
    hints = get_type_hints(ProblemFlags, include_extras=True)
    own = {one.name: hints[one.name] for one in fields(ProblemFlags) if one.name not in (*without, _LIMITS)}
    limits = {key.name: _option(key) for key in limit_keys() if key.name not in without}
    options = [
        inspect.Parameter(name, inspect.Parameter.KEYWORD_ONLY, default=None, annotation=hint)
        for name, hint in {**own, **limits}.items()
    ]

    @functools.wraps(command)
    def wrapped(**given: Any) -> None:
        flags = ProblemFlags(
            **{name: given.pop(name) for name in own}, limits={name: given.pop(name) for name in limits}
        )  # fmt: skip
        command(**given, **{FLAGS: flags})

    parameters: list[inspect.Parameter] = []
    for parameter in inspect.signature(command, eval_str=True).parameters.values():
        keyword = parameter.replace(kind=inspect.Parameter.KEYWORD_ONLY)
        parameters += options if parameter.name == FLAGS else [keyword]
    wrapped.__signature__ = inspect.Signature(parameters)  # type: ignore[attr-defined]
    wrapped.__annotations__ = {parameter.name: parameter.annotation for parameter in parameters}
    return wrapped
