"""Stored results: written with the result of their job, filtered and sorted by any of their figures."""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from datetime import datetime
from functools import partial
from typing import Annotated, Any
from weakref import WeakKeyDictionary, WeakSet

from sqlalchemy import (
    ARRAY,
    BigInteger,
    ColumnElement,
    Connection,
    Engine,
    Select,
    and_,
    any_,
    bindparam,
    func,
    insert,
    select,
    tuple_,
)
from sqlalchemy.orm import aliased

from service.db.clock import new_id
from service.db.engine import ArrayStore, Database
from service.db.models import NOBODY, Figure, Job, Quantity, Result, SweepArray
from service.db.pagination import (
    Condition,
    Position,
    Range,
    aside,
    encode,
    fewest,
    ordered,
    owner_condition,
    plain_conditions,
    refused,
    unindexed,
    within,
)
from service.db.postgresql import WITH_VALUES, lock_quantities
from service.db.repositories.run_repository import in_the_bin
from service.errors import DatabaseError
from service.jobs.stored_figures import RECORDS, SWEEP, KindRecord, StoredArray, StoredRecord
from solver.first_use import on_demand

Name = tuple[str, str]
"""Name and label of a quantity."""

CREATED = "created"
_ANY: Range = (None, None)
# Of 100 000 results: so many are read and sorted in the time in which a page of more is found in order.
_FEW = {"sqlite": 5000, "postgresql": 8000}
_NEVER_LEADS = -1
_MOST_DIGITS = 18
_NONE = 0
"""Of no quantity."""
_ALONG = "along"
# PostgreSQL's own guess, of how many results a range of one figure leaves, is that of a range of all figures.
_ONE_BY_ONE = "SELECT set_config('enable_hashjoin', 'off', true), set_config('enable_mergejoin', 'off', true)"
_HEAD = ("number", "id", "of", "job_id", "position", "owner", "scene_name", "scene_hash", "status", "created")
# Built once: building a statement costs more than running it.
_RESULT, _FIGURE = Result.metadata.tables["result"], Figure.metadata.tables["figure"]
_INSERT, _INSERT_FIGURES = insert(_RESULT), insert(_FIGURE)
_INSERT_ARRAYS = insert(SweepArray.metadata.tables["sweep_array"])
_SELECT = select(*(_RESULT.c[name] for name in _HEAD))
# What is known of quantities, and who stored some that may be taken back yet.
_storing: WeakSet[Any] = WeakSet()
_stored: WeakKeyDictionary[Engine, dict[tuple[str, str, str], int]] = WeakKeyDictionary()
_FIGURES = select(_FIGURE.c.result, _FIGURE.c.quantity, _FIGURE.c.value).where(
    _FIGURE.c.result.in_(bindparam("results", expanding=True))
)
_NAMES = select(Quantity.id, Quantity.name, Quantity.label).where(
    Quantity.id.in_(bindparam("ids", expanding=True))
)


@dataclass(frozen=True, slots=True, kw_only=True)
class Filter:
    """Which results to list; every condition must hold."""

    of: Annotated[str, "Of what."]
    owner: Annotated[str | None, "Whose; None for everybody's."] = NOBODY
    equal: Annotated[Mapping[str, object], "Column name to value."] = field(default_factory=dict)
    ranges: Annotated[Mapping[str, Range], "Name of a figure to (lowest, highest), each None for open."] = (
        field(default_factory=dict)
    )
    words: Annotated[Mapping[str, str], "Name of a word to the word."] = field(default_factory=dict)
    part: Annotated[str | None, "Name of a part it must have; None for any."] = None
    part_ranges: Annotated[
        Mapping[str, Range], "As `ranges`, of the parts; one part must meet all of them."
    ] = field(default_factory=dict)
    run: Annotated[
        str | None, "With the run of this job, be it that an earlier job computed them; None for any."
    ] = None
    sort: Annotated[
        str,
        "``created`` (by the order in which they were stored) or the name of a figure; results without it "
        "are left out.",
    ] = CREATED
    descending: Annotated[bool, "Largest or newest first."] = True


