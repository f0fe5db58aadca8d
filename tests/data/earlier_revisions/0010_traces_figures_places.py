"""Traces that jobs carry, figures beside results, arrays outside of the database.

Revision 0010, after 0009. An array with a `size` is in the store of arrays and has no bytes here. Results of
earlier versions have no figures: those are read from the whole. Columns are added alone: no table of results
is written anew.
"""

from __future__ import annotations

import sqlalchemy as sa
from alembic import op

revision = "0010"
down_revision = "0009"
branch_labels = None
depends_on = None


def upgrade() -> None:
    """To this revision."""
    op.add_column("job", sa.Column("trace", sa.String(64), nullable=True))
    op.add_column("job_result", sa.Column("figures", sa.JSON(none_as_null=True), nullable=True))
    op.add_column("sweep_array", sa.Column("size", sa.BigInteger(), nullable=True))


def downgrade() -> None:
    """Back to the one before; not with arrays outside of the database, which that could not read."""
    outside = sa.text("SELECT count(*) FROM sweep_array WHERE size IS NOT NULL")
    if op.get_bind().execute(outside).scalar_one():
        raise RuntimeError("arrays are outside of the database: an earlier version could not read them")
    op.drop_column("sweep_array", "size")
    op.drop_column("job_result", "figures")
    op.drop_column("job", "trace")
