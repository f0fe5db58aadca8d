"""The scenes a service knows: those that come with the package and those stored in its database."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace
from functools import cache

from service.auth.callers import KEYLESS, Caller
from service.db.models import NOBODY, Scene
from service.db.repositories import SceneRepository
from service.errors import ConflictError, NotFoundError
from service.jobs.common.scenes import read_scene
from service.jobs.strict_json import digest, encoded
from service.uploads.uploads import Uploads
from solver.scene.scene import load_scene, shipped_scenes

_BETWEEN = "\n"  # of name and owner where a page ends; neither has one


@dataclass(frozen=True, slots=True)
class SceneStore:
    """Scenes by name, as one caller sees them; implements `service.jobs.registry.SceneSource`."""

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

    def get(self, name: str) -> Scene:
        """The shipped scene of this name, or the caller's own; only names are looked up, never paths.

        Raises
        ------
        NotFoundError
            If there is none.
        """
        if name in shipped_scenes():
            return _shipped(name)
        row = self.repository.get(self.caller.owner, name)
        if row is None:
            known = ", ".join(shipped_scenes())
            raise NotFoundError(f"there is no scene {name!r}: shipped are {known}, GET /v1/scenes lists all")
        return row

    def page(self, size: int, after: str | None = None) -> tuple[list[Scene], str | None]:
        """Shipped scenes, then `size` of the stored ones that the caller may see, by name, without tables.

        Parameters
        ----------
        after : where the page before ended; shipped scenes are on the first one.

        Returns
        -------
        The scenes, and where the page ended if more follow.
        """
        position = None
        if after is not None:
            name, _, owner = after.partition(_BETWEEN)
            position = (name, owner)
        rows = self.repository.page(self.caller.sees, position, size + 1)
        stored = rows[:size]
        end = None if len(rows) <= size else f"{stored[-1].name}{_BETWEEN}{stored[-1].owner}"
        return [*map(_shipped, shipped_scenes() if after is None else ()), *stored], end

    def add(self, body: Mapping[str, object]) -> tuple[Scene, bool]:
        """Store a scene under its own name; whether it is new.

        Raises
        ------
        InvalidRequestError
            If it is not a scene.
        ConflictError
            If another scene of the caller's has the name: a name means one scene for ever.
        """
        scene = read_scene(self.with_uploads(body))
        tables = scene.to_dict()
        return self.keep(scene.name, digest(tables), tables)

    def keep(self, name: str, scene_hash: str, tables: dict[str, object]) -> tuple[Scene, bool]:
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


@cache
def _shipped(name: str) -> Scene:
    body = load_scene(name).to_dict()
    return Scene(owner=NOBODY, name=name, scene_hash=digest(body), created=None, body=body)
