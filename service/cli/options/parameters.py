"""Parameters of commands: those that several share, and those made of settings, of keys, of other commands.

The key with which the command talks to a service comes from a file, or from the environment: not from an
option, for every user of a machine sees the options of its processes.
"""

from __future__ import annotations

import functools
import inspect
import os
from collections.abc import Callable, Iterable
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, TypeVar

import typer

from service.cli import completion
from service.cli.options.inputs import count
from service.errors import InputError
from solver.scene.descriptions import DISK_LOAD

if TYPE_CHECKING:
    from service.client.client import Client


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
Without = Annotated[
    list[str] | None,
    typer.Option(
        "--without", metavar="CONTACT",
        help="Leave a contact out, the free limit: its name, a group, a damper or a pattern; repeatable.",
        autocompletion=completion.contacts,
    ),
]  # fmt: skip
Harmonics = Annotated[int, count("--harmonics", "H", "Highest harmonic kept.")]
Json = Annotated[bool, typer.Option("--json", help="Print one JSON object.")]
Plot = Annotated[
    str | None, typer.Option("--plot", metavar="F", help="Draw a picture: .png, .svg, .pdf or .html.")
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
        "--database", metavar="URL",
        help="sqlite:///path or postgresql://user@host/name; STICKSLIP_DATABASE sets it too.",
    ),
]  # fmt: skip
Workers = Annotated[int | None, count("--workers", "N", "Worker processes; one a processor.")]
Url = Annotated[
    str, typer.Option("--url", metavar="URL", envvar="STICKSLIP_URL", help="Where the service is.")
]
Wait = Annotated[bool, typer.Option("--wait", help="Wait for the end and print the results.")]
Job = Annotated[str, typer.Argument(metavar="JOB", help="Id of a job.")]

DEFAULT_URL = "http://127.0.0.1:8000"


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
        "--key-file", metavar="F", envvar="STICKSLIP_KEY_FILE",
        help=f"File with the key to the service; else {KEY_VARIABLE} of the environment.",
    ),
]  # fmt: skip


def keyed(command: Command) -> Command:
    """The command with the options ``--url`` and ``--key-file``; a client of that service is its `client`."""

    @functools.wraps(command)
    def with_client(*, url: str, key_file: str | None, **given: Any) -> None:
        with client_of(url, key_file) as client:
            command(client=client, **given)

    own = inspect.signature(command, eval_str=True, locals={"Client": None}).parameters.values()
    listed = [one for one in own if one.name != "client"]
    where = [keyword("url", Url, DEFAULT_URL), keyword("key_file", KeyFile, None)]
    return with_parameters(with_client, [*listed, *where])


def client_of(url: str, key_file: str | None) -> Client:
    """A client of the service at an address.

    InputError if the address is none, the file cannot be read, or what is there is no key.
    """
    import httpx

    from service.client.client import Client

    try:
        return Client(url, key=_key(key_file))
    except httpx.InvalidURL as error:
        raise InputError(f"`--url` must be a web address such as {DEFAULT_URL}, got {url!r}") from error


def _key(file: str | None) -> str | None:
    from service.auth.authenticator import id_of

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
