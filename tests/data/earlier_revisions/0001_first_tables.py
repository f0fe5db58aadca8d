"""First tables.

Revision 0001, after nothing.
"""

from __future__ import annotations

import sqlalchemy as sa
from alembic import op

revision = "0001"
down_revision = None
branch_labels = None
depends_on = None


def upgrade() -> None:
    """To this revision."""
    _create_job()
    _create_job_result()
    _create_scene()
    _create_sweep()
    _create_sweep_contact()
    _create_sweep_array()


def downgrade() -> None:
    """Back to an empty database."""
    for table in ("sweep_array", "sweep_contact", "sweep", "scene", "job_result", "job"):
        op.drop_table(table)


def _create_job() -> None:
    op.create_table(
        "job",
        sa.Column("id", sa.String(length=36), nullable=False),
        sa.Column("kind", sa.String(length=32), nullable=False),
        sa.Column(
            "state",
            sa.Enum(
                "accepted",
                "running",
                "successful",
                "failed",
                "dismissed",
                name="state",
                native_enum=False,
                create_constraint=True,
                length=16,
            ),
            nullable=False,
        ),
        sa.Column("priority", sa.Integer(), nullable=False),
        sa.Column("scene_name", sa.String(length=200), nullable=True),
        sa.Column("scene_hash", sa.String(length=64), nullable=True),
        sa.Column("spec_hash", sa.String(length=64), nullable=False),
        sa.Column("request_hash", sa.String(length=64), nullable=False),
        sa.Column("idempotency_key", sa.String(length=200), nullable=True),
        sa.Column("attempt", sa.Integer(), nullable=False),
        sa.Column("max_attempts", sa.Integer(), nullable=False),
        sa.Column("lease_owner", sa.String(length=200), nullable=True),
        sa.Column("lease_until", sa.DateTime(timezone=True), nullable=True),
        sa.Column("cancel_requested", sa.Boolean(), nullable=False),
        sa.Column("progress", sa.Double(), nullable=False),
        sa.Column("points", sa.Integer(), nullable=False),
        sa.Column("created", sa.DateTime(timezone=True), nullable=False),
        sa.Column("started", sa.DateTime(timezone=True), nullable=True),
        sa.Column("finished", sa.DateTime(timezone=True), nullable=True),
        sa.Column("result_of", sa.String(length=36), nullable=True),
        sa.Column("error", sa.JSON(), nullable=True),
        sa.Column("request", sa.JSON(), nullable=False),
        sa.Column("spec", sa.JSON(), nullable=False),
        sa.CheckConstraint("(state = 'running') = (lease_owner IS NOT NULL)", name=op.f("ck_job_lease")),
        sa.CheckConstraint("attempt >= 0 AND max_attempts >= 1", name=op.f("ck_job_attempts")),
        sa.ForeignKeyConstraint(["result_of"], ["job.id"], name=op.f("fk_job_result_of_job")),
        sa.PrimaryKeyConstraint("id", name=op.f("pk_job")),
        sa.UniqueConstraint("idempotency_key", name=op.f("uq_job_idempotency_key")),
    )
    op.create_index("ix_job_kind_id", "job", ["kind", "id"])
    op.create_index("ix_job_result_of", "job", ["result_of"])
    op.create_index("ix_job_scene_name_id", "job", ["scene_name", "id"])
    op.create_index("ix_job_spec_hash_state", "job", ["spec_hash", "state"])
    op.create_index("ix_job_state_priority_id", "job", ["state", "priority", "id"])


def _create_scene() -> None:
    op.create_table(
        "scene",
        sa.Column("name", sa.String(length=200), nullable=False),
        sa.Column("scene_hash", sa.String(length=64), nullable=False),
        sa.Column("created", sa.DateTime(timezone=True), nullable=False),
        sa.Column("body", sa.JSON(), nullable=False),
        sa.PrimaryKeyConstraint("name", name=op.f("pk_scene")),
    )


def _create_job_result() -> None:
    op.create_table(
        "job_result",
        sa.Column("job_id", sa.String(length=36), nullable=False),
        sa.Column("body", sa.JSON(), nullable=False),
        sa.ForeignKeyConstraint(
            ["job_id"], ["job.id"], name=op.f("fk_job_result_job_id_job"), ondelete="CASCADE"
        ),
        sa.PrimaryKeyConstraint("job_id", name=op.f("pk_job_result")),
    )


