"""The best design that a job knows while it is under way.

Revision 0007, after 0006. Of the jobs that are there none is known.
"""

from __future__ import annotations

import sqlalchemy as sa
from alembic import op

revision = "0007"
down_revision = "0006"
branch_labels = None
depends_on = None


def upgrade() -> None:
    """To this revision."""
    # Not in a batch: SQLite adds such a column without copying the table.
    op.add_column("job", sa.Column("best", sa.JSON(none_as_null=True), nullable=True))


def downgrade() -> None:
    """Back to the one before."""
    with op.batch_alter_table("job") as job:
        job.drop_column("best")
