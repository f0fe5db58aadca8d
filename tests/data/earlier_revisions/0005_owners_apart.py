"""Owners take turns in the queue, what they store is counted, and results carry a checksum.

Revision 0005, after 0004. What is there is counted once; its results have no checksum.
"""

from __future__ import annotations

import sqlalchemy as sa
from alembic import op

revision = "0005"
down_revision = "0004"
branch_labels = None
depends_on = None

_OLD_INDEX, _OLD_COLUMNS = "ix_job_state_priority_id", ["state", "priority", "id"]
_INDEX, _COLUMNS = "ix_job_state_owner_priority_id", ["state", "owner", "priority", "id"]
_OLD_KNOWN, _KNOWN = "ix_job_spec_hash_state", "ix_job_spec_hash_state_owner"
_STORED = "ix_job_owner_stored_bytes"
_COUNT_JOBS = """
    UPDATE job SET stored_bytes =
        length(CAST(request AS TEXT)) + length(CAST(spec AS TEXT))
        + coalesce((SELECT length(CAST(body AS TEXT)) FROM job_result WHERE job_id = job.id), 0)
        + coalesce((SELECT sum(length(data)) FROM sweep_array JOIN sweep ON sweep.id = sweep_array.sweep_id
                    WHERE sweep.job_id = job.id), 0)
"""
_COUNT_SCENES = "UPDATE scene SET size = length(CAST(body AS TEXT))"


def upgrade() -> None:
    """To this revision."""
    number = sa.Column("stored_bytes", sa.BigInteger(), nullable=False, server_default="0")
    with op.batch_alter_table("job") as job:
        job.add_column(number)
        job.drop_index(_OLD_INDEX)
        job.create_index(_INDEX, _COLUMNS)
        job.drop_index(_OLD_KNOWN)
        job.create_index(_KNOWN, ["spec_hash", "state", "owner"])
        job.create_index(_STORED, ["owner", "stored_bytes"])
    with op.batch_alter_table("scene") as scene:
        scene.add_column(sa.Column("size", sa.BigInteger(), nullable=False, server_default="0"))
    with op.batch_alter_table("job_result") as result:
        result.add_column(sa.Column("sha256", sa.String(64), nullable=True))
    op.execute(_COUNT_JOBS)
    op.execute(_COUNT_SCENES)


def downgrade() -> None:
    """Back to the one before."""
    with op.batch_alter_table("job_result") as result:
        result.drop_column("sha256")
    with op.batch_alter_table("scene") as scene:
        scene.drop_column("size")
    with op.batch_alter_table("job") as job:
        job.drop_index(_STORED)
        job.drop_index(_KNOWN)
        job.create_index(_OLD_KNOWN, ["spec_hash", "state"])
        job.drop_index(_INDEX)
        job.create_index(_OLD_INDEX, _OLD_COLUMNS)
        job.drop_column("stored_bytes")