class ResultRepository:
    """Results of one database, each as the record of what it is of."""

    def __init__(self, database: Database) -> None:
        self._db = database
        self._names: dict[int, Name] = {}

    def get(self, result_id: str, of: str) -> Any:
        """The result of an id, whoever owns it, or None."""
        return next(iter(self._all(of, Result.id == result_id)), None)

    def of_job(self, job_id: str, of: str = SWEEP) -> list[Any]:
        """Those of a job in the order they were computed."""
        return self._all(of, Result.job_id == job_id)

    def arrays(self, result_id: str) -> dict[str, StoredArray]:
        """The arrays of a sweep, by name."""
        query = (
            select(Result.job_id, SweepArray.name, SweepArray.sha256, SweepArray.data, SweepArray.size)
            .join(Result, Result.id == SweepArray.sweep_id)
            .where(SweepArray.sweep_id == result_id)
        )
        with self._db.reading() as connection:
            rows = connection.execute(query).all()
        return {row.name: whole(self._db.arrays, row) for row in rows}

    def page(self, wanted: Filter, limit: int, after: Position | None = None) -> list[tuple[Any, Position]]:
        """A page of results, each with its place; `after` is that of the last one of the page before.

        Those of runs in the bin are left out, unless it is their run that is asked for.
        """
        with self._db.reading() as connection:
            query = _query(connection, wanted, limit, after)
            rows = connection.execute(query).mappings().all()
            records = self._read(connection, wanted.of, rows)
        return [
            (record, (row.get(_ALONG), str(record.number)))
            for row, record in zip(rows, records, strict=True)
        ]  # fmt: skip

    def _all(self, of: str, holds: ColumnElement[bool]) -> list[Any]:
        query = _SELECT.where(holds, Result.of == of).order_by(Result.position)
        with self._db.reading() as connection:
            return self._read(connection, of, connection.execute(query).mappings().all())

    def _read(self, connection: Connection, of: str, rows: Sequence[Any]) -> list[StoredRecord]:
        """The records of rows, with their figures."""
        numbers = {"results": [row["number"] for row in rows]}
        stored = connection.execute(_FIGURES, numbers).all() if rows else ()
        unknown = {quantity for _, quantity, _ in stored} - self._names.keys()
        if unknown:  # what a quantity is never changes
            found = connection.execute(_NAMES, {"ids": list(unknown)})
            self._names |= {quantity: (name, label) for quantity, name, label in found}
        figures: dict[int, list[tuple[str, str, float]]] = defaultdict(list)
        for number, quantity, value in stored:
            figures[number].append((*self._names[quantity], value))
        heads = ({name: row[name] for name in _HEAD} for row in rows)
        return [_record(of).stored(head, figures[head["number"]]) for head in heads]


def whole(store: ArrayStore | None, row: Any) -> StoredArray:
    """An array with its bytes, from a row with its job, digest, bytes and size.

    DatabaseError if it is outside of the database and cannot be had from there.
    """
    if row.size is None:
        return StoredArray(sha256=row.sha256, data=row.data)
    if store is None:
        raise DatabaseError("it is outside of the database: `arrays` (STICKSLIP_ARRAYS) must say where")
    return StoredArray(sha256=row.sha256, data=store.get(row.job_id, row.sha256))


def _record(of: str) -> type[StoredRecord]:
    return RECORDS.get(of, KindRecord)


