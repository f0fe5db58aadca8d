"""The damping ratio of a nonlinear mode at an amplitude, from below, and its quality factor as a goal.

Its derivatives by the parameters are those of the mode at that amplitude (`solver.modes.mode_gradient` and
`hessian`), whatever the excitation. The quality factor 1/(2ζ), what the damping leaves, is there as a goal:
it is above 0 and without end where a mode is not damped, where a damping ratio would be a negative number
that grows. A mode that gains energy has none.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from functools import partial
from typing import TYPE_CHECKING, Annotated, Any

from optim.criteria.criterion import Criterion, CriterionContext, CriterionRow, Form, Judged, Key
from optim.criteria.key import number_or_table
from solver.results import units

if TYPE_CHECKING:
    from optim.problem.variables import Real


_DAMPING = "min_damping"


@dataclass(frozen=True, slots=True, kw_only=True)
class ModeDamping:
    """The damping ratio of a mode at an amplitude."""

    what: Annotated[str, "In words."]
    value: Annotated[float, "NaN where the mode does not reach the amplitude."]
    slope: Annotated[Real | None, "By the parameter paths, (n_paths,); None without gradients."] = None
    second: Annotated[Callable[[], Real] | None, "Computes the second derivatives, if there are any."] = None


def damping_of(judged: Judged, amplitude: float, mode: int) -> ModeDamping:
    """Return the damping ratio of a mode at a modal amplitude."""
    import numpy as np

    from solver.errors import SettingError
    from solver.modes.at_amplitudes import damping_hessian, mode_at_amplitudes

    balance, paths = judged.branch.balance, judged.problem.paths if judged.gradients else ()
    what, kept = f"of mode {mode} at {units.quantity(amplitude, '√kg m')}", balance.n_harmonics
    try:
        found = mode_at_amplitudes(balance.scene, np.array([amplitude]), paths, mode=mode, harmonics=kept)
    except SettingError:  # the scene has the mode: this design alone has no equilibrium to move about
        return ModeDamping(what=what, value=math.nan)
    value, point = float(found.damping_ratio[0]), found.points[0]
    if judged.sensitivity is None or point is None:
        return ModeDamping(what=what, value=value)
    second = partial(damping_hessian, balance.scene, paths, point, mode=mode, harmonics=kept)
    return ModeDamping(
        what=what, value=value, slope=found.by_damping[0],
        second=second if judged.sensitivity.has_second else None,
    )  # fmt: skip


def _damping_rows(judged: Judged) -> list[CriterionRow]:
    """The row of the mode."""
    if (asked := judged.limit(DAMPING)) is None:
        return []
    ratio, amplitude, mode = asked
    found = damping_of(judged, amplitude, mode)
    what = f"damping ratio {found.what}"
    return [judged.row(DAMPING, what, found.value, found.slope, bound=ratio, second=found.second)]


def read_mode(asked: CriterionContext, key: str, number: str, *, needed: bool) -> tuple[Any, float, int]:
    """Read a table of a modal amplitude, perhaps the number of a mode, and a limit.

    Parameters
    ----------
    key, number : of the table, and of its limit.
    needed : whether that must be given; else it is None without.

    Returns
    -------
    The limit, the modal amplitude [√kg m] and the number of the mode.
    """
    from optim.problem.checks import DesignError, positive, whole
    from solver.errors import at
    from solver.modes.nonlinear_mode import pose

    given: Any = asked.values[key]
    wanted = {number, "amplitude"} if needed else {"amplitude"}
    if not isinstance(given, Mapping) or not wanted <= set(given):
        more = f"`{number}`, `amplitude` [√kg m] and perhaps `mode`"
        more = more if needed else f"`amplitude` [√kg m], perhaps `mode` and `{number}`"
        raise DesignError(key, given, f"must be a table with {more}")
    words = (number, "amplitude", "mode")
    for word in given:
        if word not in words:
            raise DesignError((key, word), given[word], f"is not known; there are {', '.join(words)}")
    mode = given.get("mode", 1)
    mode = int(mode) if isinstance(mode, float) and mode.is_integer() else mode
    mode = whole((key, "mode"), mode, least=1)
    with at(key, "mode"):
        pose(asked.scene, mode, None, 1)
    limit = positive((key, number), given[number]) if number in given else None
    return limit, positive((key, "amplitude"), given["amplitude"]), mode


DAMPING = Criterion(
    name="damping ratio",
    unit="1",
    help="The damping ratio of a [nonlinear mode](modes.md) at a modal amplitude.",
    rows=_damping_rows,
    smaller_is_better=False,
    keys=(
        Key(
            name=_DAMPING, annotation=number_or_table("1", "words"), form=Form.NUMBER_OR_TABLE,
            flag="--min-damping", metavar="WORD=X", example="ratio=0.01 and amplitude=0.002",
            examples=({"ratio": 0.01, "amplitude": 0.002, "mode": 1},),
            help="Least damping `ratio` of a `mode` (the first) at a modal `amplitude` [√kg m].",
            option_help="Least damping ratio: ratio=…, amplitude=… [√kg m], perhaps mode=…; repeatable.",
        ),
    ),
    read=partial(read_mode, key=_DAMPING, number="ratio", needed=True),
    scale=lambda _scene: 0.01,
)  # fmt: skip


_QUALITY = "quality_factor"


def _quality_rows(judged: Judged) -> list[CriterionRow]:
    """The row of the mode."""
    if (asked := judged.limit(QUALITY)) is None:
        return []
    most, amplitude, mode = asked
    found = damping_of(judged, amplitude, mode)
    ratio, slope, second = found.value, None, None
    if found.slope is not None:
        slope = -0.5 * found.slope / ratio**2
        second = None if found.second is None else partial(_quality_second, ratio, found.slope, found.second)
    value = 0.5 / ratio if ratio > 0.0 else math.nan
    weight = judged.weight(QUALITY) * judged.case.weight
    what = f"quality factor {found.what}"
    return [judged.row(QUALITY, what, value, slope, bound=most, weight=weight, second=second)]


def _quality_second(ratio: float, slope: Real, second: Callable[[], Real]) -> Real:
    """Return the second derivatives of 1/(2ζ)."""
    return slope[:, None] * slope / ratio**3 - 0.5 * second() / ratio**2


QUALITY = Criterion(
    name="quality factor",
    unit="1",
    help="1/(2ζ) of a [nonlinear mode](modes.md) at a modal amplitude; minimised times its `weight`.",
    rows=_quality_rows,
    weight="quality",
    needs=_QUALITY,
    keys=(
        Key(
            name=_QUALITY, annotation=number_or_table("1", "words"), form=Form.NUMBER_OR_TABLE,
            flag="--quality-factor", metavar="WORD=X", example="amplitude=0.002 and most=50",
            examples=({"amplitude": 0.002, "mode": 1, "most": 50},),
            help="Of which `mode` (the first) at which modal `amplitude` [√kg m], and the `most` it may be.",
            option_help="Quality factor: amplitude=… [√kg m], perhaps mode=… and most=…; repeatable.",
        ),
    ),
    read=partial(read_mode, key=_QUALITY, number="most", needed=False),
)  # fmt: skip

CRITERION = (DAMPING, QUALITY)
