"""Results with their figures in one table, in place of tables of sweeps and designs with a column for each.

Revision 0008, after 0007. What sweeps, designs and the results of other jobs have is filled in.
"""

from __future__ import annotations

import math
import re
from collections.abc import Iterator, Mapping
from typing import Any

import sqlalchemy as sa
from alembic import op

revision = "0008"
down_revision = "0007"
branch_labels = None
depends_on = None

_BATCH = 200
_WORD = re.compile(r"\S{1,64}")
_CONTACT = ("kt", "mu", "N0", "N1", "N1_phase")
_VARIABLE = ("value", "low", "high")
_SHARED = ("job_id", "owner", "scene_name", "scene_hash", "status", "created")
_SWEEP: dict[str, type[Any]] = {
    "from_value": float, "to_value": float, "frequency_hz": float, "excitation_amplitude": float,
    "harmonics": int, "points": int, "peak": float, "peak_at": float, "limit": float, "band_hz": float,
    "error_estimate": float, "peaks_known": bool, "newton_iterations": int, "rejected_steps": int,
    "seconds": float, "completed": bool, "intermediate": bool, "parameter": str,
}  # fmt: skip
_DESIGN: dict[str, type[Any]] = {
    "method": str, "robust": bool, "reached": bool, "feasible": bool, "objective": float, "peak": float,
    "peak_at": float, "limit": float, "band_hz": float, "harmonics": int, "evaluations": int, "work": float,
    "seconds": float,
}  # fmt: skip
_MAY_BE_NULL = {
    "frequency_hz", "excitation_amplitude", "peak", "peak_at", "limit", "band_hz", "error_estimate",
    "peaks_known", "objective", "work",
}  # fmt: skip
_TYPES = {float: sa.Double(), int: sa.Integer(), bool: sa.Boolean()}


def _table(name: str, *columns: str, **typed: type[Any]) -> Any:
    found = [sa.column(one) for one in columns]
    return sa.table(
        name, *found, *(sa.column(key, _TYPES.get(kind, sa.String())) for key, kind in typed.items())
    )


_result = _table("result", "number", "id", "of", "position", *_SHARED)
_quantity = _table("quantity", "id", "of", "name", "label")
_figure = _table("figure", "quantity", "value", "result")
_sweep = _table("sweep", "id", "position", *_SHARED, **_SWEEP)
_contact = _table("sweep_contact", "sweep_id", "name", "position", *_CONTACT)
_design = _table("design", *_SHARED, **_DESIGN)
_variable = _table("design_variable", "design_id", "name", "position", *_VARIABLE)
_job = sa.table(
    "job", *(sa.column(name) for name in ("id", "kind", "owner", "scene_name", "scene_hash")),
    sa.column("created", sa.DateTime(timezone=True)), sa.column("finished", sa.DateTime(timezone=True)),
)  # fmt: skip
_body = sa.table("job_result", sa.column("job_id"), sa.column("body", sa.JSON()))


def upgrade() -> None:
    """To this revision."""
    _create_results()
    for of, table, key, position in (
        ("sweep", _sweep, _sweep.c.id, _sweep.c.position),
        ("design", _design, _design.c.job_id, sa.literal(0)),
    ):
        shared = [table.c[name] for name in _SHARED]
        rows = sa.select(key, sa.literal(of, sa.String()), position, *shared).order_by(key)
        op.execute(sa.insert(_result).from_select(["id", "of", "position", *_SHARED], rows))
    for name, kind in _SWEEP.items():
        _copy("sweep", _sweep, _sweep.c.id, name, kind)
    for name, kind in _DESIGN.items():
        _copy("design", _design, _design.c.job_id, name, kind)
    _copy_parts("sweep", "contact", _contact, _contact.c.sweep_id, _CONTACT)
    _copy_parts("design", "variable", _variable, _variable.c.design_id, _VARIABLE)
    _fill_in_the_others()
    for name in ("sweep_contact", "design_variable", "design"):
        op.drop_table(name)
    _refer_to("result", "sweep")


