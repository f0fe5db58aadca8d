"""Frequencies, or running speeds times the order of each case, at which the amplitude stays below `limit`."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING, Any

from optim.criteria.criterion import Criterion, CriterionContext, CriterionRow, Form, Judged, Key, Ranges
from optim.criteria.key import BandsHz, RangesRpm
from optim.criteria.peak_criterion import maxima

if TYPE_CHECKING:
    from optim.problem.cases import LoadCase


def _rows(judged: Judged) -> list[CriterionRow]:
    """A row for every local maximum of the response over a forbidden range."""
    if judged.hertz is None:
        return []
    low, high = judged.hertz
    what = f"{judged.measured} from {low:g} to {high:g} Hz, highest"
    return maxima(judged, FORBIDDEN, what, bound=judged.problem.limit)


def _read(asked: CriterionContext) -> Mapping[str, Ranges]:
    """The forbidden frequencies by case: those given, and those of the speeds by its order."""
    from optim.problem.checks import DesignError

    hertz, speeds = (_ranges(name, asked.values.get(name)) for name in ("forbidden_hz", "speeds_rpm"))
    if asked.limit is None:
        raise DesignError("limit", None, "must be given with forbidden ranges: the amplitude allowed there")
    return {
        case.name: hertz + tuple((low * case.order / 60.0, high * case.order / 60.0) for low, high in speeds)
        for case in asked.cases
    }


def _ranges(name: str, ranges: object) -> Ranges:
    from optim.problem.checks import DesignError, number_pair

    if ranges is None:
        return ()
    if not isinstance(ranges, Sequence) or isinstance(ranges, str) or not ranges:
        raise DesignError(name, ranges, "must be a list of ranges, [[low, high], …]")
    found = tuple(number_pair((name, i), pair) for i, pair in enumerate(ranges))
    for i, (low, high) in enumerate(found):
        if not 0.0 < low < high:
            raise DesignError((name, i), [low, high], "must have 0 < low < high")
    return found


def _of_case(read: Any, case: LoadCase) -> Ranges:
    found: Ranges = read.get(case.name, ())
    return found


FORBIDDEN = CRITERION = Criterion(
    name="amplitude in a forbidden range",
    unit="m",
    help="The highest amplitude of the observed DOF over each forbidden range.",
    rows=_rows,
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
    read=_read,
    ranges=_of_case,
    each_blade=True,
    limit_name="limit in a forbidden range",
)  # fmt: skip
