"""The commands that run the service or look after its database: serve, worker, db upgrade, demo."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from service.cli.options import shared as options
from service.cli.options.inputs import count
from service.errors import InputError
from service.rendering.tables.text import say

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
    from service.cli.demo import run

    folder = Path(out)
    if folder.exists() and not folder.is_dir():
        raise InputError(f"`--out` must be a folder, got {out!r}")
    run(folder)


def settings_of(**values: object) -> Settings:
    """Return the settings with the options given, the environment for the others."""
    from service.settings.settings import load_settings

    return load_settings(**{name: value for name, value in values.items() if value is not None})
