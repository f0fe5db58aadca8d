"""``/v1/templates``, ``/v1/scenes-schema``, ``/v1/laws``, ``/v1/kinds``: what forms are made of."""

from __future__ import annotations

from functools import lru_cache
from typing import Annotated, Any

from fastapi import APIRouter, Body, Request, Response
from pydantic import ConfigDict, Field

from service.errors import InvalidRequestError
from service.http.dependencies import InContext, TypedRoute
from service.http.made_once import Constant
from service.jobs.kind_registry import JobKind, Registry
from service.jobs.kinds.bodies import body_model
from service.jobs.strict_json import encoded
from service.schemas.answers import AnswerModel, AskedModel, KindAnswer, KindList, LawList, law_list
from solver.contacts.laws.law_registry import laws as known_laws
from solver.errors import SceneError
from solver.lab import from_lab, rooms
from solver.scene.json_schema import plain, scene_schema

templates = APIRouter(prefix="/v1", tags=["scenes"], route_class=TypedRoute)
_known: Any = from_lab("templates.templates") if "templates" in rooms() else None

_ANSWERS: dict[str, Any] = {"template": "platform-damper", "answers": {"frequency_hz": 420, "blades": 60}}


class FillRequest(AskedModel):
    """A template and answers to its questions; those left out have defaults."""

    model_config = ConfigDict(json_schema_extra={"examples": [_ANSWERS]})

    template: str = Field(max_length=100)
    answers: dict[str, Any] = Field(default={})


FillBody = Annotated[FillRequest, Body(openapi_examples={"answers": {"value": _ANSWERS}})]


class TemplateAnswer(AnswerModel):
    """A template: a case of which a scene is made."""

    name: str
    title: str = Field(description="For people.")
    questions: dict[str, Any] = Field(
        description="JSON Schema of the answers, each with unit, range and default."
    )


class TemplateList(AnswerModel):
    """All templates."""

    items: list[TemplateAnswer]


class TemplateScene(AnswerModel):
    """The tables of a scene, and the same as a file with comments, as `stickslip new` writes it."""

    scene: dict[str, Any]
    text: str


@templates.get("/templates", response_model=TemplateList)
async def list_templates(request: Request) -> Response:
    """The cases of which scenes can be made, each with its questions."""
    return await _TEMPLATES.answer(request)


def _templates() -> bytes:
    items = [
        TemplateAnswer(name=name, title=each.TITLE, questions=_known.template_schema(each))
        for name, each in (_known.TEMPLATES if _known else {}).items()
    ]
    return TemplateList(items=items).model_dump_json().encode()


_TEMPLATES = Constant(_templates)


@templates.post("/templates")
async def fill_template(body: FillBody) -> TemplateScene:
    """The scene of a case, made of the answers to its questions; nothing is stored."""
    names = [*_known.TEMPLATES] if _known else []
    if body.template not in names:
        raise InvalidRequestError.of(("template",), f"must be one of {', '.join(names)}", body.template)
    try:
        scene = _known.template_tables(body.template, body.answers)
        return TemplateScene(scene=scene, text=_known.commented(body.template, scene))
    except SceneError as error:
        raise InvalidRequestError([one.below("answers") for one in error.issues]) from error


_SCHEMA = Constant(lambda: encoded(scene_schema()).encode())


@templates.get("/scenes-schema", response_model=dict[str, Any])
async def schema(request: Request) -> Response:
    """The JSON Schema of scenes, as `stickslip schema` prints it, with the laws of this service."""
    return await _SCHEMA.answer(request)


laws = APIRouter(prefix="/v1/laws", tags=["scenes"])


@lru_cache(maxsize=1)
def _laws(_known: tuple[str, ...]) -> Constant:
    return Constant(lambda: law_list().model_dump_json().encode())


@laws.get("", response_model=LawList)
async def list_laws(request: Request) -> Response:
    """The contact laws of this service, each with its parameters: unit, words, what a slider covers."""
    return await _laws(tuple(known_laws())).answer(request)


kinds = APIRouter(prefix="/v1/kinds", tags=["jobs"])


@lru_cache(maxsize=4)
def _kinds(registry: Registry) -> Constant:
    return Constant(lambda: KindList(items=[_answer(kind) for kind in registry]).model_dump_json().encode())


@kinds.get("", response_model=KindList)
async def list_kinds(context: InContext) -> Response:
    """The kinds of job of this service, each with the schema of its body and of its result."""
    return await _kinds(context.service.registry).answer(context.request)


def constants(registry: Registry) -> tuple[Constant, ...]:
    """The answers of all these routes, those that the page asks for first at the beginning."""
    return _laws(tuple(known_laws())), _kinds(registry), _TEMPLATES, _SCHEMA


def _answer(kind: JobKind) -> KindAnswer:
    answers = kind.answers
    result = None if answers is None else plain(answers.model_json_schema())
    body = plain(body_model(kind.name, kind.request).model_json_schema())
    return KindAnswer(name=kind.name, summary=kind.summary, body=body, result=result)
