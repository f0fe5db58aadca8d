"""Owners of what is stored, keys, checkpoints of long jobs, uploads.

Revision 0003, after 0002. What is there belongs to nobody: to whoever uses the service without a key, and to
keys with the scope `admin`.
"""

from __future__ import annotations

import sqlalchemy as sa
from alembic import op

revision = "0003"
down_revision = "0002"
branch_labels = None
depends_on = None


def upgrade() -> None:
    """To this revision."""
    with op.batch_alter_table("job") as job:
        job.add_column(_owner())
        job.add_column(sa.Column("seconds_limit", sa.Double(), nullable=True))
        job.drop_constraint("uq_job_idempotency_key", type_="unique")
        job.create_unique_constraint("uq_job_owner_idempotency_key", ["owner", "idempotency_key"])
        job.create_index("ix_job_owner_id", ["owner", "id"])
    for table, key in (("sweep", "id"), ("design", "job_id")):
        with op.batch_alter_table(table) as rows:
            rows.add_column(_owner())
            rows.create_index(f"ix_{table}_owner_{key}", ["owner", key])
    with op.batch_alter_table("scene") as scene:
        scene.add_column(_owner())
        scene.drop_constraint("pk_scene", type_="primary")
        scene.create_primary_key("pk_scene", ["owner", "name"])
    _create_checkpoint()
    _create_api_key()
    _create_upload()


def downgrade() -> None:
    """Back to the one before; what a key made belongs to everybody again.

    Of several scenes of one name the first one's stays, and of several jobs of one Idempotency-Key the first
    keeps it.
    """
    for table in ("upload", "api_key", "checkpoint"):
        op.drop_table(table)
    op.execute(
        "UPDATE job SET idempotency_key = NULL WHERE id NOT IN "
        "(SELECT MIN(id) FROM job WHERE idempotency_key IS NOT NULL GROUP BY idempotency_key)"
    )
    op.execute(
        "DELETE FROM scene WHERE EXISTS "
        "(SELECT 1 FROM scene AS other WHERE other.name = scene.name AND other.owner < scene.owner)"
    )
    with op.batch_alter_table("scene") as scene:
        scene.drop_constraint("pk_scene", type_="primary")
        scene.create_primary_key("pk_scene", ["name"])
        scene.drop_column("owner")
    for table, key in (("design", "job_id"), ("sweep", "id")):
        op.drop_index(f"ix_{table}_owner_{key}", table)
        with op.batch_alter_table(table) as rows:
            rows.drop_column("owner")
    op.drop_index("ix_job_owner_id", "job")
    with op.batch_alter_table("job") as job:
        job.drop_constraint("uq_job_owner_idempotency_key", type_="unique")
        job.create_unique_constraint("uq_job_idempotency_key", ["idempotency_key"])
        job.drop_column("seconds_limit")
        job.drop_column("owner")


def _owner() -> sa.Column[str]:
    return sa.Column("owner", sa.String(length=100), nullable=False, server_default="")


def _create_checkpoint() -> None:
    op.create_table(
        "checkpoint",
        sa.Column("job_id", sa.String(length=36), nullable=False),
        sa.Column("part", sa.Integer(), nullable=False),
        sa.Column("attempt", sa.Integer(), nullable=False),
        sa.Column("created", sa.DateTime(timezone=True), nullable=False),
        sa.Column("sha256", sa.String(length=64), nullable=False),
        sa.Column("data", sa.LargeBinary(), nullable=False),
        sa.ForeignKeyConstraint(
            ["job_id"], ["job.id"], name=op.f("fk_checkpoint_job_id_job"), ondelete="CASCADE"
        ),
        sa.PrimaryKeyConstraint("job_id", "part", name=op.f("pk_checkpoint")),
    )


def _create_api_key() -> None:
    op.create_table(
        "api_key",
        sa.Column("id", sa.String(length=36), nullable=False),
        sa.Column("owner", sa.String(length=100), nullable=False),
        sa.Column("scopes", sa.JSON(), nullable=False),
        sa.Column("digest", sa.String(length=64), nullable=False),
        sa.Column("limits", sa.JSON(), nullable=False),
        sa.Column("created", sa.DateTime(timezone=True), nullable=False),
        sa.Column("expires", sa.DateTime(timezone=True), nullable=True),
        sa.Column("revoked", sa.DateTime(timezone=True), nullable=True),
        sa.Column("last_used", sa.DateTime(timezone=True), nullable=True),
        sa.PrimaryKeyConstraint("id", name=op.f("pk_api_key")),
    )
    op.create_index("ix_api_key_owner_id", "api_key", ["owner", "id"])


def _create_upload() -> None:
    op.create_table(
        "upload",
        sa.Column("id", sa.String(length=36), nullable=False),
        sa.Column("owner", sa.String(length=100), nullable=False),
        sa.Column("name", sa.String(length=200), nullable=False),
        sa.Column("format", sa.String(length=32), nullable=False),
        sa.Column("size", sa.Integer(), nullable=False),
        sa.Column("sha256", sa.String(length=64), nullable=False),
        sa.Column("created", sa.DateTime(timezone=True), nullable=False),
        sa.Column("data", sa.LargeBinary(), nullable=False),
        sa.PrimaryKeyConstraint("id", name=op.f("pk_upload")),
    )
    op.create_index("ix_upload_owner_id", "upload", ["owner", "id"])
