"""How much the owners store."""

from __future__ import annotations

from sqlalchemy import BindParameter, bindparam, func, select

from service.db.engine import Database
from service.db.models import Job, Scene, Upload

_OWNER: BindParameter[str] = bindparam("owner")
OF_JOBS = select(func.coalesce(func.sum(Job.stored_bytes), 0)).where(Job.owner == _OWNER)
_OF_UPLOADS = select(func.coalesce(func.sum(Upload.size), 0)).where(Upload.owner == _OWNER)
_OF_SCENES = select(func.coalesce(func.sum(Scene.size), 0)).where(Scene.owner == _OWNER)


class StorageRepository:
    """What is stored in one database, by owner."""

    def __init__(self, database: Database) -> None:
        self._db = database

    def of(self, owner: str) -> int:
        """Bytes of an owner's jobs with results and sweeps, of their uploads and of their scenes."""
        with self._db.reading() as connection:
            counted = (
                connection.execute(one, {"owner": owner}) for one in (OF_JOBS, _OF_UPLOADS, _OF_SCENES)
            )
            return sum(int(one.scalar_one()) for one in counted)
