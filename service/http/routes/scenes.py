"""``/v1/scenes``: what sweeps and designs are about."""

from __future__ import annotations

from fastapi import APIRouter, Response

from service.http.dependencies import CallerDependency, JsonBody, ServiceDependency
from service.http.in_lane import reading, writing
from service.schemas.answers import SceneAnswer, SceneDetail, SceneList

router = APIRouter(prefix="/v1/scenes", tags=["scenes"])


@router.get("")
@reading
def list_scenes(service: ServiceDependency, caller: CallerDependency) -> SceneList:
    """Shipped and stored scenes."""
    return SceneList(items=[SceneAnswer.of(scene) for scene in service.scenes.of(caller).all()])


@router.get("/{name}")
@reading
def get_scene(name: str, service: ServiceDependency, caller: CallerDependency) -> SceneDetail:
    """A scene with its tables: a shipped one, or one of one's own."""
    return SceneDetail.of(service.scenes.of(caller).get(name))


@router.post(
    "",
    status_code=201,
    responses={200: {"model": SceneDetail, "description": "The same scene was stored before."}},
)
@writing
def store_scene(
    body: JsonBody, service: ServiceDependency, caller: CallerDependency, response: Response
) -> SceneDetail:
    """Store a scene under its `name`; a name keeps its meaning for ever."""
    scene, added = service.scenes.of(caller).add(body)
    response.status_code = 201 if added else 200
    response.headers["Location"] = f"/v1/scenes/{scene.name}"
    return SceneDetail.of(scene)