def downgrade() -> None:
    """Back to the one before; the results of the jobs stay."""
    _create_sweep()
    _create_parts("sweep", "id", "contact", 200, _CONTACT, _CONTACT, "N0")
    _create_design()
    _create_parts("design", "job_id", "variable", 500, _VARIABLE, ("value",), "value")
    columns = {name: _value("sweep", name, kind) for name, kind in _SWEEP.items()}
    columns |= {name: _result.c[name] for name in ("id", "position", *_SHARED)}
    _put_back("sweep", _sweep, columns)
    columns = {name: _value("design", name, kind) for name, kind in _DESIGN.items()}
    _put_back("design", _design, columns | {name: _result.c[name] for name in _SHARED})
    _put_parts_back("sweep", "contact", _contact, "sweep_id", _CONTACT)
    _put_parts_back("design", "variable", _variable, "design_id", _VARIABLE)
    for name in ("figure", "quantity"):
        op.drop_table(name)
    _refer_to("sweep", "result")


def _refer_to(new: str, old: str) -> None:
    """Have the arrays refer to the ids of a table in place of another one, which goes.

    SQLite keeps references by name, and they follow a table that is renamed: the arrays, gigabytes of them,
    are not copied.
    """
    if op.get_bind().dialect.name == "sqlite":
        op.drop_table(old)
        op.rename_table(new, old)
        op.rename_table(old, new)
        return
    op.drop_constraint(f"fk_sweep_array_sweep_id_{old}", "sweep_array", type_="foreignkey")
    op.drop_table(old)
    name = f"fk_sweep_array_sweep_id_{new}"
    op.create_foreign_key(name, "sweep_array", new, ["sweep_id"], ["id"], ondelete="CASCADE")


def _number(column: Any, kind: type[Any]) -> Any:
    return sa.case((column.is_(None), None), (column, 1.0), else_=0.0) if kind is bool else column


def _copy(of: str, table: Any, key: Any, name: str, kind: type[Any], label: Any = None) -> None:
    """Copy a column to the figures; of a word the label is the word, of a part its name."""
    word = table.c[name] if kind is str else sa.literal("", sa.String()) if label is None else label
    value = sa.literal(0.0, sa.Double()) if kind is str else _number(table.c[name], kind)
    there = table.c[name].is_not(None)
    what = sa.select(sa.literal(of, sa.String()), sa.literal(name, sa.String()), word).where(there).distinct()
    op.execute(sa.insert(_quantity).from_select(["of", "name", "label"], what))
    same = sa.and_(_quantity.c.of == of, _quantity.c.name == name, _quantity.c.label == word)
    figures = (
        sa.select(_quantity.c.id, value, _result.c.number)
        .select_from(table)
        .join(_result, sa.and_(_result.c.id == key, _result.c.of == of))
        .join(_quantity, same)
        .where(there)
    )
    op.execute(sa.insert(_figure).from_select(["quantity", "value", "result"], figures))


def _copy_parts(of: str, part: str, table: Any, key: Any, names: tuple[str, ...]) -> None:
    for name in names:
        _copy(of, table, key, name, float, table.c.name)
    placed = sa.select(*table.c, table.c.position.label(part)).subquery("placed")
    _copy(of, placed, placed.c[key.name], part, float, placed.c.name)


def _fill_in_the_others() -> None:
    """The results of jobs of other kinds."""
    bind, last = op.get_bind(), ""
    query = (
        sa.select(*_job.c, _body.c.body)
        .join(_body, _body.c.job_id == _job.c.id)
        .where(_job.c.kind.not_in(("sweep", "design")))
        .order_by(_job.c.id)
        .limit(_BATCH)
    )
    known: dict[tuple[str, str, str], int] = {}
    while rows := bind.execute(query.where(_job.c.id > last)).all():
        last = rows[-1].id
        for row in rows:
            status = str(row.body.get("status") or "")
            about = {"id": row.id, "of": row.kind, "position": 0, "job_id": row.id, "owner": row.owner,
                     "scene_name": row.scene_name, "scene_hash": row.scene_hash, "status": status,
                     "created": row.finished or row.created}  # fmt: skip
            bind.execute(sa.insert(_typed()), about)
            number = bind.execute(sa.select(_result.c.number).where(_result.c.id == row.id)).scalar_one()
            figures = []
            for name, label, value in _figures(row.body):
                quantity = row.kind, name, label
                if quantity not in known:
                    known[quantity] = _new_quantity(*quantity)
                figures.append({"quantity": known[quantity], "value": value, "result": number})
            if figures:
                bind.execute(sa.insert(_figure), figures)


