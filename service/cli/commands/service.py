"""The commands that run the service or look after its database and keys: serve, worker, db, keys."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from contextlib import contextmanager, suppress
from dataclasses import asdict
from datetime import UTC, datetime, timedelta
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from service.cli.failures import FELL_SHORT
from service.cli.options import parameters as options
from service.cli.options.inputs import age, count
from service.errors import InputError
from service.rendering.text import print_json, print_pairs, print_table, say
from service.workers import processes

if TYPE_CHECKING:
    from service.auth.callers import KeyLimits, Scope
    from service.db.models import ApiKey
    from service.db.repositories.owned import KeyRepository, Made
    from service.settings.settings import Settings


def serve(
    host: Annotated[str | None, typer.Option("--host", metavar="H", help="Address to listen on.")] = None,
    port: Annotated[int | None, count("--port", "P", "Port to listen on.")] = None,
    database: options.Database = None,
    workers: options.Workers = None,
) -> None:
    """Serve the page and the REST API, and work off its queue."""
    processes.begin()
    from service.http.server import serve as run

    run(settings_of(host=host, port=port, database=database, workers=workers))


def worker(
    database: options.Database = None,
    workers: options.Workers = None,
    until_empty: Annotated[
        bool, typer.Option("--until-empty", help="End when no job waits or runs.")
    ] = False,
) -> None:
    """Work off a queue without HTTP.

    On PostgreSQL beside any number of services; on SQLite only while no service uses the file.
    """
    processes.begin()
    from service.http.server import work

    work(settings_of(database=database, workers=workers), until_empty=until_empty)


def upgrade(database: options.Database = None) -> None:
    """Bring a database to this version's revision."""
    from service.db.engine import shown
    from service.db.revisions import upgrade as bring_up

    url = settings_of(database=database).database
    say(f"{shown(url)} is at revision {bring_up(url)}")


def settings_of(**values: object) -> Settings:
    """Return the settings with the options given, the environment for the others."""
    from service.settings.settings import load_settings

    return load_settings(**{name: value for name, value in values.items() if value is not None})


def backup(
    target: Annotated[str, typer.Argument(metavar="FILE", help="The copy; it must not exist.")],
    database: options.Database = None,
) -> None:
    """Copy a database to a file, also while a service uses it."""
    from service.db.engine import backup as copy
    from service.db.engine import shown

    url = settings_of(database=database).database
    copy(url, Path(target))
    say(f"{shown(url)} is copied to {target}")


def prune(
    older_than: Annotated[
        float,
        typer.Option("--older-than", metavar="AGE", parser=age, help="How long ago they ended: 30d, 12h."),
    ],
    keep_designs: Annotated[
        bool, typer.Option("--keep-designs", help="Of designs delete the sweeps alone.")
    ] = False,
    uploads: Annotated[
        bool, typer.Option("--uploads", help="Delete uploads as old too, unless a job uses them.")
    ] = False,
    dry_run: Annotated[bool, typer.Option("--dry-run", help="Count, and delete nothing.")] = False,
    vacuum: Annotated[
        bool, typer.Option("--vacuum", help="Give the space back to the file system (SQLite).")
    ] = False,
    database: options.Database = None,
    as_json: options.Json = False,
) -> None:
    """Delete old jobs with their results and sweeps, and old uploads.

    An SQLite file must not be in use by a service, which can do this itself (STICKSLIP_RETENTION_DAYS,
    STICKSLIP_RETENTION_UPLOAD_DAYS).
    """
    from service.queue.retention import prune_database

    settings = settings_of(database=database)
    found = prune_database(
        settings.database, older_than, keep_designs=keep_designs, uploads=uploads, dry_run=dry_run,
        vacuum=vacuum, arrays=settings.arrays,
    )  # fmt: skip
    if as_json:
        print_json({**asdict(found), "deleted": not dry_run})
    else:
        words = "would be deleted" if dry_run else "are deleted"
        projects = f", {found.projects} projects" if found.projects else ""
        say(f"{found.jobs} jobs, {found.sweeps} sweeps{projects} and {found.uploads} uploads {words}")


def check(database: options.Database = None, as_json: options.Json = False) -> None:
    """Read a database from end to end and say what is wrong with it.

    The file and its references, the states of jobs against their results, the checksums of arrays and
    results.
    Exit status 1 if anything is wrong, 2 if there is no such database.
    """
    from service.db.engine import shown
    from service.db.repositories.integrity import check as look

    settings = settings_of(database=database)
    url = settings.database
    found = look(url, settings.arrays)
    if as_json:
        print_json(found.to_json())
    else:
        jobs = ", ".join(f"{count} {state}" for state, count in found.contents.jobs.items()) or "none"
        pairs = [
            ("revision", found.revision),
            ("jobs", jobs),
            ("sweeps", str(found.contents.sweeps)),
            ("arrays", str(found.contents.arrays)),
            ("sound", "yes" if found.sound else "no"),
        ]
        print_pairs(shown(url), [*pairs, *(("trouble", words) for words in found.trouble)])
    if not found.sound:
        typer.echo(
            "stickslip: the database is damaged: restore a backup, or export what can be read", err=True
        )
        raise typer.Exit(FELL_SHORT)


Owner = Annotated[
    str, typer.Option("--owner", metavar="NAME", help="Whose all that it makes is.", show_default=False)
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
