"""The estimated error of a sweep, and whether a higher peak may hide between its points.

Revision 0004, after 0003. Of what is there neither is known.
"""

from __future__ import annotations

import sqlalchemy as sa
from alembic import op

revision = "0004"
down_revision = "0003"
branch_labels = None
depends_on = None


def upgrade() -> None:
    """To this revision."""
    with op.batch_alter_table("sweep") as sweep:
        sweep.add_column(sa.Column("error_estimate", sa.Double(), nullable=True))
        sweep.add_column(sa.Column("peaks_known", sa.Boolean(), nullable=True))


def downgrade() -> None:
    """Back to the one before."""
    with op.batch_alter_table("sweep") as sweep:
        sweep.drop_column("peaks_known")
        sweep.drop_column("error_estimate")
