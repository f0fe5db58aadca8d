"""``/v1/scenes``, ``/v1/plan``, ``/v1/previews``: scenes stored and as text; what is computed at once."""

from __future__ import annotations

import json
from functools import reduce
from operator import or_
from typing import Annotated, Any, ClassVar, Literal

from fastapi import APIRouter, Body, Query, Response
from pydantic import BaseModel, ConfigDict, Field

from service.auth.allowances import share
from service.db.models import StoredScene
from service.http.dependencies import TEXT, Context, InContext, JsonBody, TypedRoute, media, takes_body
from service.http.in_lane import computed, prepared, reading
from service.jobs import answering
from service.jobs.answering import PLAN, PREVIEW, STORE
from service.jobs.common.scene_parameters import SceneParameterList
from service.jobs.common.scene_requests import FILE_KEYS, SceneRequest
from service.jobs.kind_registry import KIND, asked_of
from service.jobs.kinds.bodies import any_body, examples
from service.jobs.kinds.previews import PREVIEWS, PreviewRequest
from service.jobs.studies.plan_study import EXAMPLE, Plan, plan_result
from service.queue.scene_store import shipped
from service.schemas.answers import (
    AskedModel,
    Cursor,
    Limit,
    ListQuery,
    SceneAnswer,
    SceneDetail,
    SceneList,
    page_of,
)
from solver.scene.descriptions import DAMPER_LOAD

texts = APIRouter(prefix="/v1/scenes", tags=["scenes"], route_class=TypedRoute)
router = APIRouter(prefix="/v1/scenes", tags=["scenes"])

_FILE: dict[str, Any] = {"text": 'name = "half a scene"', "form": "toml"}
_EDIT: dict[str, Any] = {"text": 'name = "a" # mine', "scene": {"name": "b"}}
_SCENE: dict[str, Any] = {"scene": "two-dof", "set": {DAMPER_LOAD: 80}, "comments": ["as set"]}
_WEDGE: dict[str, Any] = {"scene": "platform-wedge"}
MOST_CHARACTERS = 4_000_000


class ReadRequest(AskedModel):
    """The text of a scene file."""

    model_config = ConfigDict(json_schema_extra={"examples": [_FILE]})

    text: str = Field(max_length=MOST_CHARACTERS)
    form: Literal["toml", "json"] = "toml"


class TextRequest(SceneRequest):
    """A scene with its values set, and what to say above it."""

    model_config = ConfigDict(json_schema_extra={"examples": [_SCENE]})

    comments: list[Annotated[str, Field(max_length=2000)]] = Field(default=[], max_length=50)


class EditRequest(AskedModel):
    """The TOML of a scene, and the tables it is to hold if these were changed."""

    model_config = ConfigDict(json_schema_extra={"examples": [_EDIT]})

    text: str = Field(max_length=MOST_CHARACTERS)
    scene: dict[str, Any] | None = None


ReadBody = Annotated[ReadRequest, Body(openapi_examples={"read": {"value": _FILE}})]
TextBody = Annotated[TextRequest, Body(openapi_examples={"text": {"value": _SCENE}})]
ParametersBody = Annotated[SceneRequest, Body(openapi_examples={"wedge": {"value": _WEDGE}})]
OfFiles = Annotated[bool, Query(description="Whether with what its files held; a drawing needs none.")]
EditBody = Annotated[EditRequest, Body(openapi_examples={"edit": {"value": _EDIT}})]


class SceneIssue(BaseModel):
    """Something wrong: an RFC 6901 pointer into the scene, and a sentence."""

    pointer: str
    detail: str


class SceneRead(BaseModel):
    """The tables of a scene file and everything wrong with them."""

    scene: dict[str, Any]
    issues: list[SceneIssue]


class PlacedIssue(SceneIssue):
    """The same with its place in the text: line and column, from 1."""

    line: int
    column: int | None


class SceneEdited(BaseModel):
    """The text and the tables it holds (null where it cannot be read), and everything wrong with them."""

    text: str
    scene: dict[str, Any] | None
    issues: list[PlacedIssue]


@texts.post("/read", response_model=SceneRead)
async def read(body: ReadBody, context: InContext) -> Response:
    """Read the text of a scene file and list everything that is wrong with it; nothing is stored."""
    found = await computed(context, answering.READ, body.model_dump(), about="text")
    return Response(found, media_type="application/json")


@texts.post("/text", response_class=Response, responses={200: media({"application/toml": TEXT})})
async def text(body: TextBody, context: InContext) -> Response:
    """The TOML of a scene with its values set: the file that reproduces what was computed."""
    words = {"request": body, "comments": body.comments}
    return Response(await computed(context, answering.TEXT, words), media_type="application/toml")


