"""The commands about projects of a service."""

from __future__ import annotations

from typing import Annotated

import typer

from service.cli.commands.client.jobs import client_of
from service.cli.commands.client.runs import Binned, Count, Name, Notes, Text, given_of
from service.cli.commands.client.told import listed, tell, tell_list
from service.cli.options import shared as options

Project = Annotated[str, typer.Argument(metavar="PROJECT", help="Id of a project.")]
NewName = Annotated[str, typer.Argument(metavar="NAME", help="Name of the project.")]


def show(
    text: Text = None,
    deleted: Binned = False,
    limit: Count = None,
    as_json: options.Json = False,
    url: options.Url = options.DEFAULT_URL,
) -> None:
    """List the projects, newest first."""
    with client_of(url) as client:
        found = listed(client.projects, limit, text=text, deleted=deleted)
    rows = [(one.id, one.name, str(one.runs), f"{one.changed:%Y-%m-%d %H:%M}") for one in found]
    columns = ("id", "name", "runs", "changed [UTC]")
    tell_list(found, "Projects", columns, rows, right="2", as_json=as_json)


def create(
    name: NewName,
    notes: Notes = None,
    as_json: options.Json = False,
    url: options.Url = options.DEFAULT_URL,
) -> None:
    """Make a project and print its id."""
    with client_of(url) as client:
        made = client.make_project(name, notes or "")
    tell(made, made.id, as_json=as_json)


def change(
    project: Project,
    name: Name = None,
    notes: Notes = None,
    as_json: options.Json = False,
    url: options.Url = options.DEFAULT_URL,
) -> None:
    """Change name or notes of a project."""
    changes = given_of(name=name, notes=notes)
    with client_of(url) as client:
        tell(client.change_project(project, **changes), f"project {project} is changed", as_json=as_json)


def delete(project: Project, as_json: options.Json = False, url: options.Url = options.DEFAULT_URL) -> None:
    """Put a project in the bin; its runs stay."""
    with client_of(url) as client:
        tell(client.delete_project(project), f"project {project} is in the bin", as_json=as_json)


def restore(project: Project, as_json: options.Json = False, url: options.Url = options.DEFAULT_URL) -> None:
    """Take a project out of the bin."""
    with client_of(url) as client:
        tell(client.restore_project(project), f"project {project} is out of the bin", as_json=as_json)
