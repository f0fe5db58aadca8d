"""The quality factor 1/(2ζ) of a nonlinear mode at an amplitude: what its damping leaves, to be made small.

As a goal: it is above 0 and without end where a mode is not damped, where a damping ratio would be a negative
number that grows. A mode that gains energy has none.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from functools import partial
from typing import TYPE_CHECKING

from optim.criteria.criterion import Criterion, CriterionRow, Form, Judged, Key
from optim.criteria.damping import damping_of, read_mode
from optim.criteria.key import number_or_table

if TYPE_CHECKING:
    from optim.problem.variables import Real

_KEY = "quality_factor"


def _rows(judged: Judged) -> list[CriterionRow]:
    """The row of the mode."""
    if (asked := judged.limit(QUALITY)) is None:
        return []
    most, amplitude, mode = asked
    found = damping_of(judged, amplitude, mode)
    ratio, slope, second = found.value, None, None
    if found.slope is not None:
        slope = -0.5 * found.slope / ratio**2
        second = None if found.second is None else partial(_second, ratio, found.slope, found.second)
    value = 0.5 / ratio if ratio > 0.0 else math.nan
    weight = judged.weight(QUALITY) * judged.case.weight
    what = f"quality factor {found.what}"
    return [judged.row(QUALITY, what, value, slope, bound=most, weight=weight, second=second)]


def _second(ratio: float, slope: Real, second: Callable[[], Real]) -> Real:
    """Return the second derivatives of 1/(2ζ)."""
    return slope[:, None] * slope / ratio**3 - 0.5 * second() / ratio**2


QUALITY = CRITERION = Criterion(
    name="quality factor",
    unit="1",
    help="1/(2ζ) of a [nonlinear mode](modes.md) at a modal amplitude; minimised times its `weight`.",
    rows=_rows,
    weight="quality",
    needs=_KEY,
    keys=(
        Key(
            name=_KEY, annotation=number_or_table("1", "words"), form=Form.NUMBER_OR_TABLE,
            flag="--quality-factor", metavar="WORD=X", example="amplitude=0.002 and most=50",
            examples=({"amplitude": 0.002, "mode": 1, "most": 50},),
            help="Of which `mode` (the first) at which modal `amplitude` [√kg m], and the `most` it may be.",
            option_help="Quality factor: amplitude=… [√kg m], perhaps mode=… and most=…; repeatable.",
        ),
    ),
    read=partial(read_mode, key=_KEY, number="most", needed=False),
)  # fmt: skip
