"""The commands about jobs of a running service: watch, results, designs, reports, submissions."""

from __future__ import annotations

import json
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from itertools import islice
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, TypeVar

import typer

from service.cli.completion import SCENE_FILES
from service.cli.failures import BAD_INPUT, FELL_SHORT
from service.cli.options import inputs
from service.cli.options import parameters as options
from service.cli.options.inputs import amount, count
from service.cli.options.problem_inputs import scene_to_submit, uploaded
from service.cli.progress import bar
from service.errors import InputError
from service.rendering.text import print_json, print_table, print_told, say, told
from solver.results import units
from solver.scene.parameter_paths import parameter
from solver.scene.toml import found_scene

if TYPE_CHECKING:
    from service.client.client import Client
    from service.rendering.report.sections import Designed
    from service.schemas.answers import AnswerModel, JobAnswer, ResultsAnswer
    from solver.results.told import Block


MOST = 50
_T = TypeVar("_T")
_OPTIONS = {"peak_max": "--peak-max", "band_max": "--band-max", "limit": "--count"}

OfScene = Annotated[
    str | None, typer.Option("--scene", metavar="NAME", help="Designs of this scene; for the list.")
]
OfVariable = Annotated[
    str | None, typer.Option("--variable", metavar="PATH", help="Designs that chose it; for the list.")
]
PeakMax = Annotated[float | None, amount("--peak-max", "A", "Highest peak at most [m]; for the list.")]
BandMax = Annotated[float | None, amount("--band-max", "HZ", "Band at most [Hz]; for the list.")]
Reached = Annotated[
    bool | None,
    typer.Option(
        "--reached/--missed", help="Whether the goal was reached; for the list.", show_default=False
    ),
]
Sort = Annotated[
    str | None,
    typer.Option(
        "--sort", metavar="KEY",
        help="created, objective, peak, peak_at, band, work or seconds, largest first with - before it; "
        "-created.",
    ),
]  # fmt: skip
Most = Annotated[int | None, count("--count", "N", f"At most so many; {MOST}.")]


def refuse_filters(filters: Mapping[str, Any]) -> None:
    """Refuse the filters of the list beside a job."""
    for name, value in filters.items():
        if value is not None:
            option = _OPTIONS.get(name, f"--{name}")
            raise InputError(f"`{option}` is for the list of stored designs, leave JOB out; got {value!r}")


def stored_designs(client: Client, filters: Mapping[str, Any]) -> dict[str, Any]:
    """The stored designs that meet the filters of ``GET /v1/designs``."""
    others = {name: value for name, value in filters.items() if name != "limit"}
    found = listed(client.designs, filters["limit"], **others)
    return {"items": [one.model_dump(mode="json") for one in found]}


def show_designs(found: Mapping[str, Any], *, as_json: bool) -> None:
    """Print the list."""
    if as_json:
        print_json(found)
        return
    rows = [
        (
            one["id"],
            one["scene"],
            ", ".join(
                name if of["value"] is None else f"{name} = {parameter(name, of['value'])}"
                for name, of in one["variables"].items()
            ),
            "" if one["peak"] is None else units.length(one["peak"]["value"]),
            "" if one["band_hz"] is None else units.hertz(one["band_hz"]),
            "yes" if one["reached"] else "no",
        )
        for one in found["items"]
    ]
    print_table("Stored designs", ("id", "scene", "design", "peak", "band", "reached"), rows)


def listed(ask: Callable[..., Iterator[_T]], count: int | None, **filters: Any) -> list[_T]:
    """The first of what a list holds, as many as ``--count`` says (InputError if it says less than one)."""
    most = MOST if count is None else count
    if most < 1:
        raise InputError(f"`--count` must be >= 1, got {most!r}")
    return list(islice(ask(**filters, limit=min(most, 1000)), most))


def tell_list(
    found: Sequence[AnswerModel], title: str, columns: Sequence[str], rows: Iterable[Sequence[str]],
    *, as_json: bool,
) -> None:  # fmt: skip
    """Print a list: one JSON object, or a table as of `print_table`."""
    if as_json:
        print_json({"items": [one.model_dump(mode="json") for one in found]})
    else:
        print_table(title, columns, rows)


def tell(answer: AnswerModel, words: str, *, as_json: bool) -> None:
    """Print one JSON object, or `words`."""
    if as_json:
        print_json(answer.model_dump(mode="json"))
    else:
        say(words)


def told_here(kind: str, result: Mapping[str, Any]) -> Sequence[Block]:
    """What people read of a result of a kind that this program knows; of another one its keys."""
    # Loaded here: it brings every kind along.
    from service.settings.kinds import registry_here

    return told(kind, result, registry_here().tell_of(kind))


_INPUT_FAILURES = ("scene", "setting")


def watch(client: Client, job: options.Job, as_json: options.Json = False) -> None:
    """Follow a job until it has ended."""
    ended = _follow(client, job)
    tell(ended, f"{ended.id}  {ended.kind}  {ended.status.value}", as_json=as_json)
    _end(ended)


