"""The commands that talk to a running service: watch, results, and what every submission does."""

from __future__ import annotations

import json
from collections.abc import Mapping
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from service.cli.commands.client import stored_designs
from service.cli.failures import BAD_INPUT, FELL_SHORT
from service.cli.options import inputs, problem_inputs
from service.cli.options import shared as options
from service.cli.options.parameters import given_key
from service.cli.options.scene_files import scene_to_submit, uploaded
from service.cli.progress import bar
from service.errors import InputError
from service.rendering.plain import print_result
from service.rendering.tables.text import print_json, print_table, say

if TYPE_CHECKING:
    from service.client.client import Client
    from service.schemas.answers import JobAnswer, ResultsAnswer

_INPUT_FAILURES = ("scene", "setting")


def watch(job: options.Job, as_json: options.Json = False, url: options.Url = options.DEFAULT_URL) -> None:
    """Follow a job until it has ended."""
    with client_of(url) as client:
        ended = _follow(client, job)
    if as_json:
        print_json(ended.model_dump(mode="json"))
    else:
        say(f"{ended.id}  {ended.kind}  {ended.status.value}")
    _end(ended)


def results(
    job: Annotated[
        str | None, typer.Argument(metavar="[JOB]", help="Id of a job; the stored designs if left out.")
    ] = None,
    scene: stored_designs.OfScene = None,
    variable: stored_designs.OfVariable = None,
    peak_max: stored_designs.PeakMax = None,
    band_max: stored_designs.BandMax = None,
    reached: stored_designs.Reached = None,
    sort: stored_designs.Sort = None,
    limit: stored_designs.Count = None,
    out: Annotated[
        str | None, typer.Option("--out", metavar="F", help="Also write the JSON object to a file.")
    ] = None,
    plot: options.Plot = None,
    as_json: options.Json = False,
    url: options.Url = options.DEFAULT_URL,
) -> None:
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
        with client_of(url) as client:
            listed = stored_designs.listed(client, filters)
        if file is not None:
            _write(file, listed)
        stored_designs.show(listed, as_json=as_json)
        return
    stored_designs.refuse_filters(filters)
    with client_of(url) as client:
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
    return scene_to_submit(name) if name.endswith(problem_inputs.SCENE_FILES) else name


def hand_in(url: str, body: Mapping[str, Any], *, wait: bool, as_json: bool) -> None:
    """Submit a job; print its id, or wait for its end and print what came out, with the id below."""
    with client_of(url) as client:
        job = client.submit(uploaded(client, body))
        if not wait:
            _announce(job, as_json=as_json)
            return
        ended = _follow(client, job.id)
        answer = client.results(job.id)
    _show(ended, answer, as_json=as_json)
    _end(ended)


def _announce(job: JobAnswer, *, as_json: bool) -> None:
    if as_json:
        print_json(job.model_dump(mode="json"))
    else:
        say(job.id)


def client_of(url: str) -> Client:
    """A client of the service at an address."""
    import httpx

    from service.client.client import Client

    try:
        return Client(url, key=given_key())
    except httpx.InvalidURL as error:
        raise InputError(
            f"`--url` must be a web address such as {options.DEFAULT_URL}, got {url!r}"
        ) from error


def _follow(client: Client, job: str) -> JobAnswer:
    with bar(job) as reporter:
        return client.wait(job, reporter, on_best=None if reporter is None else reporter.best)


def _show(job: JobAnswer, answer: ResultsAnswer, *, as_json: bool) -> None:
    if as_json:
        print_json(answer.model_dump(mode="json"))
        return
    print_result(job.kind, answer.result)
    rows = [
        (
            sweep.id,
            sweep.parameter,
            str(sweep.points),
            "" if sweep.peak is None else f"{sweep.peak.value:.6g}",
        )
        for sweep in answer.sweeps
    ]
    if rows:
        print_table("Stored sweeps", ("id", "parameter", "points", "peak [m]"), rows, right="23")
    say(f"job {job.id}")


def _draw(client: Client, kind: str, answer: ResultsAnswer, picture: Path) -> None:
    from service.jobs.drawing import result_figure
    from service.jobs.kind_view import NothingToDrawError
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
