"""The width of the resonance band: where the amplitude is above a limit, or above half power of the peak."""

from __future__ import annotations

from collections.abc import Callable
from functools import partial
from typing import TYPE_CHECKING

from optim.criteria.criterion import Criterion, CriterionRow, Form, Judged, Key
from optim.criteria.key import FrequencyHz

if TYPE_CHECKING:
    from optim.problem.variables import Real


def _rows(judged: Judged) -> list[CriterionRow]:
    """The row of the band of a response that has one."""
    import numpy as np

    from solver.continuation.extrema.extrema import HALF_POWER

    branch, sensitivity = judged.branch, judged.sensitivity
    if branch.band is None:
        return []
    slope = None
    if sensitivity is not None:
        dlimit = np.zeros(len(judged.problem.paths))
        if judged.problem.limit is None:
            dlimit = HALF_POWER * sensitivity.peak(branch.peaks[0])
        slope = sensitivity.band(branch.band.edges, dlimit)
    what = f"band above {branch.band.limit:.6g} m"
    return [
        judged.row(BAND, what, branch.band.width, slope, bound=judged.limit(BAND), second=_second(judged))
    ]


def _second(judged: Judged) -> Callable[[], Real] | None:
    branch, sensitivity = judged.branch, judged.sensitivity
    if sensitivity is None or branch.band is None or not sensitivity.has_second:
        return None
    edges, highest = branch.band.edges, None if judged.problem.limit is not None else branch.peaks[0]
    return partial(sensitivity.band_second, edges, highest)


BAND = CRITERION = Criterion(
    name="band",
    unit="Hz",
    help="The width of the resonance band of any case: the frequencies at which the amplitude is above "
    "`limit`, or above half power of the peak if that is left out.",
    rows=_rows,
    weight="band",
    keys=(
        Key(
            name="max_band_hz", annotation=FrequencyHz, form=Form.NUMBER, flag="--max-band", metavar="HZ",
            help="Largest width of the resonance band allowed [Hz].",
            option_help="Widest resonance band allowed [Hz].",
        ),
    ),
    always=True,
    each_blade=True,
    limit_name="band limit",
    with_place=False,
    on_a_front=False,
)  # fmt: skip
