"""What is said of a run: in the head of its report, and on the page of a link to it."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from datetime import datetime
from html import escape
from typing import TYPE_CHECKING, Any, TypedDict
from urllib.parse import quote, urlencode

from solver.views.plots.html import pairs

if TYPE_CHECKING:
    from service.schemas.answers import SweepAnswer
    from service.schemas.workbench_answers import ProjectAnswer, RunAnswer, SharedRun


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


POLICY = (
    "default-src 'none'; style-src 'unsafe-inline'; base-uri 'none'; form-action 'none'; "
    "frame-ancestors 'none'"
)
"""What such a page may load: nothing but the style it has."""
_DEEPEST = 3  # of objects inside objects: what is deeper is in the file


def shared_page(
    run: SharedRun, result: Mapping[str, Any] | None, sweeps: Sequence[SweepAnswer], token: str
) -> str:
    """A page without buttons of a run.

    Parameters
    ----------
    run : what was asked and how it ended.
    result : what it computed, as JSON; None while it has not.
    sweeps : those stored with it.
    token : of the link, which the files of the page are asked for with.
    """
    from solver.views.plots.html import page, pairs, table

    title = run.name or f"{run.kind} of {run.scene or 'a scene of its own'}"
    ended = "" if run.finished is None else f"{run.finished:%Y-%m-%d %H:%M %Z}"
    error = (run.error or {}).get("detail", "")
    about = [
        ("study", run.kind),
        ("scene", run.scene or ""),
        ("state", run.status),
        ("reason", error),
        ("ended", ended),
        ("tags", ", ".join(run.tags)),
        ("notes", run.notes),
    ]
    parts = [f"<h1>{escape(title)}</h1>", pairs([(name, words) for name, words in about if words])]
    if result is not None:
        parts += ["<h2>What came out</h2>", pairs(list(_told(result)))]
    parts += ["<h2>What was asked</h2>", pairs(list(_told(run.request or {})))]
    if sweeps:
        rows = [[one.parameter, one.points, one.peak and one.peak.value] for one in sweeps]
        parts += ["<h2>Stored sweeps</h2>", table(["over", "points", "peak [m]"], rows)]
    parts += [f"<h2>Files</h2><ul>{''.join(_files(run, result, sweeps, token))}</ul>"]
    return page(title, "\n".join(parts))


def _told(given: Mapping[str, Any], before: str = "", depth: int = 1) -> Iterator[tuple[str, str]]:
    """Names and values of what is one number or word; of lists how long they are."""
    for name, value in given.items():
        path = f"{before}{name}"
        if isinstance(value, Mapping):
            if depth < _DEEPEST:
                yield from _told(value, f"{path}.", depth + 1)
        elif isinstance(value, list):
            short = all(not isinstance(one, list | dict) for one in value) and len(value) <= 8
            yield path, ", ".join(map(_word, value)) if short else f"{len(value)} entries"
        elif value is not None:
            yield path, _word(value)


def _word(value: Any) -> str:
    if isinstance(value, bool):
        return "yes" if value else "no"
    return f"{value:.6g}" if isinstance(value, float) else str(value)


def _files(
    run: SharedRun, result: Mapping[str, Any] | None, sweeps: Sequence[SweepAnswer], token: str
) -> Iterator[str]:
    """Links to what there is of it: kinds of one's own need no scene."""
    if "scene" in (run.request or {}):
        yield _link("/v1/shared/scene", "Scene, JSON", token=token)
    if result is not None:
        yield _link("/v1/shared/results", "Result, JSON", token=token)
    for number, sweep in enumerate(sweeps, start=1):
        address = f"/v1/shared/sweeps/{quote(sweep.id)}"
        yield _link(address, f"Sweep {number}, CSV", token=token, format="csv")


def _link(address: str, words: str, **query: str) -> str:
    return f'<li><a href="{escape(f"{address}?{urlencode(query)}")}">{escape(words)}</a></li>'
