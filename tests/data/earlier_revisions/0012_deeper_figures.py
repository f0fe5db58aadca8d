"""Figures of results are one level deeper, so that a summary needs nothing of the result but them.

Revision 0012, after 0011. Those that an earlier version stored of designs, maps and fronts, whose peaks lie
there, are let go: they are read from the whole again. The version before reads either.
"""

from __future__ import annotations

from alembic import op

revision = "0012"
down_revision = "0011"
branch_labels = None
depends_on = None


def upgrade() -> None:
    """To this revision."""
    op.execute("""
        UPDATE job_result SET figures = NULL
        WHERE job_id IN (SELECT id FROM job WHERE kind IN ('design', 'map', 'pareto'))
    """)


def downgrade() -> None:
    """Back to the one before, which bears deeper figures."""
