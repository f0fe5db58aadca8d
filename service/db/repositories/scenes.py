"""The stored scenes."""

from __future__ import annotations

from dataclasses import asdict
from typing import Any

from sqlalchemy import Connection, and_, insert, or_, select

from service.db.clock import utc_now
from service.db.engine import Database
from service.db.models import Scene
from service.db.repositories.rows import SceneRow, WholeSceneRow
from service.jobs.strict_json import encoded

__all__ = ["SceneRepository", "SceneRow", "WholeSceneRow"]

_COLUMNS = (Scene.owner, Scene.name, Scene.scene_hash, Scene.created)
_WHOLE = (*_COLUMNS, Scene.body)


class SceneRepository:
    """Scenes of one database; a stored scene never changes."""

    def __init__(self, database: Database) -> None:
        self._db = database

    def add(self, owner: str, name: str, scene_hash: str, body: dict[str, Any]) -> tuple[WholeSceneRow, bool]:
        """Store a scene, or find the one of this owner and name; whether it was stored."""
        text = encoded(body)

        def find_or_add(connection: Connection) -> tuple[WholeSceneRow, bool]:
            query = select(*_WHOLE).where(Scene.owner == owner, Scene.name == name)
            known = connection.execute(query).mappings().one_or_none()
            if known is not None:
                return WholeSceneRow(**known), False
            row = WholeSceneRow(owner=owner, name=name, scene_hash=scene_hash, created=utc_now(), body=body)
            values = {**asdict(row), "body": text, "size": len(text)}
            connection.execute(insert(Scene).values(values))
            return row, True

        return self._db.grouped(find_or_add)

    def get(self, owner: str, name: str) -> WholeSceneRow | None:
        """The scene that an owner has under a name, or None."""
        query = select(*_WHOLE).where(Scene.owner == owner, Scene.name == name)
        with self._db.reading() as connection:
            row = connection.execute(query).mappings().one_or_none()
        return None if row is None else WholeSceneRow(**row)

    def page(self, owner: str | None, after: tuple[str, str] | None, limit: int) -> list[SceneRow]:
        """Scenes of an owner, or of everybody (None), by name, without their tables.

        Parameters
        ----------
        after : name and owner of the last one on the page before.
        limit : most that are listed.
        """
        query = select(*_COLUMNS).order_by(Scene.name, Scene.owner).limit(limit)
        if owner is not None:
            query = query.where(Scene.owner == owner)
        if after is not None:
            name, whose = after
            query = query.where(or_(Scene.name > name, and_(Scene.name == name, Scene.owner > whose)))
        with self._db.reading() as connection:
            rows = connection.execute(query).mappings().all()
        return [SceneRow(**row) for row in rows]
