"""The highest amplitude at running speeds, which need not be that of the resonance."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING, Annotated, Any, NamedTuple

from pydantic import Field

from optim.criteria.criterion import Criterion, CriterionContext, CriterionRow, Form, Judged, Key, Ranges
from optim.criteria.key import PositiveNumber, RangeRpm, SpeedRpm
from optim.criteria.peak_criterion import maxima

if TYPE_CHECKING:
    from optim.problem.cases import LoadCase

_SPEEDS, _LIMIT = "running_rpm", "max_running_amplitude"
BESIDE = 1e-6  # of a speed that is given alone, on both sides


class _Running(NamedTuple):
    """Frequencies [Hz] of each case, and the amplitude allowed [m]."""

    ranges: Mapping[str, Ranges]
    bound: float | None


def _rows(judged: Judged) -> list[CriterionRow]:
    """A row for every local maximum over a range of speeds."""
    if judged.hertz is None:
        return []
    low, high = judged.hertz
    weight = judged.weight(RUNNING) * judged.case.weight
    bound: float | None = judged.limit(RUNNING).bound
    what = f"{judged.measured} from {low:g} to {high:g} Hz"
    return maxima(judged, RUNNING, what, bound=bound, weight=weight)


def _read(asked: CriterionContext) -> _Running:
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
    ranges = {
        case.name: tuple((low * case.order / 60.0, high * case.order / 60.0) for low, high in pairs)
        for case in asked.cases
    }
    return _Running(ranges, None if bound is None else positive(_LIMIT, bound))


def _of_case(read: Any, case: LoadCase) -> Ranges:
    found: Ranges = read.ranges.get(case.name, ())
    return found


RUNNING = CRITERION = Criterion(
    name="running amplitude",
    unit="m",
    help="The highest amplitude of the observed DOF at running speeds, times the order of each case its "
    "frequencies; minimised times its `weight`.",
    rows=_rows,
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
    read=_read,
    ranges=_of_case,
    each_blade=True,
    limit_name="limit of the running amplitude",
)  # fmt: skip
