"""What is said of a run: in the head of its report, and on the page of a link to it."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from datetime import datetime
from html import escape
from typing import TYPE_CHECKING, Any, TypedDict
from urllib.parse import quote, urlencode

from solver.results.units import length
from solver.views.plots.html import pairs

if TYPE_CHECKING:
    from service.schemas.answers import SweepAnswer
    from service.schemas.workbench_answers import ProjectAnswer, RunAnswer, SharedRun
    from solver.results.told import Block


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
        ("project", about.get("project", "")), ("run", about.get("name", "")),
        ("author", about.get("author") or "not named"), ("tags", ", ".join(about.get("tags", ()))),
        ("computed", "" if computed is None else _when(datetime.fromisoformat(computed))),
        ("report made", _when(now)), ("notes of the project", about.get("project_notes", "")),
        ("notes", about.get("notes", "")),
    ]  # fmt: skip
    return pairs([(name, words) for name, words in rows if words])


def _when(moment: datetime) -> str:
    return f"{moment.astimezone():%Y-%m-%d %H:%M %Z}".rstrip()


POLICY = (
    "default-src 'none'; style-src 'unsafe-inline'; base-uri 'none'; form-action 'none'; "
    "frame-ancestors 'none'"
)
"""What such a page may load: nothing but the style it has."""


def shared_page(run: SharedRun, found: Sequence[Block], sweeps: Sequence[SweepAnswer], token: str) -> str:
    """A page without buttons of a run.

    Parameters
    ----------
    run : what was asked and how it ended.
    found : what is told of its result; nothing while it has none.
    sweeps : those stored with it.
    token : of the link, which the files of the page are asked for with.
    """
    from service.rendering.text import by_keys
    from solver.views.plots.html import block_html, page, pairs, table

    title = run.name or f"{run.kind} of {run.scene or 'a scene of its own'}"
    ended = "" if run.finished is None else f"{run.finished:%Y-%m-%d %H:%M %Z}"
    error = (run.error or {}).get("detail", "")
    about = [
        ("study", run.kind), ("scene", run.scene or ""), ("state", run.status), ("reason", error),
        ("ended", ended), ("tags", ", ".join(run.tags)), ("notes", run.notes),
    ]  # fmt: skip
    parts = [f"<h1>{escape(title)}</h1>", pairs([(name, words) for name, words in about if words])]
    parts += ["<h2>What came out</h2>"] if found else []
    for block in found:
        parts += [f"<h3>{escape(block.title)}</h3>"] if block.title else []
        parts.append(block_html(block))
    parts += ["<h2>What was asked</h2>", pairs(by_keys(run.request or {}))]
    if sweeps:
        rows = [[one.parameter, one.points, one.peak and length(one.peak.value)] for one in sweeps]
        parts += ["<h2>Stored sweeps</h2>", table(["over", "points", "peak"], rows)]
    parts += [f"<h2>Files</h2><ul>{''.join(_files(run, bool(found), sweeps, token))}</ul>"]
    return page(title, "\n".join(parts))


def _files(run: SharedRun, ended: bool, sweeps: Sequence[SweepAnswer], token: str) -> Iterator[str]:
    """Links to what there is of it: kinds of one's own need no scene."""
    if "scene" in (run.request or {}):
        yield _link("/v1/shared/scene", "Scene, JSON", token=token)
    if ended:
        yield _link("/v1/shared/results", "Result, JSON", token=token)
    for number, sweep in enumerate(sweeps, start=1):
        address = f"/v1/shared/sweeps/{quote(sweep.id)}"
        yield _link(address, f"Sweep {number}, CSV", token=token, format="csv")


def _link(address: str, words: str, **query: str) -> str:
    return f'<li><a href="{escape(f"{address}?{urlencode(query)}")}">{escape(words)}</a></li>'
