"""The scenes a service knows: those that come with the package and those stored in its database."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace
from functools import cache

from service.auth.callers import KEYLESS, Caller
from service.db.models import NOBODY, StoredScene
from service.db.pagination import Position
from service.db.repositories import SceneRepository
from service.errors import ConflictError, NotFoundError
from service.jobs.common.scene_requests import read_scene
from service.jobs.strict_json import digest, encoded
from service.uploads.uploads import Uploads
from solver.scene.scene import load_scene, shipped_scenes

_BETWEEN = "\n"  # of name and owner where a page ends; neither has one


@dataclass(frozen=True, slots=True)
class SceneStore:
    """Scenes by name, as one caller sees them; implements `service.jobs.kind_registry.SceneSource`."""

    repository: SceneRepository
    uploads: Uploads
    caller: Caller = KEYLESS

    def of(self, caller: Caller) -> SceneStore:
        """The same scenes as another caller sees them."""
        return replace(self, caller=caller)

    def with_uploads(self, body: Mapping[str, object]) -> Mapping[str, object]:
        """A scene with what the caller's uploads hold in place of their ids."""
        return self.uploads.resolved(body, self.caller)

    def scene_body(self, name: str) -> Mapping[str, object] | None:
        """Tables and lists of the scene, or None."""
        try:
            return self.get(name).body
        except NotFoundError:
            return None

    def get(self, name: str) -> StoredScene:
        """The shipped scene of this name, or the caller's own; only names are looked up, never paths.

        NotFoundError if there is none.
        """
        if name in shipped_scenes():
            return _shipped(name)
        row = self.repository.get(self.caller.owner, name)
        if row is None:
            known = ", ".join(shipped_scenes())
            raise NotFoundError(f"there is no scene {name!r}: shipped are {known}, GET /v1/scenes lists all")
        return row

    def page(self, limit: int, after: Position | None = None) -> list[StoredScene]:
        """Stored scenes that the caller may see, by name, without tables, those behind a position."""
        name, _, owner = ("", "", "") if after is None else after[1].partition(_BETWEEN)
        return self.repository.page(self.caller.sees, None if after is None else (name, owner), limit)

    @staticmethod
    def position(scene: StoredScene) -> Position:
        """Where a page that ends with this scene goes on."""
        return None, f"{scene.name}{_BETWEEN}{scene.owner}"

    def add(self, body: Mapping[str, object]) -> tuple[StoredScene, bool]:
        """Store a scene under its own name; whether it is new.

        InvalidRequestError if it is not a scene; ConflictError if another scene of the caller's has the name:
        a name means one scene for ever.
        """
        scene = read_scene(self.with_uploads(body))
        tables = scene.to_dict()
        return self.keep(scene.name, digest(tables), tables)

    def keep(self, name: str, scene_hash: str, tables: dict[str, object]) -> tuple[StoredScene, bool]:
        """Store a scene that was read and checked; `add` lists the errors."""
        if name in shipped_scenes():
            known, added = _shipped(name), False
        else:
            self.uploads.storage.require(self.caller, len(encoded(tables)))
            known, added = self.repository.add(self.caller.owner, name, scene_hash, tables)
        if known.scene_hash != scene_hash:
            kind = "shipped" if known.shipped else "stored"
            raise ConflictError(
                f"another scene is {kind} under the name {name!r} and a name keeps its meaning: "
                "give this one another `name`"
            )
        return known, added


def shipped() -> list[StoredScene]:
    """The scenes that come with the package."""
    return [_shipped(name) for name in shipped_scenes()]


@cache
def _shipped(name: str) -> StoredScene:
    body = load_scene(name).to_dict()
    return StoredScene(owner=NOBODY, name=name, scene_hash=digest(body), created=None, body=body)
