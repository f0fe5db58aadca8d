"""The commands that make and end keys: on the database itself, also while services run on it."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from contextlib import contextmanager, suppress
from datetime import UTC, datetime, timedelta
from typing import TYPE_CHECKING, Annotated, Any

import typer

from service.cli.commands.service import settings_of
from service.cli.options import shared as options
from service.cli.options.inputs import age
from service.errors import InputError
from service.rendering.text import print_json, print_table, say

if TYPE_CHECKING:
    from service.auth.callers import KeyLimits, Scope
    from service.db.models import ApiKey
    from service.db.repositories.owned import KeyRepository
    from service.db.tokens import Made

Owner = Annotated[
    str,
    typer.Option("--owner", metavar="NAME", help="Whose all that it makes is.", show_default=False),
]
Scopes = Annotated[
    list[str] | None,
    typer.Option(
        "--scope",
        metavar="S",
        help="read, submit (with read), monitor or admin (everything of everybody); repeatable; submit.",
    ),
]
Expires = Annotated[
    str | None,
    typer.Option("--expires", metavar="WHEN", help="90d, 12h or a date such as 2030-01-31; never."),
]
Limits = Annotated[
    list[str] | None,
    typer.Option(
        "--limit",
        metavar="NAME=N",
        help="requests_per_minute, waiting (jobs at a time), seconds (of a job), "
        "work (points × harmonics × DOFs of a job); repeatable.",
    ),
]
Id = Annotated[str, typer.Argument(metavar="ID", help="Id of a key, as `keys list` shows it.")]


def create(
    owner: Owner,
    scope: Scopes = None,
    expires: Expires = None,
    limit: Limits = None,
    database: options.Database = None,
    as_json: options.Json = False,
) -> None:
    """Make a key and print it, this once."""
    from service.auth import authenticator

    scopes, limits, now = _scopes(scope or ["submit"]), _limits(limit or ()), datetime.now(UTC)
    ends = None if expires is None else _time(expires, now)
    with _repository(database) as repository:
        _show(authenticator.create(repository, owner, scopes, now, ends, limits), as_json=as_json)


def show(database: options.Database = None, as_json: options.Json = False) -> None:
    """List the keys, also those that work no more. What opens the door is not kept, and not shown."""
    from service.auth.authenticator import described

    with _repository(database) as repository:
        found: list[dict[str, Any]] = [described(row) for row in repository.all()]
    if as_json:
        print_json({"items": found})
        return
    columns = ("id", "owner", "scopes", "limits", "created", "expires", "revoked", "last_used")
    print_table("Keys", columns, [[_cell(key[name]) for name in columns] for key in found])


def rotate(key: Id, database: options.Database = None, as_json: options.Json = False) -> None:
    """Give a key another secret and print it, this once; the old one ends within a second."""
    with _repository(database) as repository:
        _show(repository.rotate(key), as_json=as_json)


def revoke(key: Id, database: options.Database = None) -> None:
    """End a key, within a second in every service."""
    with _repository(database) as repository:
        repository.revoke(key)
    say(f"key {key} is revoked")


@contextmanager
def _repository(database: str | None) -> Iterator[KeyRepository]:
    """The keys of a database, which is made if there is none."""
    from service.db import revisions
    from service.db.engine import Database
    from service.db.repositories.owned import KeyRepository

    url = settings_of(database=database).database
    revisions.prepare(url)
    opened = Database(url)
    try:
        yield KeyRepository(opened)
    finally:
        opened.close()


def _show(made: Made[ApiKey], *, as_json: bool) -> None:
    from service.auth.authenticator import described

    if as_json:
        print_json({**described(made.row), "key": made.token})
        return
    say(made.token)
    typer.echo(f"stickslip: key {made.row.id} of {made.row.owner}; it is not shown again", err=True)


def _scopes(names: Sequence[str]) -> list[Scope]:
    from service.auth.callers import Scope

    known = [scope.value for scope in Scope]
    for name in names:
        if name not in known:
            raise InputError(f"`--scope` must be one of {', '.join(known)}, got {name!r}")
    return [Scope(name) for name in names]


def _limits(words: Sequence[str]) -> KeyLimits:
    from service.auth.callers import KeyLimits
    from service.errors import InvalidRequestError
    from service.jobs.strict_json import validated

    given: dict[str, Any] = {}
    for word in words:
        name, _, value = word.partition("=")
        if name not in KeyLimits.model_fields:
            known = ", ".join(KeyLimits.model_fields)
            raise InputError(f"`--limit` must be NAME=N with NAME one of {known}, got {word!r}")
        given[name] = value
    try:
        return validated(KeyLimits, given)
    except InvalidRequestError as error:
        raise InputError(f"`--limit`: {error}") from error


def _time(text: str, now: datetime) -> datetime:
    """A time from now on, or a date."""
    with suppress(typer.BadParameter):
        return now + timedelta(seconds=age(text))
    try:
        date = datetime.fromisoformat(text)
    except ValueError:
        raise InputError(f"`--expires` must be 90d, 12h or a date such as 2030-01-31, got {text!r}") from None
    return date if date.tzinfo is not None else date.replace(tzinfo=UTC)


def _cell(value: object) -> str:
    if isinstance(value, dict):
        return " ".join(f"{name}={number}" for name, number in value.items())
    if isinstance(value, list):
        return " ".join(map(str, value))
    return "" if value is None else str(value)[:19]
