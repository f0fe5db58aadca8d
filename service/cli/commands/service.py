"""The commands that run the service or look after its database: serve, worker, db, demo."""

from __future__ import annotations

from dataclasses import asdict
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from service.cli.failures import FELL_SHORT
from service.cli.options import shared as options
from service.cli.options.inputs import age, count
from service.errors import InputError
from service.rendering.text import print_json, print_pairs, say

if TYPE_CHECKING:
    from service.settings.settings import Settings


def serve(
    host: Annotated[str | None, typer.Option("--host", metavar="H", help="Address to listen on.")] = None,
    port: Annotated[int | None, count("--port", "P", "Port to listen on.")] = None,
    database: options.Database = None,
    workers: options.Workers = None,
) -> None:
    """Serve the REST API and work off its queue."""
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
    from service.http.server import work

    work(settings_of(database=database, workers=workers), until_empty=until_empty)


def upgrade(database: options.Database = None) -> None:
    """Bring a database to this version's revision."""
    from service.db.engine import shown
    from service.db.revisions import upgrade as bring_up

    url = settings_of(database=database).database
    say(f"{shown(url)} is at revision {bring_up(url)}")


def demo(
    out: Annotated[
        str, typer.Option("--out", metavar="DIR", help="Folder of the database and the pictures.")
    ] = "demo-output",
) -> None:
    """Run the main job end to end, with pictures.

    Designs the dampers of two-dof and bladed-disk on an embedded service and its database.
    """
    from service.cli.demo_cases import first_told

    folder = Path(out)
    if folder.exists() and not folder.is_dir():
        raise InputError(f"`--out` must be a folder, got {out!r}")
    told = first_told()
    # Database, client and drawing are loaded after the first optimum, which needs none of them.
    from service.cli.demo import run

    run(folder, told=told)


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
