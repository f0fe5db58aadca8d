"""``/v1/kinds``: the kinds of job there are, for programs that make their forms of them."""

from __future__ import annotations

from fastapi import APIRouter

from service.http.dependencies import InContext
from service.jobs.kinds.registry.bodies import body_model
from service.jobs.registry import JobKind
from service.schemas.answers import KindAnswer, KindList
from solver.scene.json_schema import plain

router = APIRouter(prefix="/v1/kinds", tags=["jobs"])


@router.get("")
def list_kinds(context: InContext) -> KindList:
    """The kinds of job of this service, each with the schema of its body and of its result."""
    return KindList(items=[_answer(kind) for kind in context.service.registry])


def _answer(kind: JobKind) -> KindAnswer:
    result = None if kind.result is None else plain(kind.result.model_json_schema())
    body = plain(body_model(kind.name, kind.request).model_json_schema())
    return KindAnswer(name=kind.name, summary=kind.summary, body=body, result=result)
