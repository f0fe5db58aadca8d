"""The stored scenes."""

from __future__ import annotations

from typing import Any

from sqlalchemy import Connection, insert, select

from service.clock import utc_now
from service.db import Database
from service.models import NOBODY, Scene
from service.repository.rows import SceneRow

__all__ = ["SceneRepository", "SceneRow"]

_COLUMNS = (Scene.name, Scene.scene_hash, Scene.created, Scene.body)


class SceneRepository:
    """Scenes of one database; a stored scene never changes."""

    def __init__(self, database: Database) -> None:
        self._db = database

    def add(self, name: str, scene_hash: str, body: dict[str, Any]) -> tuple[SceneRow, bool]:
        """Store a scene, or find the one of this name; whether it was stored."""

        def find_or_add(connection: Connection) -> tuple[SceneRow, bool]:
            query = select(*_COLUMNS).where(Scene.owner == NOBODY, Scene.name == name)
            known = connection.execute(query).mappings().one_or_none()
            if known is not None:
                return SceneRow(**known), False
            row = SceneRow(name=name, scene_hash=scene_hash, created=utc_now(), body=body)
            values = {"name": name, "scene_hash": scene_hash, "created": row.created, "body": body}
            connection.execute(insert(Scene).values(**values))
            return row, True

        return self._db.grouped(find_or_add)

    def get(self, name: str) -> SceneRow | None:
        """The scene, or None."""
        with self._db.reading() as connection:
            row = connection.execute(select(*_COLUMNS).where(Scene.name == name)).mappings().one_or_none()
        return None if row is None else SceneRow(**row)

    def all(self) -> list[SceneRow]:
        """All of them, by name."""
        with self._db.reading() as connection:
            rows = connection.execute(select(*_COLUMNS).order_by(Scene.name)).mappings().all()
        return [SceneRow(**row) for row in rows]