def _typed() -> Any:
    """The table of results, whose times are bound as times."""
    columns = [sa.column(c.name) for c in _result.c if c.name not in ("number", "created")]
    return sa.table("result", *columns, sa.column("created", sa.DateTime(timezone=True)))


def _new_quantity(of: str, name: str, label: str) -> int:
    bind = op.get_bind()
    bind.execute(sa.insert(_quantity), {"of": of, "name": name, "label": label})
    same = (_quantity.c.of == of, _quantity.c.name == name, _quantity.c.label == label)
    found: int = bind.execute(sa.select(_quantity.c.id).where(*same)).scalar_one()
    return found


def _figures(table: Mapping[str, Any]) -> Iterator[tuple[str, str, float]]:
    """What stands alone in a result: numbers, truths, single words, and peaks."""
    for name, value in table.items():
        if name in ("scene", "status") or len(name) > 200:
            continue
        if isinstance(value, bool | int | float) and math.isfinite(value):
            yield name, "", float(value)
        elif isinstance(value, str) and _WORD.fullmatch(value):
            yield name, value, 0.0
        elif isinstance(value, Mapping) and value.keys() == {"value", "at"}:
            yield from _figures({name: value["value"], f"{name}_at": value["at"]})


def _value(of: str, name: str, kind: type[Any], label: Any = "") -> Any:
    """A figure of a result as a column: of a word the word."""
    same = [_quantity.c.of == of, _quantity.c.name == name, _figure.c.result == _result.c.number]
    if kind is not str:
        same.append(_quantity.c.label == label)
    wanted = _quantity.c.label if kind is str else sa.cast(_figure.c.value, sa.Double())
    if kind is bool:
        wanted = _figure.c.value != 0.0
    query = sa.select(sa.cast(wanted, sa.Integer()) if kind is int else wanted)
    joined = query.select_from(_figure).join(_quantity, _quantity.c.id == _figure.c.quantity)
    return joined.where(*same).correlate(_result, _place).scalar_subquery()


_place = _quantity.alias("place")
"""Of a part."""


def _put_back(of: str, table: Any, columns: Mapping[str, Any]) -> None:
    rows = sa.select(*columns.values()).select_from(_result).where(_result.c.of == of)
    op.execute(sa.insert(table).from_select(list(columns), rows))


def _put_parts_back(of: str, part: str, table: Any, key: str, names: tuple[str, ...]) -> None:
    at = _figure.alias("at")
    columns = {key: _result.c.id, "name": _place.c.label, "position": sa.cast(at.c.value, sa.Integer())}
    columns |= {name: _value(of, name, float, _place.c.label) for name in names}
    rows = (
        sa.select(*columns.values())
        .select_from(_result)
        .join(at, at.c.result == _result.c.number)
        .join(_place, sa.and_(_place.c.id == at.c.quantity, _place.c.name == part))
        .where(_result.c.of == of)
    )
    op.execute(sa.insert(table).from_select(list(columns), rows))


def _create_results() -> None:
    number = sa.BigInteger().with_variant(sa.Integer(), "sqlite")
    op.create_table(
        "result",
        sa.Column("number", number, nullable=False),
        sa.Column("id", sa.String(length=36), nullable=False),
        sa.Column("of", sa.String(length=32), nullable=False),
        sa.Column("position", sa.Integer(), nullable=False),
        *_shared(may_be_null=True),
        sa.ForeignKeyConstraint(["job_id"], ["job.id"], name="fk_result_job_id_job", ondelete="CASCADE"),
        sa.PrimaryKeyConstraint("number", name="pk_result"),
        sa.UniqueConstraint("id", name="uq_result_id"),
    )
    alone = ("owner", "scene_name", "scene_hash")
    _index("result", ("job_id", "of"), ("of", "number"), *(("of", name, "number") for name in alone))
    op.create_table(
        "quantity",
        sa.Column("id", sa.Integer(), nullable=False),
        sa.Column("of", sa.String(length=32), nullable=False),
        sa.Column("name", sa.String(length=200), nullable=False),
        sa.Column("label", sa.String(length=500), nullable=False),
        sa.PrimaryKeyConstraint("id", name="pk_quantity"),
        sa.UniqueConstraint("of", "name", "label", name="uq_quantity_of_name_label"),
    )
    op.create_table(
        "figure",
        sa.Column("quantity", sa.Integer(), nullable=False),
        sa.Column("value", sa.Double(), nullable=False),
        sa.Column("result", number, nullable=False),
        sa.ForeignKeyConstraint(["quantity"], ["quantity.id"], name="fk_figure_quantity_quantity"),
        sa.ForeignKeyConstraint(
            ["result"], ["result.number"], name="fk_figure_result_result", ondelete="CASCADE"
        ),
        sa.PrimaryKeyConstraint("quantity", "value", "result", name="pk_figure"),
        sqlite_with_rowid=False,
    )
    op.create_index("ix_figure_result_quantity_value", "figure", ["result", "quantity", "value"])