def _query(connection: Connection, wanted: Filter, limit: int, after: Position | None) -> Select[Any]:
    """The query of a page, led by a condition that few results meet if there is one.

    Without such a one the results are read in the order that is asked for, which finds a page of those
    that many meet after a few of them. Neither database knows how many a range of one figure leaves of
    all; so up to `_FEW` are counted, which the key of the figures answers in a few milliseconds, and the
    way is then prescribed.
    """
    on_sqlite = connection.dialect.name == "sqlite"
    if not on_sqlite:
        connection.exec_driver_sql(_ONE_BY_ONE)
    known = _known(connection, wanted, _record(wanted.of).PART)
    along: Any = None if wanted.sort == CREATED else aliased(Figure)
    number = Result.number if along is None else along.result
    conditions = _columns(connection, wanted)
    conditions += _figures(wanted, known, along or Result, number, dialect=connection.dialect.name)
    lead = fewest(connection, conditions)
    held = [one.holds for one in conditions if one is not lead]
    query, keys = _SELECT, [number]
    if along is None:
        held.append(Result.of == wanted.of)
    else:
        # The plus keeps a database from going the other way.
        ends = (along.result, Result.number)
        tie = unindexed(ends[0]) == ends[1] if lead is None else ends[0] == unindexed(ends[1])
        query, keys = query.add_columns(along.value.label(_ALONG)).join(along, tie), [along.value, number]
        held += [along.quantity == known.get((wanted.sort, ""), _NONE)]
        held += within(along.value, wanted.ranges.get(wanted.sort, _ANY))
    if lead is not None:
        # With a lead, SQLite is to read results by their numbers, not by an index of a column.
        held = [aside(one) if on_sqlite else one for one in held]
        # PostgreSQL would look through them for every result; an array it looks up in the key.
        array = func.array(lead.ids.scalar_subquery(), type_=ARRAY(BigInteger()))
        held.append(Result.number.in_(lead.ids) if on_sqlite else Result.number == any_(array))
    if "job_id" not in wanted.equal and wanted.run is None:
        held.append(~in_the_bin(Result.job_id))
    place = _place(after, len(keys))
    query = query.where(*held).limit(limit).execution_options(**{WITH_VALUES: True})
    return ordered(query, keys, descending=wanted.descending, after=place)


def _figures(
    wanted: Filter, known: Mapping[Name, int], source: Any, number: Any, *, dialect: str
) -> list[Condition]:
    """The conditions on figures of the results of a number."""
    asked = [(_ids(known, name, ""), bounds) for name, bounds in wanted.ranges.items()]
    asked += [(_ids(known, name, word), _ANY) for name, word in wanted.words.items()]
    ranges = wanted.part_ranges or ({} if wanted.part is None else {_record(wanted.of).PART: _ANY})
    inside = [(_ids(known, name, wanted.part), bounds) for name, bounds in ranges.items()]
    made = partial(_condition, source=source, number=number, dialect=dialect)
    conditions = [made([one]) for one in [*asked, *inside]]
    if wanted.part is None and len(inside) > 1:
        # Of all ranges in one part it takes as long to count the results as the first range is wide.
        conditions.append(replace(made(inside), few=_NEVER_LEADS))
    return conditions


def _known(connection: Connection, wanted: Filter, part: str) -> dict[Name, int]:
    """The quantities of what is asked for, as far as there are results with them."""
    names = {*wanted.ranges, *wanted.words, *wanted.part_ranges, part, wanted.sort}
    query = select(Quantity.name, Quantity.label, Quantity.id)
    found = connection.execute(query.where(Quantity.of == wanted.of, Quantity.name.in_(names)))
    return {(name, label): number for name, label, number in found}


def _ids(known: Mapping[Name, int], name: str, label: str | None) -> list[int]:
    """The quantities of a name, with a label or (None) with any."""
    return [number for key, number in known.items() if key[0] == name and label in (None, key[1])]


def _columns(connection: Connection, wanted: Filter) -> list[Condition]:
    """The conditions on columns."""
    found = [getattr(Result, name) == value for name, value in wanted.equal.items()]
    if wanted.run is not None:
        source = select(func.coalesce(Job.result_of, Job.id)).where(Job.id == wanted.run)
        found.append(Result.job_id == source.scalar_subquery())
    conditions = plain_conditions(Result.number, found)
    conditions += owner_condition(connection, Result.number, Result.owner, wanted.owner, leads=not found)
    few = _FEW[connection.dialect.name]
    return [
        Condition(ids=one.ids.where(Result.of == wanted.of), holds=one.holds, few=few) for one in conditions
    ]


