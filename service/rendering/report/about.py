"""What a report says of itself: whose it is, of which project and run, when it was computed and made."""

from __future__ import annotations

from collections.abc import Mapping
from datetime import datetime
from typing import TYPE_CHECKING, Any, TypedDict

from solver.views.plots.html import pairs

if TYPE_CHECKING:
    from service.schemas.workbench_answers import ProjectAnswer, RunAnswer


class About(TypedDict, total=False):
    """What is known of a run; what is left out is not known.

    Attributes
    ----------
    author : whose run it is; empty at a service without keys.
    project, project_notes : the project it belongs to.
    name, notes, tags : what was said of the run.
    computed : when it ended, as ISO 8601.
    """

    author: str
    project: str
    project_notes: str
    name: str
    notes: str
    tags: list[str]
    computed: str


def about_run(run: RunAnswer, project: ProjectAnswer | None) -> About:
    """What a service says of a run and of its project."""
    ended = run.finished or run.created
    found = About(
        author=run.owner or "", name=run.name, notes=run.notes, tags=run.tags, computed=ended.isoformat()
    )
    if project is not None:
        found["project"], found["project_notes"] = project.name, project.notes
    return found


def about_section(about: Mapping[str, Any], now: datetime) -> str:
    """Project, run, author and dates; the author is named also where nobody said who it is.

    Parameters
    ----------
    about : as `About`.
    now : when the report is made.
    """
    computed = about.get("computed")
    rows = [
        ("project", about.get("project", "")),
        ("run", about.get("name", "")),
        ("author", about.get("author") or "not named"),
        ("tags", ", ".join(about.get("tags", ()))),
        ("computed", "" if computed is None else _when(datetime.fromisoformat(computed))),
        ("report made", _when(now)),
        ("notes of the project", about.get("project_notes", "")),
        ("notes", about.get("notes", "")),
    ]
    return pairs([(name, words) for name, words in rows if words])


def _when(moment: datetime) -> str:
    return f"{moment.astimezone():%Y-%m-%d %H:%M %Z}".rstrip()