def _shared(*, may_be_null: bool = False) -> Iterator[sa.Column[Any]]:
    yield sa.Column("job_id", sa.String(length=36), nullable=False)
    default = None if may_be_null else ""
    yield sa.Column("owner", sa.String(length=100), nullable=False, server_default=default)
    yield sa.Column("scene_name", sa.String(length=200), nullable=may_be_null)
    yield sa.Column("scene_hash", sa.String(length=64), nullable=may_be_null)
    yield sa.Column("status", sa.Text(), nullable=False)
    yield sa.Column("created", sa.DateTime(timezone=True), nullable=False)


def _own(columns: Mapping[str, type[Any]]) -> Iterator[sa.Column[Any]]:
    lengths = {"parameter": 200, "method": 32}
    for name, kind in columns.items():
        given = sa.String(length=lengths[name]) if kind is str else _TYPES[kind]
        default = sa.false() if name == "intermediate" else None
        yield sa.Column(name, given, nullable=name in _MAY_BE_NULL, server_default=default)


def _create_sweep() -> None:
    op.create_table(
        "sweep",
        sa.Column("id", sa.String(length=36), nullable=False),
        sa.Column("position", sa.Integer(), nullable=False),
        *_shared(),
        *_own(_SWEEP),
        sa.ForeignKeyConstraint(["job_id"], ["job.id"], name="fk_sweep_job_id_job", ondelete="CASCADE"),
        sa.PrimaryKeyConstraint("id", name="pk_sweep"),
    )
    alone = (
        "job_id", "owner", "scene_name", "scene_hash", "completed", "intermediate",
        "parameter", "peak", "peak_at", "band_hz", "points", "seconds", "harmonics",
    )  # fmt: skip
    _index("sweep", ("scene_name", "peak", "id"), *((name, "id") for name in alone))


def _create_design() -> None:
    op.create_table(
        "design",
        *_shared(),
        *_own(_DESIGN),
        sa.ForeignKeyConstraint(["job_id"], ["job.id"], name="fk_design_job_id_job", ondelete="CASCADE"),
        sa.PrimaryKeyConstraint("job_id", name="pk_design"),
    )
    alone = (
        "owner", "scene_name", "scene_hash", "method", "robust", "reached", "feasible",
        "objective", "peak", "peak_at", "band_hz", "work", "seconds",
    )  # fmt: skip
    _index("design", ("scene_name", "peak", "job_id"), *((name, "job_id") for name in alone))


def _create_parts(
    of: str,
    key: str,
    part: str,
    longest: int,
    columns: tuple[str, ...],
    may_be_null: tuple[str, ...],
    by: str,
) -> None:
    """Create the table of the parts of sweeps or designs, with indices by name and by one of the columns."""
    table, owner = f"{of}_{part}", f"{of}_id"
    op.create_table(
        table,
        sa.Column(owner, sa.String(length=36), nullable=False),
        sa.Column("name", sa.String(length=longest), nullable=False),
        sa.Column("position", sa.Integer(), nullable=False),
        *(sa.Column(name, sa.Double(), nullable=name in may_be_null) for name in columns),
        sa.ForeignKeyConstraint(
            [owner], [f"{of}.{key}"], name=f"fk_{table}_{owner}_{of}", ondelete="CASCADE"
        ),
        sa.PrimaryKeyConstraint(owner, "name", name=f"pk_{table}"),
    )
    _index(table, (by, "name", owner), ("name", by, owner))


def _index(table: str, *columns: tuple[str, ...]) -> None:
    for names in columns:
        op.create_index(f"ix_{table}_{'_'.join(names)}", table, list(names))
