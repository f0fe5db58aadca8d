"""The key with which the command talks to a service: from a file, or from the environment.

Not from an option: every user of a machine sees the options of its processes.
"""

from __future__ import annotations

import os
from contextvars import ContextVar
from functools import wraps
from pathlib import Path
from typing import Annotated

import typer

from service.cli.options.parameters import Command, keyword, parameters_of, with_parameters
from service.errors import InputError

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
