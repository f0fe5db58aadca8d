"""The highest amplitude of the observed DOF over the band."""

from __future__ import annotations

from optim.criteria.criterion import Criterion, CriterionRow, Form, Judged, Key
from optim.criteria.key import PositiveNumber


def _rows(judged: Judged) -> list[CriterionRow]:
    """A row for every peak that competes."""
    from optim.criteria.amplitudes import maxima

    weight = judged.weight(PEAK) * judged.case.weight
    return maxima(judged, PEAK, "peak", bound=judged.limit(PEAK), weight=weight)


PEAK = CRITERION = Criterion(
    name="peak",
    unit="m",
    help="The highest amplitude of the observed DOF over the band of any case; minimised times its `weight`.",
    rows=_rows,
    weight="peak",
    keys=(
        Key(
            name="max_peak", annotation=PositiveNumber, form=Form.NUMBER, flag="--max-peak", metavar="A",
            help="Largest amplitude allowed [m].",
        ),
    ),
    always=True,
    each_blade=True,
    limit_name="peak limit",
    with_place=False,
)  # fmt: skip
