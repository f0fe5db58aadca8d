"""The commands about runs and projects of a service: listed, named, put in the bin, compared, shared."""

from __future__ import annotations

from typing import TYPE_CHECKING, Annotated, Any

import typer

from service.cli.commands.client.job_commands import MOST, listed, tell, tell_list, told_here
from service.cli.options import parameters as options
from service.cli.options.inputs import amount, count
from service.errors import InputError
from service.rendering.text import print_json, print_table, say
from solver.scene.parameter_paths import parameter

if TYPE_CHECKING:
    from service.client.client import Client
    from service.schemas.workbench_answers import RunAnswer

OfProject = Annotated[
    str | None, typer.Option("--project", metavar="ID", help="Id of a project, as `projects list` shows it.")
]
Tags = Annotated[list[str] | None, typer.Option("--tag", metavar="WORD", help="Marked with it; repeatable.")]
Text = Annotated[str | None, typer.Option("--text", metavar="TEXT", help="In the name or the notes.")]
States = Annotated[
    list[str] | None,
    typer.Option(
        "--status", metavar="S", help="accepted, running, successful, failed or dismissed; repeatable."
    ),
]
Name = Annotated[str | None, typer.Option("--name", metavar="TEXT", help="Its name.")]
Notes = Annotated[str | None, typer.Option("--notes", metavar="TEXT", help="Its notes.")]
Binned = Annotated[bool, typer.Option("--deleted", help="Those in the bin.")]
Count = Annotated[int | None, count("--count", "N", f"At most so many; {MOST}.")]
First = Annotated[str, typer.Argument(metavar="A", help="Id of a run.")]
Second = Annotated[str, typer.Argument(metavar="B", help="Id of another one.")]
Days = Annotated[float | None, amount("--days", "N", "After which the link ends; never.")]


def given_of(**changes: Any) -> dict[str, Any]:
    """The changes that were given (InputError if none was)."""
    given = {key: value for key, value in changes.items() if value is not None}
    if not given:
        raise InputError(f"give what is to be changed: {', '.join(f'--{key}' for key in changes)}")
    return given


def show(
    client: Client, project: OfProject = None, tag: Tags = None, text: Text = None, status: States = None,
    deleted: Binned = False, limit: Count = None, as_json: options.Json = False,
) -> None:  # fmt: skip
    """List the runs, newest first."""
    filters = {"project": project, "tag": tag, "text": text, "status": status, "deleted": deleted}
    found = listed(client.runs, limit, **filters)
    rows = [
        (one.id, one.kind, one.status.value, one.scene or "", one.name, ", ".join(one.tags), str(one.sweeps))
        for one in found
    ]
    columns = ("id", "kind", "status", "scene", "name", "tags", "sweeps")
    tell_list(found, "Runs", columns, rows, as_json=as_json)


def change(
    client: Client,
    run: options.Job,
    name: Name = None,
    notes: Notes = None,
    project: OfProject = None,
    tag: Annotated[
        list[str] | None,
        typer.Option("--tag", metavar="WORD", help="In place of those it has; repeatable, empty for none."),
    ] = None,
    as_json: options.Json = False,
) -> None:
    """Change project, name, notes or tags of a run."""
    changes = given_of(name=name, notes=notes, project=project, tag=tag or None)
    if "tag" in changes:
        changes["tags"] = [word for word in changes.pop("tag") if word]
    tell(client.change_run(run, **changes), f"run {run} is changed", as_json=as_json)


def delete(client: Client, run: options.Job, as_json: options.Json = False) -> None:
    """Put a run in the bin.

    It has ended. `stickslip runs restore` takes it out until the service deletes it for good.
    """
    tell(client.delete_run(run), f"run {run} is in the bin", as_json=as_json)


def restore(client: Client, run: options.Job, as_json: options.Json = False) -> None:
    """Take a run out of the bin."""
    tell(client.restore_run(run), f"run {run} is out of the bin", as_json=as_json)


def compare(client: Client, a: First, b: Second, as_json: options.Json = False) -> None:
    """Say what differs between two runs.

    Their inputs as they were computed, and what people read of their results.
    """
    found = client.compare(a, b)
    if as_json:
        print_json(found.model_dump(mode="json"))
        return
    heads = (found.a.name or "A", found.b.name or "B")
    inputs = [(one.path, _word(one.path, one.a), _word(one.path, one.b)) for one in found.inputs]
    print_table("Inputs that differ", ("input", *heads), inputs)
    if found.more_inputs:
        say(f"and {found.more_inputs} more")
    a_told, b_told = _told(client, found.a), _told(client, found.b)
    results = [(name, a_told.get(name, ""), b_told.get(name, "")) for name in {**a_told, **b_told}]
    print_table("Results", ("", *heads), results)


def share(client: Client, run: options.Job, days: Days = None, as_json: options.Json = False) -> None:
    """Make a link to a run that needs no key.

    It is printed this once. Whoever has it can read the run and its results.
    """
    made = client.share_run(run, days)
    tell(made, f"{client.base_url.rstrip('/')}{made.link}", as_json=as_json)


def _word(path: str, value: Any) -> str:
    return parameter(path, value) if isinstance(value, float) else "" if value is None else str(value)


def _told(client: Client, run: RunAnswer) -> dict[str, str]:
    if run.status.value != "successful":
        return {}
    blocks = told_here(run.kind, client.results(run.id).result)
    return {name: value for block in blocks for name, value in block.pairs}


Project = Annotated[str, typer.Argument(metavar="PROJECT", help="Id of a project.")]
NewName = Annotated[str, typer.Argument(metavar="NAME", help="Name of the project.")]


def show_projects(
    client: Client, text: Text = None, deleted: Binned = False, limit: Count = None,
    as_json: options.Json = False,
) -> None:  # fmt: skip
    """List the projects, newest first."""
    found = listed(client.projects, limit, text=text, deleted=deleted)
    rows = [(one.id, one.name, str(one.runs), f"{one.changed:%Y-%m-%d %H:%M}") for one in found]
    columns = ("id", "name", "runs", "changed [UTC]")
    tell_list(found, "Projects", columns, rows, as_json=as_json)


def create_project(client: Client, name: NewName, notes: Notes = None, as_json: options.Json = False) -> None:
    """Make a project and print its id."""
    made = client.make_project(name, notes or "")
    tell(made, made.id, as_json=as_json)


def change_project(
    client: Client, project: Project, name: Name = None, notes: Notes = None, as_json: options.Json = False
) -> None:
    """Change name or notes of a project."""
    changes = given_of(name=name, notes=notes)
    tell(client.change_project(project, **changes), f"project {project} is changed", as_json=as_json)


def delete_project(client: Client, project: Project, as_json: options.Json = False) -> None:
    """Put a project in the bin; its runs stay."""
    tell(client.delete_project(project), f"project {project} is in the bin", as_json=as_json)


def restore_project(client: Client, project: Project, as_json: options.Json = False) -> None:
    """Take a project out of the bin."""
    tell(client.restore_project(project), f"project {project} is out of the bin", as_json=as_json)
