"""``/v1/kinds``: the kinds of job there are, for programs that make their forms of them."""

from __future__ import annotations

from typing import Any, Self

from fastapi import APIRouter
from pydantic import Field

from service.http.dependencies import ServiceDependency
from service.jobs.kinds.registry.bodies import body_model
from service.jobs.registry import JobKind
from service.schemas.answers import Answer
from solver.scene.json_schema import plain

router = APIRouter(prefix="/v1/kinds", tags=["jobs"])


class KindAnswer(Answer):
    """A kind of job."""

    name: str
    summary: str
    body: dict[str, Any] = Field(description="JSON Schema of the body of `POST /v1/jobs`, with examples.")
    result: dict[str, Any] | None = Field(description="JSON Schema of the result; null for any object.")

    @classmethod
    def of(cls, kind: JobKind) -> Self:
        """The answer for a kind."""
        result = None if kind.result is None else plain(kind.result.model_json_schema())
        body = plain(body_model(kind.name, kind.request).model_json_schema())
        return cls(name=kind.name, summary=kind.summary, body=body, result=result)


class KindList(Answer):
    """All kinds of job."""

    items: list[KindAnswer]


@router.get("")
def list_kinds(service: ServiceDependency) -> KindList:
    """The kinds of job of this service, each with the schema of its body and of its result."""
    return KindList(items=[KindAnswer.of(kind) for kind in service.registry])
