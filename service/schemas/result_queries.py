"""The lists of stored results: from the words of a request to a page.

They are filtered and sorted by any figure; those of sweeps and designs have keys of their own.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from functools import cache, partial
from operator import itemgetter
from typing import TYPE_CHECKING, Annotated, Any, ClassVar, Literal

from pydantic import ConfigDict, Field, create_model

from service.db.models import NOBODY
from service.db.pagination import Range
from service.db.repositories import ResultRepository
from service.db.repositories.result_repository import CREATED, Filter
from service.errors import InvalidRequestError
from service.jobs.kind_registry import Registry
from service.jobs.stored_figures import (
    DESIGN,
    RECORDS,
    SWEEP,
    DesignRecord,
    KindRecord,
    Quantity,
    StoredRecord,
    SweepRecord,
    part_names,
    quantities_of_model,
    quantities_of_record,
)
from service.jobs.strict_json import validated
from service.schemas.answers import (
    Cursor,
    DesignAnswer,
    DesignPage,
    Limit,
    ListQuery,
    QuantityAnswer,
    ResultPage,
    StoredResult,
    SweepAnswer,
    SweepPage,
    page_of,
)
from service.settings.settings import Settings
from solver.errors import Issue
from solver.wording import nearest

Bound = Annotated[float | None, Field(ge=-1e30, le=1e30)]
Count = Annotated[int | None, Field(ge=0, le=10**9)]
Name = Annotated[str | None, Field(max_length=210)]
LongName = Annotated[str | None, Field(max_length=500)]
_COLUMNS = {"owner": "owner", "scene": "scene_name", "scene_hash": "scene_hash", "job": "job_id"}
_OWNER = Field(default=None, description="For keys with the scope admin: whose.")
_RUN = Field(
    default=None, description="With the run of this id; also if an earlier one computed them for it."
)


class StoredQuery(ListQuery):
    """Which results to list; the keys are figures, with ``_min`` and ``_max`` for ranges, and columns."""

    FIGURES: ClassVar[Mapping[str, str]] = {}
    """The figure that a key is about, where it has another name."""
    RUN: ClassVar[str] = "run"

    if TYPE_CHECKING:  # fields of every query, each where its list has them
        sort: str

    def to_filter(self, of: str, sees: str | None = NOBODY) -> Filter:
        """The query of the repository; of what belongs to `sees`, or to everybody (None)."""
        record = _record(of)
        given = self.model_dump(exclude_none=True, exclude={"of", "sort", "limit", "cursor"} - {self.RUN})
        run, part = given.pop(self.RUN, None), given.pop(record.PART, None)
        equal = {column: given.pop(key) for key, column in _COLUMNS.items() if key in given}
        words = {key: given.pop(key) for key, value in list(given.items()) if isinstance(value, str)}
        ranges: dict[str, Range] = {}
        for key, value in given.items():
            name, _, end = key.rpartition("_")
            if end not in _ENDS or isinstance(value, bool):
                name, end = key, ""
            low, high = ranges.get(figure := self.FIGURES.get(name, name), (None, None))
            ranges[figure] = (low if end == "max" else float(value), high if end == "min" else float(value))
        inside = part_names(record)
        sort = self.sort.removeprefix("-")
        return Filter(
            of=of, owner=sees, equal=equal, words=words, part=part, run=run,
            ranges={name: bounds for name, bounds in ranges.items() if name not in inside},
            part_ranges={name: bounds for name, bounds in ranges.items() if name in inside},
            sort=self.FIGURES.get(sort, sort), descending=self.sort.startswith("-"),
        )  # fmt: skip


_ENDS = ("min", "max")


def _keys(record: type[StoredRecord], known: Mapping[str, Quantity]) -> dict[str, Any]:
    """The keys that figures add to a query, with what they must be."""
    keys: dict[str, Any] = {}
    inside = {} if record.PART_TYPE is None else quantities_of_record(record.PART_TYPE)
    for name, quantity in {**known, **inside}.items():
        if quantity.kind in (int, float):
            keys |= {f"{name}_{end}": (Bound, None) for end in _ENDS}
        else:
            keys[name] = (LongName if quantity.kind is str else bool | None, None)
    return keys | ({record.PART: (LongName, None)} if record.PART else {})


def _listing(record: type[StoredRecord], name: str, columns: Mapping[str, Any], *renamed: str) -> Any:
    """Root of the queries of one kind of records: every figure is a key, every number one to sort by."""
    known = quantities_of_record(record)
    keys = _keys(record, known) | {f"{key}_{end}": (Bound, None) for key in renamed for end in _ENDS}
    said = known | ({} if record.PART_TYPE is None else quantities_of_record(record.PART_TYPE))
    for key, (kind, _) in keys.items():
        one = said.get(key) or said.get(key.removesuffix("_min"))
        keys[key] = kind, Field(None, description=None if one is None else one.words)
    numbers = (key for key, one in known.items() if one.kind in (int, float))
    words = [sign + key for key in (CREATED, *numbers, *renamed) for sign in ("", "-")]
    sort: Any = Literal[tuple(words)]
    about = {"owner": (LongName, _OWNER), "scene": (Name, None), "scene_hash": (Name, None)}
    return create_model(
        name, __base__=StoredQuery, **{**about, **columns, **keys}, harmonics=(Count, None),
        sort=(sort, "-created"), limit=(Limit, 100), cursor=(Cursor, None),
    )  # fmt: skip


_Designs: Any = _listing(DesignRecord, "Designs", {}, "band")
_Sweeps: Any = _listing(SweepRecord, "Sweeps", {"job": (LongName, None), "of": (LongName, _RUN)})


class DesignQuery(_Designs):  # type: ignore[misc]
    """Which designs to list. `…_min` and `…_max` are inclusive; `-` before a sort means largest first."""

    path: ClassVar[str] = "/v1/designs"
    FIGURES: ClassVar[Mapping[str, str]] = {"band": "band_hz"}


class SweepQuery(_Sweeps):  # type: ignore[misc]
    """Which sweeps to list. `…_min` and `…_max` are inclusive; `-` before a sort means largest first."""

    path: ClassVar[str] = "/v1/sweeps"
    RUN: ClassVar[str] = "of"


class ResultQuery(StoredQuery):
    """Which results to list; further keys are figures of what is listed."""

    model_config = ConfigDict(extra="allow")
    path: ClassVar[str] = "/v1/results"

    of: str = Field(description="Of what: `sweep`, `design`, or another kind of job.", max_length=32)
    owner: LongName = _OWNER
    scene: LongName = None
    scene_hash: LongName = None
    job: LongName = None
    run: LongName = _RUN
    sort: str = Field(
        default="-created", max_length=210,
        description="`created` or a number that the results have; `-` before it means largest first.",
    )  # fmt: skip
    limit: Limit = 100
    cursor: Cursor = None


def _record(of: str) -> type[StoredRecord]:
    return RECORDS.get(of, KindRecord)


def quantities(of: str, registry: Registry) -> dict[str, Quantity]:
    """The figures of the results of a kind, by name; those of its parts are not among them.

    InvalidRequestError if there is no such kind.
    """
    if of in RECORDS:
        return quantities_of_record(RECORDS[of])
    known = {kind.name: kind.answers for kind in registry}
    if of not in known:
        hint = nearest(of, [*RECORDS, *known])
        wanted = f"must be {SWEEP}, {DESIGN} or another kind of job{hint}"
        raise InvalidRequestError.of(("of",), wanted, of, source="query")
    apart = ResultQuery.model_fields.keys() - {"limit"} | {"status"}
    return {name: one for name, one in quantities_of_model(known[of]).items() if name not in apart}


def result_page(
    repository: ResultRepository, query: ResultQuery, registry: Registry,
    settings: Settings, sees: str | None = NOBODY,
) -> ResultPage:  # fmt: skip
    """A page of results of whatever kind and the link to the next one.

    InvalidRequestError if there is no such kind, or it has no such figure; or the cursor is not of this
    service.
    """
    known = quantities(query.of, registry)
    record = _record(query.of)
    keys = _keys(record, known)
    issues = [
        Issue((key,), f"is not a known key{nearest(key, list(keys))}")
        for key in (query.model_extra or {}) if key not in keys
    ]  # fmt: skip
    sorts = [CREATED, *(name for name, one in known.items() if one.kind is not str)]
    if (word := query.sort.removeprefix("-")) not in sorts:
        wanted = f"must be created or a number of these results{nearest(word, sorts)}"
        issues.append(Issue(("sort",), wanted, word[:80]))
    if issues:
        raise InvalidRequestError(issues, source="query")
    asked = validated(_model(query.of, tuple(keys.items())), query.model_dump(exclude_unset=True), "query")
    rows, following = _rows(repository, asked, settings, asked.to_filter(query.of, sees))
    told = {name: QuantityAnswer(unit=one.unit, description=one.words) for name, one in known.items()}
    return ResultPage(
        items=[StoredResult.of_record(row, known) for row in rows], next=following, quantities=told
    )


@cache
def _model(_of: str, keys: tuple[tuple[str, Any], ...]) -> type[ResultQuery]:
    made: type[ResultQuery] = create_model("Results", __base__=ResultQuery, **dict(keys))
    return made


def _rows(
    repository: ResultRepository, query: StoredQuery, settings: Settings, wanted: Filter
) -> tuple[Sequence[Any], str | None]:
    """The results of a page and the link to the next one."""
    rows, following = page_of(query, settings, partial(repository.page, wanted), itemgetter(1))
    return [row for row, _ in rows], following


def sweep_page(
    repository: ResultRepository, query: SweepQuery, settings: Settings, sees: str | None = NOBODY
) -> SweepPage:
    """A page and the link to the next one (InvalidRequestError if the cursor is not of this service)."""
    rows, following = _rows(repository, query, settings, query.to_filter(SWEEP, sees))
    return SweepPage(items=[SweepAnswer.of(row) for row in rows], next=following)


def design_page(
    repository: ResultRepository, query: DesignQuery, settings: Settings, sees: str | None = NOBODY
) -> DesignPage:
    """A page and the link to the next one (InvalidRequestError if the cursor is not of this service)."""
    rows, following = _rows(repository, query, settings, query.to_filter(DESIGN, sees))
    return DesignPage(items=[DesignAnswer.of(row) for row in rows], next=following)
