"""Parameters of commands that are not those that are written: made of settings, of keys, of other commands.

The key with which the command talks to a service comes from a file, or from the environment: not from an
option, for every user of a machine sees the options of its processes.
"""

from __future__ import annotations

import functools
import inspect
import os
from collections.abc import Callable, Iterable
from contextvars import ContextVar
from functools import wraps
from pathlib import Path
from typing import Annotated, Any, TypeVar

import typer

from service.errors import InputError

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


KEY_VARIABLE = "STICKSLIP_KEY"

KeyFile = Annotated[
    str | None,
    typer.Option(
        "--key-file",
        metavar="F",
        envvar="STICKSLIP_KEY_FILE",
        help=f"File with the key to the service; else {KEY_VARIABLE} of the environment.",
    ),
]

_file: ContextVar[str | None] = ContextVar("key file", default=None)


def keyed(command: Command) -> Command:
    """The command with the option ``--key-file``; `given_key` reads it."""

    @wraps(command)
    def with_key(*args: object, key_file: str | None = None, **kwargs: object) -> None:
        token = _file.set(key_file)
        try:
            command(*args, **kwargs)
        finally:
            _file.reset(token)

    return with_parameters(with_key, [*parameters_of(command), keyword("key_file", KeyFile, None)])


def given_key() -> str | None:
    """The key of the running command, or None.

    Raises
    ------
    InputError
        If the file cannot be read, or what is there is no key.
    """
    from service.auth.authenticator import id_of

    file = _file.get()
    if file is None:
        where, key = KEY_VARIABLE, os.environ.get(KEY_VARIABLE, "").strip()
    else:
        where = f"`--key-file` {file!r}"
        try:
            key = Path(file).read_text("utf-8").strip()
        except (OSError, UnicodeDecodeError) as error:
            raise InputError(f"{where} cannot be read: {error}") from error
    if file is None and not key:
        return None
    if id_of(key) is None:
        raise InputError(f"{where} holds no key: one looks like stickslip_<id>_<secret>")
    return key