def results(
    client: Client,
    job: Annotated[
        str | None, typer.Argument(metavar="[JOB]", help="Id of a job; the stored designs if left out.")
    ] = None,
    scene: OfScene = None, variable: OfVariable = None, peak_max: PeakMax = None, band_max: BandMax = None,
    reached: Reached = None, sort: Sort = None, limit: Most = None,
    out: Annotated[
        str | None, typer.Option("--out", metavar="F", help="Also write the JSON object to a file.")
    ] = None,
    plot: options.Plot = None, as_json: options.Json = False,
) -> None:  # fmt: skip
    """Print what a job computed, or list the stored designs."""
    from solver.views.plots import SUFFIXES

    filters = {
        "scene": scene, "variable": variable, "peak_max": peak_max, "band_max": band_max, "reached": reached,
        "sort": sort, "limit": limit,
    }  # fmt: skip
    file = inputs.output_path("--out", out)
    picture = inputs.output_path("--plot", plot, SUFFIXES)
    if job is None:
        if picture is not None:
            raise InputError("`--plot` needs a JOB: a list is not drawn")
        designs = stored_designs(client, filters)
        if file is not None:
            _write(file, designs)
        show_designs(designs, as_json=as_json)
        return
    refuse_filters(filters)
    ended = client.job(job)
    answer = client.results(job)
    if picture is not None:
        _draw(client, ended.kind, answer, picture)
    if file is not None:
        _write(file, answer.model_dump(mode="json"))
    _show(ended, answer, as_json=as_json)
    _end(ended)


def scene_of(name: str) -> Any:
    """The scene for a body: a scene file goes with it, a name is looked up by the service."""
    found = str(found_scene(name))
    return scene_to_submit(found) if found.endswith(SCENE_FILES) else name


def hand_in(client: Client, body: Mapping[str, Any], *, wait: bool, as_json: bool) -> None:
    """Submit a job; print its id, or wait for its end and print what came out, with the id below."""
    job = client.submit(uploaded(client, body))
    if not wait:
        tell(job, job.id, as_json=as_json)
        return
    ended = _follow(client, job.id)
    answer = client.results(job.id)
    _show(ended, answer, as_json=as_json)
    _end(ended)


def _follow(client: Client, job: str) -> JobAnswer:
    with bar(job) as reporter:
        return client.wait(job, reporter, on_best=None if reporter is None else reporter.best)


def _show(job: JobAnswer, answer: ResultsAnswer, *, as_json: bool) -> None:
    if as_json:
        print_json(answer.model_dump(mode="json"))
        return
    print_told(told_here(job.kind, answer.result))
    rows = [
        (one.id, one.parameter, str(one.points), "" if one.peak is None else units.length(one.peak.value))
        for one in answer.sweeps
    ]
    if rows:
        print_table("Stored sweeps", ("id", "parameter", "points", "peak"), rows)
    say(f"job {job.id}")


def _draw(client: Client, kind: str, answer: ResultsAnswer, picture: Path) -> None:
    from service.jobs.drawing import result_figure
    from service.jobs.kind_registry import NothingToDrawError
    from service.settings.kinds import registry_here
    from solver.views.plots.html import save

    try:
        page = result_figure(kind, answer.result, answer.sweeps, client.sweep, registry_here())
    except NothingToDrawError as error:
        raise InputError(f"`--plot`: job {answer.job} has no picture: {error}") from error
    save(page, picture)


def _write(file: Path, answer: Mapping[str, Any]) -> None:
    from solver.results.files import whole

    with whole(file) as temporary:
        temporary.write_text(json.dumps(answer, allow_nan=False) + "\n", "utf-8")


def _end(job: JobAnswer) -> None:
    """Leave with the status that says how a job ended."""
    if job.status.value == "successful":
        return
    error = job.error or {}
    reason = error.get("detail") or f"job {job.id} is {job.status.value}"
    typer.echo(f"stickslip: {reason}", err=True)
    raise typer.Exit(BAD_INPUT if error.get("type") in _INPUT_FAILURES else FELL_SHORT)


SUFFIXES = (".html", ".pdf")


def report(
    client: Client,
    job: options.Job,
    out: Annotated[
        str, typer.Option("--out", metavar="F", help="The report: .html or .pdf.")
    ] = "report.html",
) -> None:
    """Write the report of a design or an identification that the service computed.

    A page that needs nothing else, or a PDF of a few sheets (with the extra `pdf`).
    """
    import solver
    from service.rendering.report.about import about_run
    from service.rendering.report.sections import KINDS, Designed, problem_of_request

    target = inputs.output_path("--out", out, SUFFIXES)
    asked = client.job(job)
    if asked.kind not in KINDS:
        raise InputError(
            f"`JOB` must be a design, pareto or identify job, {job!r} is of the kind {asked.kind!r}, "
            f"which has no report: `stickslip results {job} --plot F` draws it, without --plot prints it"
        )
    answer = client.results(job)
    scene = solver.Scene.from_dict(client.job_scene(job))
    run = client.run(job)
    project = None if run.project is None else client.project(run.project)
    problem = problem_of_request(asked.request or {})
    if target is not None:
        about = about_run(run, project)
        write(Designed(scene=scene, problem=problem, result=answer.result, about=about), target)
        say(f"{target} is written")


def write(given: Designed, target: Path) -> None:
    """Write a report as its suffix says (InputError for a PDF, where what writes it is not installed)."""
    from service.rendering.report.making import report_of
    from solver.results.files import whole

    made = report_of(given, target.suffix.lower().removeprefix("."))
    with whole(target) as temporary:
        temporary.write_bytes(made)