def _condition(
    asked: Sequence[tuple[Sequence[int], Range]], source: Any, number: Any, *, dialect: str
) -> Condition:
    """The condition that a result has a figure in each range; of several all are of one part.

    Parameters
    ----------
    asked : for each figure the quantities that will do, and its range.
    source, number : where there is the number of the result, and that.
    """
    begun, of_begun = aliased(Figure), aliased(Quantity)
    ids = select(begun.result)
    if len(asked) > 1:
        ids = ids.join(of_begun, of_begun.id == begun.quantity)
    for place, (quantities, bounds) in enumerate(asked):
        figure = begun
        if place > 0:
            figure, of_figure = aliased(Figure), aliased(Quantity)
            ids = ids.join(figure, figure.result == begun.result)
            same = and_(of_figure.id == figure.quantity, of_figure.label == of_begun.label)
            ids = ids.join(of_figure, same)
        ids = ids.where(figure.quantity.in_(quantities), *within(figure.value, bounds))
    of_one = ids.where(begun.result == number)
    if dialect != "sqlite":
        # Else it is planned as a join, and all of a wide range are read before the first is sorted.
        of_one = of_one.offset(0)
    holds = of_one.correlate(source).exists()
    return Condition(ids=ids, holds=holds, few=_FEW[dialect])


def _place(after: Position | None, keys: int) -> list[Any] | None:
    """Where a page goes on: the value it is sorted by, if it is, and the number of a result.

    InvalidRequestError if the position is not one of a list of results.
    """
    if after is None:
        return None
    value, number = after
    if not (number.isascii() and number.isdecimal() and len(number) <= _MOST_DIGITS):
        raise refused(encode(*after))
    return [value, int(number)][-keys:]


def _quantities(connection: Connection, of: str, wanted: set[Name]) -> Mapping[Name, int]:
    """The quantities of figures to be stored; those that are new are stored first.

    What other transactions stored is remembered: no quantity is ever deleted.
    """
    known = _stored.setdefault(connection.engine, {})
    missing = [one for one in sorted(wanted) if (of, *one) not in known]
    if not missing:
        return {one: known[of, *one] for one in wanted}
    before = _read_quantities(connection, of, missing)
    if connection.get_transaction() not in _storing:
        known |= {(of, *one): number for one, number in before.items()}
    new = [{"of": of, "name": name, "label": label} for name, label in missing if (name, label) not in before]
    if new:
        # One transaction after the other: two that wait for each other's would be ended.
        if connection.dialect.name != "sqlite":
            lock_quantities(connection)
        _storing.add(connection.get_transaction())
        insert_anew = on_demand(f"sqlalchemy.dialects.{connection.dialect.name}:insert")
        connection.execute(insert_anew(Quantity).on_conflict_do_nothing(), new)
        before = _read_quantities(connection, of, missing)
    return {one: before[one] if one in before else known[of, *one] for one in wanted}


def _read_quantities(connection: Connection, of: str, wanted: Iterable[Name]) -> dict[Name, int]:
    query = select(Quantity.name, Quantity.label, Quantity.id).where(Quantity.of == of)
    pairs = tuple_(Quantity.name, Quantity.label).in_(list(wanted))
    return {(name, label): number for name, label, number in connection.execute(query.where(pairs))}


def insert_results(
    connection: Connection, job_id: str, records: Iterable[StoredRecord], created: datetime,
    owner: str = NOBODY,
) -> None:  # fmt: skip
    """Write results of a job inside the transaction that writes its own; `owner` is the job's."""
    figures, arrays = [], []
    for position, record in enumerate(records):
        result_id = new_id() if record.of == SWEEP else job_id
        about = {"id": result_id, "job_id": job_id, "position": position, "created": created, "owner": owner}
        same = {name: getattr(record, name) for name in ("of", "scene_name", "scene_hash", "status")}
        [number] = connection.execute(_INSERT, about | same).inserted_primary_key or [None]
        told = list(record.figures())
        ids = _quantities(connection, record.of, {(one.name, one.label) for one in told})
        figures += [
            {"quantity": ids[one.name, one.label], "value": one.value, "result": number} for one in told
        ]
        arrays += [
            {"sweep_id": result_id, "name": name}
            | {"sha256": stored.sha256, "data": stored.data, "size": stored.size}
            for name, stored in getattr(record, "arrays", {}).items()
        ]
    if figures:
        connection.execute(_INSERT_FIGURES, figures)
    if arrays:
        connection.execute(_INSERT_ARRAYS, arrays)
