"""``/v1/scenes``: what sweeps and designs are about."""

from __future__ import annotations

import json
from typing import Annotated, Any, ClassVar

from fastapi import APIRouter, Query, Response
from pydantic import Field

from service.db.models import Scene
from service.http.computed import computed
from service.http.dependencies import Context, InContext, JsonBody
from service.http.in_lane import reading
from service.jobs.answering import STORE
from service.queue.scene_store import shipped
from service.schemas.answers import SceneAnswer, SceneDetail, SceneList
from service.schemas.pages import Cursor, Limit, ListQuery, page_of

router = APIRouter(prefix="/v1/scenes", tags=["scenes"])


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
def get_scene(name: str, context: InContext) -> SceneDetail:
    """A scene with its tables: a shipped one, or one of one's own."""
    return _whole(context.service.scenes.of(context.caller).get(name))


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


def _whole(scene: Scene) -> SceneDetail:
    return SceneDetail.of(scene, scene=dict(scene.body))


def _keep(context: Context, found: dict[str, Any]) -> tuple[Scene, bool]:
    tables = json.loads(found["tables"])
    return context.service.scenes.of(context.caller).keep(found["name"], found["scene_hash"], tables)
