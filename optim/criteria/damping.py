"""The damping ratio of a nonlinear mode at an amplitude, from below.

Its derivatives by the parameters are those of the mode at that amplitude (`solver.modes.gradient`), whatever
the excitation.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import TYPE_CHECKING, Any

from optim.criteria.criterion import Criterion, CriterionContext, CriterionRow, Form, Judged, Key
from optim.criteria.key import number_or_table

if TYPE_CHECKING:
    from solver.scene.scene import Scene

_KEY = "min_damping"
_WORDS = ("ratio", "amplitude", "mode")


def _rows(judged: Judged) -> list[CriterionRow]:
    """The row of the mode; not a number where the mode does not reach the amplitude."""
    import numpy as np

    from solver.errors import SettingError
    from solver.modes.at_amplitudes import mode_at_amplitudes

    if (asked := judged.limit(DAMPING)) is None:
        return []
    ratio, amplitude, mode = asked
    balance, paths = judged.branch.balance, judged.problem.paths if judged.gradients else ()
    what, value, slope = f"damping ratio of mode {mode} at {amplitude:g} √kg m", math.nan, None
    try:
        found = mode_at_amplitudes(
            balance.scene, np.array([amplitude]), paths, mode=mode, harmonics=balance.n_harmonics
        )
        value, slope = float(found.damping_ratio[0]), found.by_damping[0] if judged.gradients else None
    except SettingError:
        pass  # the scene has the mode: this design alone has no equilibrium that it could move about
    return [judged.row(DAMPING, what, value, slope, bound=ratio)]


def _read(asked: CriterionContext) -> tuple[float, float, int]:
    """The least ratio, the modal amplitude and the number of the mode."""
    from optim.errors import DesignError
    from optim.problem.numbers import positive, whole
    from solver.errors import at
    from solver.modes.nonlinear_mode import pose

    given: Any = asked.values[_KEY]
    if not isinstance(given, Mapping) or not {"ratio", "amplitude"} <= set(given):
        raise DesignError(_KEY, given, "must be a table with `ratio`, `amplitude` [√kg m] and perhaps `mode`")
    for word in given:
        if word not in _WORDS:
            raise DesignError((_KEY, word), given[word], f"is not known; there are {', '.join(_WORDS)}")
    number = given.get("mode", 1)
    number = int(number) if isinstance(number, float) and number.is_integer() else number
    mode = whole((_KEY, "mode"), number, least=1)
    with at(_KEY, "mode"):
        pose(asked.scene, mode, None, 1)
    return positive((_KEY, "ratio"), given["ratio"]), positive((_KEY, "amplitude"), given["amplitude"]), mode


def _ratio(_scene: Scene) -> float:
    return 0.01


DAMPING = CRITERION = Criterion(
    name="damping ratio",
    unit="1",
    help="The damping ratio of a [nonlinear mode](modes.md) at a modal amplitude.",
    rows=_rows,
    smaller_is_better=False,
    keys=(
        Key(
            name=_KEY, annotation=number_or_table("1", "words"), form=Form.NUMBER_OR_TABLE,
            flag="--min-damping", metavar="WORD=X", example="ratio=0.01 and amplitude=0.002",
            examples=({"ratio": 0.01, "amplitude": 0.002, "mode": 1},),
            help="Least damping `ratio` of a `mode` (the first) at a modal `amplitude` [√kg m].",
            option_help="Least damping ratio: ratio=…, amplitude=… [√kg m], perhaps mode=…; repeatable.",
        ),
    ),
    read=_read,
    scale=_ratio,
)  # fmt: skip
