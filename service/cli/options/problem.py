"""The options of a design problem, made of its keys.

Each option stands for one key of the description; given beside ``--problem FILE`` it replaces that key of the
file, whole.
"""

from __future__ import annotations

import functools
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from itertools import chain
from typing import Annotated, Any

import typer

from optim.criteria.key import Form, Option
from optim.problem.keys import DesignKeys, FrontKeys, options
from service.cli import completion
from service.cli.options import shared
from service.cli.options.inputs import number, whole_number
from service.cli.options.parameters import Command, keyword, parameters_of, with_parameters

FLAGS = "flags"
KEYS = dict.fromkeys((*DesignKeys.model_fields, *FrontKeys.model_fields))
OPTIONS = {
    "scene": "SCENE", "set": "--set",
    **{name: one.flag for model in (DesignKeys, FrontKeys) for name, one in options(model).items()},
}  # fmt: skip
"""Key to the option that stands for it."""

File = Annotated[
    str | None,
    typer.Option(
        "--problem", metavar="FILE",
        help=f"The problem in a file (.toml, .json), with the keys of the REST body: scene, set, "
        f"{', '.join(KEYS)}. An option beside it replaces the key it stands for.",
    ),
]  # fmt: skip


@dataclass(frozen=True, slots=True, kw_only=True)
class ProblemFlags:
    """What was given on the command line of a design problem, as it was written.

    Attributes
    ----------
    file : str or None
        Of ``--problem``.
    values : list of str or None
        Of ``--set``.
    keys : mapping
        Key to its option and what was given to it.
    """

    file: str | None = None
    values: list[str] | None = None
    keys: Mapping[str, tuple[Option, Any]] = field(default_factory=dict)


_OFFERED: dict[Form, Callable[..., list[str]]] = {
    Form.BOUNDS: completion.paths, Form.NUMBERS_BY_PATH: completion.settings,
    Form.WORDS_BY_PATH: completion.settings, Form.NAMES: completion.contacts,
}  # fmt: skip
_READ: dict[Form, tuple[Any, Callable[[str], Any] | None]] = {
    Form.NUMBER: (float, number), Form.WHOLE_NUMBER: (int, whole_number), Form.WORD: (str, None),
}  # fmt: skip


@functools.cache
def _option(one: Option) -> Any:
    """The option of a key, the same for every command."""
    type_, parser = _READ.get(one.form, (list[str], None))
    offered = completion.words(*one.words) if one.words else _OFFERED.get(one.form)
    told = typer.Option(one.flag, metavar=one.metavar, parser=parser, help=one.help, autocompletion=offered)
    return Annotated[type_ | None, told]


def takes_problem(keys: Mapping[str, Option]) -> Callable[[Command], Command]:
    """Give a command the options of a design problem in place of its `flags`.

    Parameters
    ----------
    keys : key to its option, of those that the problem has.
    """
    given_as: dict[str, Any] = {
        "problem": File, **{name: _option(one) for name, one in keys.items()}, "values": shared.Values,
    }  # fmt: skip
    own = [keyword(name, annotation, None) for name, annotation in given_as.items()]

    def taking(command: Command) -> Command:
        @functools.wraps(command)
        def wrapped(**given: Any) -> None:
            file, values = given.pop("problem"), given.pop("values")
            flags = ProblemFlags(
                file=file, values=values, keys={name: (one, given.pop(name)) for name, one in keys.items()}
            )
            command(**given, **{FLAGS: flags})

        listed = [own if one.name == FLAGS else [one] for one in parameters_of(command)]
        return with_parameters(wrapped, chain.from_iterable(listed))

    return taking
