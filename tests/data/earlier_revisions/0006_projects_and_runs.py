"""Projects, what people say of their runs, links that share a run; which sweeps are steps on the way.

Revision 0006, after 0005. Nothing is said of the runs that are there. Their sweeps are steps on the way to
another result if the kind of their job is one that computes them for that.
"""

from __future__ import annotations

import sqlalchemy as sa
from alembic import op

revision = "0006"
down_revision = "0005"
branch_labels = None
depends_on = None

_ON_THE_WAY = """
    UPDATE sweep SET intermediate = :yes WHERE job_id IN
        (SELECT id FROM job WHERE kind IN ('accuracy', 'design', 'map', 'pareto', 'peaks'))
"""


def upgrade() -> None:
    """To this revision."""
    _create_project()
    _create_run()
    _create_share()
    # Not in a batch: SQLite adds such a column without copying the table.
    op.add_column("sweep", sa.Column("intermediate", sa.Boolean(), nullable=False, server_default=sa.false()))
    op.create_index("ix_sweep_intermediate_id", "sweep", ["intermediate", "id"])
    op.execute(sa.text(_ON_THE_WAY).bindparams(sa.bindparam("yes", True, sa.Boolean())))


def downgrade() -> None:
    """Back to the one before; what was said of runs is forgotten, and what was in the bin is not any more."""
    op.drop_index("ix_sweep_intermediate_id", "sweep")
    with op.batch_alter_table("sweep") as sweep:
        sweep.drop_column("intermediate")
    for table in ("share", "run_tag", "run", "project"):
        op.drop_table(table)


def _create_project() -> None:
    op.create_table(
        "project",
        sa.Column("id", sa.String(length=36), nullable=False),
        sa.Column("owner", sa.String(length=100), nullable=False),
        sa.Column("name", sa.String(length=200), nullable=False),
        sa.Column("notes", sa.Text(), nullable=False),
        sa.Column("created", sa.DateTime(timezone=True), nullable=False),
        sa.Column("changed", sa.DateTime(timezone=True), nullable=False),
        sa.Column("revision", sa.Integer(), nullable=False),
        sa.Column("deleted", sa.DateTime(timezone=True), nullable=True),
        sa.PrimaryKeyConstraint("id", name=op.f("pk_project")),
    )
    op.create_index("ix_project_owner_id", "project", ["owner", "id"])
    op.create_index("ix_project_deleted_id", "project", ["deleted", "id"])


def _create_run() -> None:
    op.create_table(
        "run",
        sa.Column("job_id", sa.String(length=36), nullable=False),
        sa.Column("project_id", sa.String(length=36), nullable=True),
        sa.Column("name", sa.String(length=200), nullable=False),
        sa.Column("notes", sa.Text(), nullable=False),
        sa.Column("changed", sa.DateTime(timezone=True), nullable=False),
        sa.Column("revision", sa.Integer(), nullable=False),
        sa.Column("deleted", sa.DateTime(timezone=True), nullable=True),
        sa.ForeignKeyConstraint(["job_id"], ["job.id"], name=op.f("fk_run_job_id_job"), ondelete="CASCADE"),
        sa.ForeignKeyConstraint(
            ["project_id"], ["project.id"], name=op.f("fk_run_project_id_project"), ondelete="SET NULL"
        ),
        sa.PrimaryKeyConstraint("job_id", name=op.f("pk_run")),
    )
    op.create_index("ix_run_project_id_job_id", "run", ["project_id", "job_id"])
    op.create_index("ix_run_deleted_job_id", "run", ["deleted", "job_id"])
    op.create_table(
        "run_tag",
        sa.Column("job_id", sa.String(length=36), nullable=False),
        sa.Column("tag", sa.String(length=50), nullable=False),
        sa.ForeignKeyConstraint(
            ["job_id"], ["run.job_id"], name=op.f("fk_run_tag_job_id_run"), ondelete="CASCADE"
        ),
        sa.PrimaryKeyConstraint("job_id", "tag", name=op.f("pk_run_tag")),
    )
    op.create_index("ix_run_tag_tag_job_id", "run_tag", ["tag", "job_id"])


def _create_share() -> None:
    op.create_table(
        "share",
        sa.Column("id", sa.String(length=36), nullable=False),
        sa.Column("job_id", sa.String(length=36), nullable=False),
        sa.Column("digest", sa.String(length=64), nullable=False),
        sa.Column("created", sa.DateTime(timezone=True), nullable=False),
        sa.Column("expires", sa.DateTime(timezone=True), nullable=True),
        sa.ForeignKeyConstraint(["job_id"], ["job.id"], name=op.f("fk_share_job_id_job"), ondelete="CASCADE"),
        sa.PrimaryKeyConstraint("id", name=op.f("pk_share")),
    )
    op.create_index("ix_share_job_id_id", "share", ["job_id", "id"])
    op.create_index("ix_share_expires_id", "share", ["expires", "id"])