@texts.post("/parameters", response_model=SceneParameterList)
async def parameters(body: ParametersBody, context: InContext) -> Response:
    """The parameters of a scene's contacts, dampers, bodies and loads, with unit, value and range of each."""
    found = await computed(context, answering.PARAMETERS, {"request": body})
    return Response(found, media_type="application/json")


@texts.post("/edit", response_model=SceneEdited)
async def edit(body: EditBody, context: InContext) -> Response:
    """Text and tables side by side: `text` read, or changed so that it holds `scene`; nothing is stored.

    Comments, order and spelling of what stays the same are kept.
    """
    found = await computed(context, answering.EDIT, body.model_dump(), about="text")
    return Response(found, media_type="application/json")


class SceneQuery(ListQuery):
    """Which scenes to list."""

    path: ClassVar[str] = "/v1/scenes"

    limit: Limit = Field(default=1000, description="Of the stored scenes.")
    cursor: Cursor = None


@router.get("")
@reading
def list_scenes(context: InContext, query: Annotated[SceneQuery, Query()]) -> SceneList:
    """Shipped scenes, on the first page, and stored ones by name."""
    known = context.service.scenes.of(context.caller)
    stored, following = page_of(query, context.service.settings, known.page, known.position)
    scenes = [*(shipped() if query.cursor is None else ()), *stored]
    return SceneList(items=[SceneAnswer.of(scene) for scene in scenes], next=following)


@router.get("/{name}")
@reading
def get_scene(name: str, context: InContext, *, files: OfFiles = True) -> SceneDetail:
    """A scene with its tables: a shipped one, or one of one's own."""
    return _whole(context.service.scenes.of(context.caller).get(name), files=files)


@router.post(
    "",
    status_code=201,
    responses={200: {"model": SceneDetail, "description": "The same scene was stored before."}},
)
async def store_scene(body: JsonBody, context: InContext, response: Response) -> SceneDetail:
    """Store a scene under its `name`; a name keeps its meaning for ever."""
    found = await computed(context, STORE, body, about="")
    writes = context.service.lanes.writes
    scene, added = await writes.run(context.caller.owner, _keep, context, found)
    response.status_code = 201 if added else 200
    response.headers["Location"] = f"/v1/scenes/{scene.name}"
    return _whole(scene)


def _whole(scene: StoredScene, *, files: bool = True) -> SceneDetail:
    body: dict[str, Any] = dict(scene.body)
    if not files:
        body["structure"] = {key: held for key, held in body["structure"].items() if key not in FILE_KEYS}
    return SceneDetail.of(scene, scene=body)


def _keep(context: Context, found: dict[str, Any]) -> tuple[StoredScene, bool]:
    tables = json.loads(found["tables"])
    return context.service.scenes.of(context.caller).keep(found["name"], found["scene_hash"], tables)


plans = APIRouter(prefix="/v1/plan", tags=["scenes"], route_class=TypedRoute)


PlanBody = Annotated[Plan, Body(openapi_examples={"plan": {"value": EXAMPLE}})]


@plans.post("", response_model=plan_result())
async def plan(body: PlanBody, context: InContext) -> Any:
    """The effects this scene calls for and those left out, each with the reason; sizes and cost."""
    return await computed(context, PLAN, {"request": body})


previews = APIRouter(prefix="/v1/previews", tags=["previews"], route_class=TypedRoute)


async def preview(body: PreviewRequest, context: InContext) -> Response:
    """Compute `sweep`, `sensitivities`, `limits`, `point` or `shape` within seconds.

    Nothing is stored, and sizes are limited.

    Of a disk that is solved whole fewer harmonics are kept than asked for: the answer says how many. The
    limit `work` of a key holds here as for a job of the same points.

    Of several previews with the same `client` only the newest is computed: the others are answered 409.
    """
    service, caller = context.service, context.caller
    raw = await context.request.json()
    found = await prepared(context, raw, asked_of(body, PREVIEWS[raw[KIND]].request), PREVIEW)
    asking = f"{caller.owner} {body.client}" if body.client else ""
    most = share(caller, service.settings, "previews")
    spec = json.loads(found.spec)
    answer = await service.previews.compute(raw[KIND], spec, asking, caller.owner, most)
    return Response(answer, media_type="application/json", headers={"Cache-Control": "no-store"})


takes_body(preview, any_body(PREVIEWS), examples(PREVIEWS), by=KIND)
previews.add_api_route(
    "", preview, methods=["POST"], response_model=reduce(or_, (kind.answers for kind in PREVIEWS))
)
