"""The commands about projects of a service."""

from __future__ import annotations

from itertools import islice
from typing import TYPE_CHECKING, Annotated

import typer

from service.cli.commands.client.jobs import client_of
from service.cli.commands.client.runs import Binned, Count, Name, Notes, Text, given_of, most_of
from service.cli.options import shared as options
from service.rendering.tables.text import print_json, print_table, say

if TYPE_CHECKING:
    from service.schemas.workbench_answers import ProjectAnswer

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
    most = most_of(limit)
    filters = {"text": text, "deleted": deleted or None, "limit": min(most, 1000)}
    with client_of(url) as client:
        found = list(islice(client.projects(**filters), most))
    if as_json:
        print_json({"items": [one.model_dump(mode="json") for one in found]})
        return
    rows = [(one.id, one.name, str(one.runs), f"{one.changed:%Y-%m-%d %H:%M}") for one in found]
    print_table("Projects", ("id", "name", "runs", "changed [UTC]"), rows, right="2")


def create(
    name: NewName,
    notes: Notes = None,
    as_json: options.Json = False,
    url: options.Url = options.DEFAULT_URL,
) -> None:
    """Make a project and print its id."""
    with client_of(url) as client:
        made = client.make_project(name, notes or "")
    if as_json:
        print_json(made.model_dump(mode="json"))
    else:
        say(made.id)


def change(
    project: Project,
    name: Name = None,
    notes: Notes = None,
    as_json: options.Json = False,
    url: options.Url = options.DEFAULT_URL,
) -> None:
    """Change name or notes of a project."""
    with client_of(url) as client:
        _told(
            client.change_project(project, **given_of(name=name, notes=notes)), "is changed", as_json=as_json
        )


def delete(project: Project, as_json: options.Json = False, url: options.Url = options.DEFAULT_URL) -> None:
    """Put a project in the bin; its runs stay."""
    with client_of(url) as client:
        _told(client.delete_project(project), "is in the bin", as_json=as_json)


def restore(project: Project, as_json: options.Json = False, url: options.Url = options.DEFAULT_URL) -> None:
    """Take a project out of the bin."""
    with client_of(url) as client:
        _told(client.restore_project(project), "is out of the bin", as_json=as_json)


def _told(project: ProjectAnswer, what: str, *, as_json: bool) -> None:
    if as_json:
        print_json(project.model_dump(mode="json"))
    else:
        say(f"project {project.id} {what}")
