"""``/v1/jobs/{id}/report``: the design report of a job, as a page or a PDF."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Annotated, Any, Literal

from fastapi import APIRouter, Header, Query, Response

from service.errors import ConflictError
from service.http.dependencies import TEXT, Context, InContext, media
from service.http.in_lane import drawing
from service.rendering.representations import chosen
from service.schemas.workbench_answers import ProjectAnswer, RunAnswer

router = APIRouter(prefix="/v1/jobs", tags=["jobs"])

Json = Mapping[str, Any]
_BINARY = {"type": "string", "format": "binary"}


@router.get(
    "/{job_id}/report",
    response_class=Response,
    responses={200: media({"text/html": TEXT, "application/pdf": _BINARY})},
)
@drawing
def report(
    job_id: str,
    context: InContext,
    form: Annotated[Literal["html", "pdf"] | None, Query(alias="format")] = None,
    accept: Annotated[str | None, Header(max_length=500)] = None,
) -> Response:
    """The design report of a job of the kind `design` or `pareto`: a page that needs nothing else, or a PDF.

    `format` goes before `Accept`. It is made anew each time, in a process with limits.
    """
    from service.rendering.report.apart import report_apart
    from service.rendering.report.making import FORMS

    wanted = FORMS[form] if form is not None else chosen(accept, tuple(FORMS.values()))
    suffix = next(name for name, kind in FORMS.items() if kind == wanted)
    made = report_apart(*_designed(context, job_id), suffix, context.service.settings.report_seconds)
    name = f"report-{job_id}.{suffix}"
    return Response(
        made, media_type=wanted, headers={"Content-Disposition": f'attachment; filename="{name}"'}
    )


def _designed(context: Context, job_id: str) -> tuple[Json, Json, Json, Json]:
    """Scene, problem and result of a job that found an optimum, and what is known of its run."""
    from service.rendering.report.about import about_run
    from service.rendering.report.sections import KINDS, problem_of_request

    service, caller = context.service, context.caller
    with service.database.reading():
        row = service.job(job_id, caller)
        if row.kind not in KINDS:
            raise ConflictError(
                f"job {job_id} is of the kind {row.kind!r}, which has no report: only {', '.join(KINDS)} have"
            )
        found = service.results(job_id, caller)
        scene = service.scene_of(job_id, caller)
        run = service.runs.seen(job_id, caller.sees)
        project = None if run.words.project is None else service.projects.seen(run.words.project, caller.sees)
    about = about_run(RunAnswer.of_run(run), None if project is None else ProjectAnswer.of(project))
    return scene, problem_of_request(row.request or {}), found.result, about
