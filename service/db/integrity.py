"""`stickslip db check`: whether a database is sound, read from end to end."""

from __future__ import annotations

from dataclasses import dataclass

from sqlalchemy.exc import DBAPIError

from service.db.engine import database_name, database_path, is_sqlite, read_engine
from service.db.repositories.integrity import (
    Contents,
    arrays,
    contents,
    contradictions,
    damage,
    damaged_results,
)
from service.db.revisions import head_revision, off_head
from service.errors import DamagedDatabaseError, DatabaseError, WrongRevisionError
from service.jobs.arrays import decode

MOST_NAMED = 20  # damaged arrays and results that are named one by one


@dataclass(frozen=True, slots=True, kw_only=True)
class Findings:
    """What a check found.

    Attributes
    ----------
    revision, wanted : str
        The revision of the tables, and that of this version.
    trouble : tuple of str
        What is wrong, in words; empty for a sound database.
    contents : Contents
        How much it holds.
    """

    revision: str
    wanted: str
    trouble: tuple[str, ...]
    contents: Contents

    @property
    def sound(self) -> bool:
        """Whether nothing is wrong."""
        return not self.trouble

    def to_json(self) -> dict[str, object]:
        """Return the findings as one JSON object."""
        return {
            "sound": self.sound, "revision": self.revision, "wanted": self.wanted,
            "trouble": list(self.trouble), "jobs": dict(self.contents.jobs),
            "sweeps": self.contents.sweeps, "arrays": self.contents.arrays,
        }  # fmt: skip


def check(url: str) -> Findings:
    """Read a database from end to end; a service may be using it.

    Raises
    ------
    DatabaseError
        There is no such database.
    DamagedDatabaseError, WrongRevisionError
        It cannot be read, or it is at another revision.
    """
    name = database_name(url)
    if is_sqlite(url) and not database_path(url).exists():
        raise DatabaseError(f"there is no database {name} to check")
    wrong = off_head(url, "checks")
    if wrong is not None:
        raise WrongRevisionError(wrong)
    engine = read_engine(url)
    try:
        with engine.begin() as connection:
            trouble = [*damage(connection), *contradictions(connection)]
            held = contents(connection)
        damaged = []
        for sweep_id, name, stored in arrays(engine):
            try:
                decode(stored)
            except (DatabaseError, ValueError) as error:
                damaged.append(f"array `{name}` of sweep {sweep_id}: {error}")
        damaged += damaged_results(engine)
    except DBAPIError as error:
        raise DamagedDatabaseError(f"{name} cannot be read: {error.orig}") from error
    finally:
        engine.dispose()
    more = [f"{len(damaged) - MOST_NAMED} more arrays and results"] if len(damaged) > MOST_NAMED else []
    head = head_revision()
    return Findings(
        revision=head,
        wanted=head,
        trouble=(*trouble, *damaged[:MOST_NAMED], *more),
        contents=held,
    )
