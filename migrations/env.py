"""Run by Alembic: connects the revisions to a database.

The service passes an open connection in `config.attributes["connection"]`. Without one (a developer's
``alembic -c migrations/alembic.ini …``) the database comes from the service's settings.
"""

from __future__ import annotations

from alembic import context
from sqlalchemy import Connection

from service.db.engine import migration_engine
from service.db.models import Project
from service.settings.settings import load_settings


def run(connection: Connection) -> None:
    """Run the migrations in one transaction of `connection`; the keys hold before it commits."""
    context.configure(
        connection=connection,
        target_metadata=Project.metadata,
        render_as_batch=True,
        transactional_ddl=True,
        compare_type=True,
    )
    context.run_migrations()
    if connection.dialect.name != "sqlite":
        return  # others hold the keys all along
    broken = connection.exec_driver_sql("PRAGMA foreign_key_check").fetchall()
    if broken:
        raise RuntimeError(f"the migration would leave rows that refer to nothing: {broken[:5]}")


def main() -> None:
    """Use the connection that was passed, or open one."""
    passed: Connection | None = context.config.attributes.get("connection")
    if passed is not None:
        run(passed)
        return
    engine = migration_engine(load_settings().database)
    with engine.begin() as connection:
        run(connection)


main()
