"""Designs, to be queried; those of finished jobs are filled in.

Revision 0002, after 0001.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from typing import Any

import sqlalchemy as sa
from alembic import op

revision = "0002"
down_revision = "0001"
branch_labels = None
depends_on = None

_BATCH = 200
_KEPT = 1e-6  # relative excess over a limit up to which it counts as kept
_PLAIN = ("scene_hash", "method", "robust", "reached", "feasible", "objective", "peak", "peak_at", "band_hz",
          "work", "seconds")  # fmt: skip

_job = sa.table(
    "job",
    sa.column("id", sa.String), sa.column("kind", sa.String), sa.column("scene_name", sa.String),
    sa.column("scene_hash", sa.String), sa.column("created", sa.DateTime(timezone=True)),
    sa.column("finished", sa.DateTime(timezone=True)), sa.column("spec", sa.JSON),
)  # fmt: skip
_result = sa.table("job_result", sa.column("job_id", sa.String), sa.column("body", sa.JSON))


def upgrade() -> None:
    """To this revision."""
    design, variable = _create_design(), _create_design_variable()
    for designs, variables in _found():
        op.bulk_insert(design, designs)
        if variables:
            op.bulk_insert(variable, variables)


def downgrade() -> None:
    """Back to the one before; the results of the jobs stay."""
    for table in ("design_variable", "design"):
        op.drop_table(table)


def _create_design() -> sa.Table:
    table = op.create_table(
        "design",
        sa.Column("job_id", sa.String(length=36), nullable=False),
        sa.Column("scene_name", sa.String(length=200), nullable=False),
        sa.Column("scene_hash", sa.String(length=64), nullable=False),
        sa.Column("method", sa.String(length=32), nullable=False),
        sa.Column("robust", sa.Boolean(), nullable=False),
        sa.Column("reached", sa.Boolean(), nullable=False),
        sa.Column("feasible", sa.Boolean(), nullable=False),
        sa.Column("status", sa.Text(), nullable=False),
        sa.Column("objective", sa.Double(), nullable=True),
        sa.Column("peak", sa.Double(), nullable=True),
        sa.Column("peak_at", sa.Double(), nullable=True),
        sa.Column("limit", sa.Double(), nullable=True),
        sa.Column("band_hz", sa.Double(), nullable=True),
        sa.Column("harmonics", sa.Integer(), nullable=False),
        sa.Column("evaluations", sa.Integer(), nullable=False),
        sa.Column("work", sa.Double(), nullable=True),
        sa.Column("seconds", sa.Double(), nullable=False),
        sa.Column("created", sa.DateTime(timezone=True), nullable=False),
        sa.ForeignKeyConstraint(
            ["job_id"], ["job.id"], name=op.f("fk_design_job_id_job"), ondelete="CASCADE"
        ),
        sa.PrimaryKeyConstraint("job_id", name=op.f("pk_design")),
    )
    op.create_index("ix_design_scene_name_job_id", "design", ["scene_name", "job_id"])
    op.create_index("ix_design_scene_name_peak_job_id", "design", ["scene_name", "peak", "job_id"])
    for name in _PLAIN:
        op.create_index(f"ix_design_{name}_job_id", "design", [name, "job_id"])
    return table


def _create_design_variable() -> sa.Table:
    table = op.create_table(
        "design_variable",
        sa.Column("design_id", sa.String(length=36), nullable=False),
        sa.Column("name", sa.String(length=500), nullable=False),
        sa.Column("position", sa.Integer(), nullable=False),
        sa.Column("value", sa.Double(), nullable=True),
        sa.Column("low", sa.Double(), nullable=False),
        sa.Column("high", sa.Double(), nullable=False),
        sa.ForeignKeyConstraint(
            ["design_id"], ["design.job_id"], name=op.f("fk_design_variable_design_id_design"),
            ondelete="CASCADE",
        ),
        sa.PrimaryKeyConstraint("design_id", "name", name=op.f("pk_design_variable")),
    )  # fmt: skip
    op.create_index(
        "ix_design_variable_name_value_design_id", "design_variable", ["name", "value", "design_id"]
    )
    op.create_index(
        "ix_design_variable_value_name_design_id", "design_variable", ["value", "name", "design_id"]
    )
    return table


def _found() -> Iterator[tuple[list[dict[str, Any]], list[dict[str, Any]]]]:
    """The rows of every design job with a result, in batches: a result is large."""
    connection, last = op.get_bind(), ""
    query = (
        sa.select(
            _job.c.id, _job.c.scene_name, _job.c.scene_hash, _job.c.created, _job.c.finished, _job.c.spec,
            _result.c.body,
        )
        .join(_result, _result.c.job_id == _job.c.id)
        .where(_job.c.kind == "design")
        .order_by(_job.c.id)
        .limit(_BATCH)
    )  # fmt: skip
    while rows := connection.execute(query.where(_job.c.id > last)).all():
        last = rows[-1].id
        yield [_design(row) for row in rows], [one for row in rows for one in _variables(row)]


def _design(row: sa.Row[Any]) -> dict[str, Any]:
    """The row of a design from its job's result; a first version knew one method and minimised the peak."""
    body: Mapping[str, Any] = row.body
    peak: Mapping[str, Any] = body.get("peak") or {}
    return {
        "job_id": row.id, "scene_name": row.scene_name or body.get("scene") or "",
        "scene_hash": row.scene_hash or "", "method": body.get("method", "minimax"), "robust": False,
        "reached": bool(body.get("reached", False)), "feasible": _feasible(row.spec, body),
        "status": body.get("status", ""), "objective": body.get("objective", peak.get("value")),
        "peak": peak.get("value"), "peak_at": peak.get("at"), "limit": body.get("limit"),
        "band_hz": body.get("band_hz"), "harmonics": row.spec.get("harmonics", 11),
        "evaluations": body.get("evaluations", 0), "work": body.get("work"),
        "seconds": body.get("seconds", 0.0), "created": row.finished or row.created,
    }  # fmt: skip


def _feasible(spec: Mapping[str, Any], body: Mapping[str, Any]) -> bool:
    """Whether a design was found that keeps every limit; the band was the only one at first."""
    if body.get("peak") is None:
        return False
    conditions = body.get("conditions")
    if conditions is not None:
        return bool(conditions["violation"] <= _KEPT)
    most, band = spec.get("max_band_hz"), body.get("band_hz")
    return most is None or (band is not None and band <= most * (1.0 + _KEPT))


def _variables(row: sa.Row[Any]) -> list[dict[str, Any]]:
    optimum: Mapping[str, Any] = row.body.get("optimum", {})
    return [
        {
            "design_id": row.id, "name": name, "position": position, "value": optimum.get(name),
            "low": low, "high": high,
        }
        for position, (name, (low, high)) in enumerate(row.spec.get("variables", {}).items())
    ]  # fmt: skip
