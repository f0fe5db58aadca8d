"""The stored scenes."""

from __future__ import annotations

from typing import Any

from sqlalchemy import Connection, and_, or_
from sqlalchemy.orm import defer

from service.db.models import Scene
from service.db.repositories.owned import Rows
from service.jobs.strict_json import encoded


class SceneRepository(Rows[Scene]):
    """Scenes of one database, each of an owner and a name; a stored scene never changes."""

    table = Scene

    def add(self, owner: str, name: str, scene_hash: str, body: dict[str, Any]) -> tuple[Scene, bool]:
        """Store a scene, or find the one of this owner and name; whether it was stored."""
        text = encoded(body)

        def find_or_add(connection: Connection) -> tuple[Scene, bool]:
            for known in self._read(connection, self._of((owner, name))):
                return known, False
            row = Scene(
                owner=owner, name=name, scene_hash=scene_hash, created=self._now(), size=len(text), body=body
            )
            return self._insert(connection, row, body=text), True

        return self._db.grouped(find_or_add)

    def page(self, owner: str | None, after: tuple[str, str] | None, limit: int) -> list[Scene]:
        """Scenes of an owner, or of everybody (None), by name, without their tables.

        Parameters
        ----------
        after : name and owner of the last one on the page before.
        limit : most that are listed.
        """
        query = self._select.options(defer(Scene.body)).order_by(Scene.name, Scene.owner).limit(limit)
        if owner is not None:
            query = query.where(Scene.owner == owner)
        if after is not None:
            name, whose = after
            query = query.where(or_(Scene.name > name, and_(Scene.name == name, Scene.owner > whose)))
        return self._all(query)
