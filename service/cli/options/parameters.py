"""Commands whose parameters are not those that are written: made of settings, of keys, of other commands."""

from __future__ import annotations

import functools
import inspect
from collections.abc import Callable, Iterable
from typing import Any, TypeVar

_Settings = TypeVar("_Settings")
Command = Callable[..., None]


def keyword(name: str, annotation: Any, default: Any = inspect.Parameter.empty) -> inspect.Parameter:
    """Return a parameter of a command."""
    return inspect.Parameter(name, inspect.Parameter.KEYWORD_ONLY, default=default, annotation=annotation)


def with_parameters(command: Command, parameters: Iterable[inspect.Parameter]) -> Command:
    """Return the command, which is to be looked at as one with these parameters."""
    listed = [one.replace(kind=inspect.Parameter.KEYWORD_ONLY) for one in parameters]
    command.__signature__ = inspect.Signature(listed)  # type: ignore[attr-defined]
    command.__annotations__ = {one.name: one.annotation for one in listed}
    return command


def parameters_of(command: Callable[..., Any]) -> list[inspect.Parameter]:
    """Return the parameters of a command, or of a class of settings."""
    return list(inspect.signature(command, eval_str=True).parameters.values())


def taking(settings: type[_Settings]) -> Callable[[Callable[[_Settings], None]], Command]:
    """Give a command an option for each field of a class of settings, in place of its one argument."""

    def made(command: Callable[[_Settings], None]) -> Command:
        @functools.wraps(command)
        def with_options(**given: Any) -> None:
            command(settings(**given))

        return with_parameters(with_options, parameters_of(settings))

    return made