def _create_sweep() -> None:
    op.create_table(
        "sweep",
        sa.Column("id", sa.String(length=36), nullable=False),
        sa.Column("job_id", sa.String(length=36), nullable=False),
        sa.Column("position", sa.Integer(), nullable=False),
        sa.Column("scene_name", sa.String(length=200), nullable=False),
        sa.Column("scene_hash", sa.String(length=64), nullable=False),
        sa.Column("parameter", sa.String(length=200), nullable=False),
        sa.Column("from_value", sa.Double(), nullable=False),
        sa.Column("to_value", sa.Double(), nullable=False),
        sa.Column("frequency_hz", sa.Double(), nullable=True),
        sa.Column("excitation_amplitude", sa.Double(), nullable=True),
        sa.Column("harmonics", sa.Integer(), nullable=False),
        sa.Column("points", sa.Integer(), nullable=False),
        sa.Column("peak", sa.Double(), nullable=True),
        sa.Column("peak_at", sa.Double(), nullable=True),
        sa.Column("limit", sa.Double(), nullable=True),
        sa.Column("band_hz", sa.Double(), nullable=True),
        sa.Column("newton_iterations", sa.Integer(), nullable=False),
        sa.Column("rejected_steps", sa.Integer(), nullable=False),
        sa.Column("seconds", sa.Double(), nullable=False),
        sa.Column("completed", sa.Boolean(), nullable=False),
        sa.Column("status", sa.Text(), nullable=False),
        sa.Column("created", sa.DateTime(timezone=True), nullable=False),
        sa.ForeignKeyConstraint(["job_id"], ["job.id"], name=op.f("fk_sweep_job_id_job"), ondelete="CASCADE"),
        sa.PrimaryKeyConstraint("id", name=op.f("pk_sweep")),
    )
    op.create_index("ix_sweep_band_hz_id", "sweep", ["band_hz", "id"])
    op.create_index("ix_sweep_harmonics_id", "sweep", ["harmonics", "id"])
    op.create_index("ix_sweep_job_id_id", "sweep", ["job_id", "id"])
    op.create_index("ix_sweep_parameter_id", "sweep", ["parameter", "id"])
    op.create_index("ix_sweep_peak_at_id", "sweep", ["peak_at", "id"])
    op.create_index("ix_sweep_peak_id", "sweep", ["peak", "id"])
    op.create_index("ix_sweep_points_id", "sweep", ["points", "id"])
    op.create_index("ix_sweep_completed_id", "sweep", ["completed", "id"])
    op.create_index("ix_sweep_scene_hash_id", "sweep", ["scene_hash", "id"])
    op.create_index("ix_sweep_scene_name_id", "sweep", ["scene_name", "id"])
    op.create_index("ix_sweep_scene_name_peak_id", "sweep", ["scene_name", "peak", "id"])
    op.create_index("ix_sweep_seconds_id", "sweep", ["seconds", "id"])


def _create_sweep_array() -> None:
    op.create_table(
        "sweep_array",
        sa.Column("sweep_id", sa.String(length=36), nullable=False),
        sa.Column("name", sa.String(length=64), nullable=False),
        sa.Column("sha256", sa.String(length=64), nullable=False),
        sa.Column("data", sa.LargeBinary(), nullable=False),
        sa.ForeignKeyConstraint(
            ["sweep_id"], ["sweep.id"], name=op.f("fk_sweep_array_sweep_id_sweep"), ondelete="CASCADE"
        ),
        sa.PrimaryKeyConstraint("sweep_id", "name", name=op.f("pk_sweep_array")),
    )


def _create_sweep_contact() -> None:
    op.create_table(
        "sweep_contact",
        sa.Column("sweep_id", sa.String(length=36), nullable=False),
        sa.Column("name", sa.String(length=200), nullable=False),
        sa.Column("position", sa.Integer(), nullable=False),
        sa.Column("kt", sa.Double(), nullable=True),
        sa.Column("mu", sa.Double(), nullable=True),
        sa.Column("N0", sa.Double(), nullable=True),
        sa.Column("N1", sa.Double(), nullable=True),
        sa.Column("N1_phase", sa.Double(), nullable=True),
        sa.ForeignKeyConstraint(
            ["sweep_id"], ["sweep.id"], name=op.f("fk_sweep_contact_sweep_id_sweep"), ondelete="CASCADE"
        ),
        sa.PrimaryKeyConstraint("sweep_id", "name", name=op.f("pk_sweep_contact")),
    )
    op.create_index("ix_sweep_contact_N0_name_sweep_id", "sweep_contact", ["N0", "name", "sweep_id"])
    op.create_index("ix_sweep_contact_name_N0_sweep_id", "sweep_contact", ["name", "N0", "sweep_id"])
