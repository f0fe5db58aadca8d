"""What uploads hold is no column any more.

Revision 0013, after 0012. Beside a file of SQLite it is a file in the folder ``NAME.files``, named by its
upload; in PostgreSQL it is pieces of a megabyte. The bytes go there piece by piece. If the upgrade fails, the
files it wrote stay and are written anew by the next one.
"""

from __future__ import annotations

import os
from collections.abc import Iterator
from pathlib import Path

import sqlalchemy as sa
from alembic import op

revision = "0013"
down_revision = "0012"
branch_labels = None
depends_on = None

_PIECE = 1 << 20


def _folder() -> Path | None:
    """The folder beside a file of SQLite."""
    connection = op.get_bind()
    path = Path(connection.engine.url.database or "")
    return path.with_name(f"{path.name}.files") if connection.dialect.name == "sqlite" else None


def _uploads() -> list[tuple[str, int]]:
    return [tuple(row) for row in op.get_bind().execute(sa.text("SELECT id, size FROM upload")).all()]


def _pieces(upload: str, size: int) -> Iterator[bytes]:
    query = sa.text("SELECT substr(data, :at, :piece) FROM upload WHERE id = :id")
    for begin in range(0, size, _PIECE):
        yield op.get_bind().execute(query, {"at": begin + 1, "piece": _PIECE, "id": upload}).scalar_one()


def upgrade() -> None:
    """To this revision."""
    op.create_table(
        "upload_piece",
        sa.Column("upload_id", sa.String(36), nullable=False),
        sa.Column("position", sa.Integer(), nullable=False),
        sa.Column("data", sa.LargeBinary(), nullable=False),
        sa.PrimaryKeyConstraint("upload_id", "position", name="pk_upload_piece"),
    )
    uploads, folder = _uploads(), _folder()
    if folder is not None and uploads:
        folder.mkdir(mode=0o700, exist_ok=True)
    insert = sa.text("INSERT INTO upload_piece VALUES (:upload, :position, :data)")
    for upload, size in uploads:
        if folder is not None:
            (folder / upload).unlink(missing_ok=True)
            (folder / upload).touch(0o600)
            with (folder / upload).open("wb") as file:
                file.writelines(_pieces(upload, size))
                file.flush()
                os.fsync(file.fileno())
            (folder / upload).chmod(0o400)
            continue
        for position, data in enumerate(_pieces(upload, size)):
            op.get_bind().execute(insert, {"upload": upload, "position": position, "data": data})
    if folder is not None and uploads and os.name == "posix":
        opened = os.open(folder, os.O_RDONLY)
        os.fsync(opened)
        os.close(opened)
    with op.batch_alter_table("upload") as table:
        table.drop_column("data")
        table.alter_column("size", type_=sa.BigInteger(), existing_type=sa.Integer(), existing_nullable=False)


def downgrade() -> None:
    """Back to the one before; the files stay as they are, and this is where they are read from."""
    folder = _folder()
    with op.batch_alter_table("upload") as table:
        table.add_column(sa.Column("data", sa.LargeBinary(), nullable=False, server_default=sa.text("''")))
        table.alter_column("size", type_=sa.Integer(), existing_type=sa.BigInteger(), existing_nullable=False)
    pieces = sa.text("SELECT data FROM upload_piece WHERE upload_id = :id ORDER BY position")
    for upload, _ in _uploads():
        if folder is not None:
            data = (folder / upload).read_bytes()
        else:
            data = b"".join(op.get_bind().execute(pieces, {"id": upload}).scalars())
        op.get_bind().execute(
            sa.text("UPDATE upload SET data = :data WHERE id = :id"), {"data": data, "id": upload}
        )
    with op.batch_alter_table("upload") as table:
        table.alter_column(
            "data", server_default=None, existing_type=sa.LargeBinary(), existing_nullable=False
        )
    op.drop_table("upload_piece")
