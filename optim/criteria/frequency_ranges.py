"""The highest amplitude over ranges of frequencies beyond the band: forbidden ones, and running speeds.

Running speeds times the order of each case are frequencies; there the highest amplitude need not be that of
the resonance.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from typing import TYPE_CHECKING, Annotated, NamedTuple

from pydantic import Field

from optim.criteria.criterion import Criterion, CriterionContext, CriterionRow, Form, Judged, Key, Ranges
from optim.criteria.key import BandsHz, PositiveNumber, RangeRpm, RangesRpm, SpeedRpm
from optim.criteria.peak_criterion import maxima
from solver.results import units

if TYPE_CHECKING:
    from optim.problem.cases import LoadCase


BESIDE = 1e-6  # of a speed that is given alone, on both sides
_SPEEDS, _LIMIT = "running_rpm", "max_running_amplitude"


class _Over(NamedTuple):
    """Frequencies [Hz] of each case, and the amplitude allowed there [m]."""

    ranges: Mapping[str, Ranges]
    bound: float | None


def _of_case(read: _Over, case: LoadCase) -> Ranges:
    return read.ranges.get(case.name, ())


def _at_speeds(case: LoadCase, speeds: Iterable[tuple[float, float]]) -> Ranges:
    """Return the frequencies [Hz] of running speeds [1/min]."""
    return tuple((low * case.order / 60.0, high * case.order / 60.0) for low, high in speeds)


def _rows(judged: Judged, criterion: Criterion, which: str = "") -> list[CriterionRow]:
    """Return a row for every local maximum of the response over a range."""
    if judged.hertz is None:
        return []
    low, high = judged.hertz
    return maxima(
        judged, criterion, f"{judged.measured} from {units.span(low, high, 'Hz')}{which}",
        bound=judged.limit(criterion).bound, weight=judged.weight(criterion) * judged.case.weight,
    )  # fmt: skip


def _read_forbidden(asked: CriterionContext) -> _Over:
    """The forbidden frequencies by case: those given, and those of the speeds by its order."""
    from optim.problem.checks import DesignError

    hertz, speeds = (_ranges(name, asked.values.get(name)) for name in ("forbidden_hz", "speeds_rpm"))
    if asked.limit is None:
        raise DesignError("limit", None, "must be given with forbidden ranges: the amplitude allowed there")
    return _Over({case.name: hertz + _at_speeds(case, speeds) for case in asked.cases}, asked.limit)


def _ranges(name: str, ranges: object) -> Ranges:
    from optim.problem.checks import DesignError, number_pair, range_above_zero

    if ranges is None:
        return ()
    if not isinstance(ranges, Sequence) or isinstance(ranges, str) or not ranges:
        raise DesignError(name, ranges, "must be a list of ranges, [[low, high], …]")
    pairs = [number_pair((name, i), pair) for i, pair in enumerate(ranges)]
    return tuple(range_above_zero((name, i), list(pair)) for i, pair in enumerate(pairs))


FORBIDDEN: Criterion = Criterion(
    name="amplitude in a forbidden range",
    unit="m",
    help="The highest amplitude of the observed DOF over each forbidden range.",
    rows=lambda judged: _rows(judged, FORBIDDEN, ", highest"),
    keys=(
        Key(
            name="forbidden_hz", annotation=BandsHz, form=Form.RANGES, flag="--forbidden",
            metavar="LO HI", example="520 560", examples=([[520, 560]],), needs_limit=True,
            help="Ranges [Hz] in which the amplitude stays below `limit`.",
            option_help="Frequencies [Hz] at which the amplitude stays below --limit; repeatable.",
        ),
        Key(
            name="speeds_rpm", annotation=RangesRpm, form=Form.RANGES, flag="--speeds", metavar="LO HI",
            example="2900 3100", examples=([[2900, 3100]],), needs_limit=True,
            help="Ranges of running speed [1/min]; times the order of each case they are forbidden too.",
            option_help="Running speeds [1/min]: forbidden frequencies by the engine order; repeatable.",
        ),
    ),
    read=_read_forbidden,
    ranges=_of_case,
    each_blade=True,
    limit_name="limit in a forbidden range",
)  # fmt: skip


def _read_running(asked: CriterionContext) -> _Over:
    from optim.problem.checks import DesignError, is_number, number_pair, positive

    speeds, bound = asked.values.get(_SPEEDS), asked.values.get(_LIMIT)
    if speeds is None:
        raise DesignError(_SPEEDS, None, f"must be given with `{_LIMIT}`: the speeds [1/min] it holds at")
    if not isinstance(speeds, Sequence) or isinstance(speeds, str) or not speeds:
        raise DesignError(_SPEEDS, speeds, "must be a list of ranges [[low, high], …], or of speeds, [1/min]")
    pairs = []
    for i, given in enumerate(speeds):
        beside = (given * (1.0 - BESIDE), given * (1.0 + BESIDE)) if is_number(given) else given
        low, high = number_pair((_SPEEDS, i), beside)
        if low == high:
            low, high = low * (1.0 - BESIDE), high * (1.0 + BESIDE)
        if not 0.0 < low < high:
            raise DesignError((_SPEEDS, i), given, "must have 0 < low <= high")
        pairs.append((low, high))
    ranges = {case.name: _at_speeds(case, pairs) for case in asked.cases}
    return _Over(ranges, None if bound is None else positive(_LIMIT, bound))


RUNNING: Criterion = Criterion(
    name="running amplitude",
    unit="m",
    help="The highest amplitude of the observed DOF at running speeds, times the order of each case its "
    "frequencies; minimised times its `weight`.",
    rows=lambda judged: _rows(judged, RUNNING),
    weight="running",
    needs=_SPEEDS,
    keys=(
        Key(
            name=_SPEEDS,
            annotation=Annotated[list[SpeedRpm | RangeRpm], Field(min_length=1, max_length=200)],
            form=Form.RANGES, flag="--running", metavar="LO HI", example="2950 3050",
            examples=([[2950, 3050]], [3000]),
            help="Speeds and ranges of speed [1/min] at which the machine runs.",
            option_help="Speeds [1/min] at which the machine runs, a single one twice; repeatable.",
        ),
        Key(
            name=_LIMIT, annotation=PositiveNumber, form=Form.NUMBER, flag="--max-running", metavar="A",
            beside=_SPEEDS, help="Largest amplitude allowed at the running speeds [m].",
        ),
    ),
    read=_read_running,
    ranges=_of_case,
    each_blade=True,
    limit_name="limit of the running amplitude",
)  # fmt: skip

CRITERION = (FORBIDDEN, RUNNING)
