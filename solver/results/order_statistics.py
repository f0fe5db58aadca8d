"""What a few samples tell of a quantile: the order statistics between which it lies.

Of n independent samples the number below the quantile q is binomial, whatever their distribution is, so that
the quantile lies between the r-th and the s-th smallest with a probability known beforehand (Hahn, Meeker,
Statistical Intervals, Wiley 1991, section 5.2). Samples of a Latin hypercube tell no less.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from typing import Any

from solver.results import units

CONFIDENCE = 0.95


def enough(count: int, share: float) -> bool:
    """Return whether so many samples have one on either side of a quantile in the mean."""
    return count >= needed(share)


def needed(share: float) -> int:
    """Return the fewest samples that tell a quantile."""
    return math.ceil(1.0 / min(share, 1.0 - share) - 1e-9)


def interval(values: Sequence[float], share: float) -> tuple[float, float]:
    """Return between what a quantile lies with 95 % confidence; NaN for an end that they do not tell.

    Parameters
    ----------
    values : independent samples, all known.
    share : of the quantile, between 0 and 1.
    """
    from scipy.special import bdtr  # loaded when it is needed: it takes a tenth of a second

    ordered, n, missed = sorted(values), len(values), 0.5 * (1.0 - CONFIDENCE)
    low = [r for r in range(1, n + 1) if bdtr(r - 1, n, share) <= missed]
    high = [s for s in range(1, n + 1) if 1.0 - bdtr(s - 1, n, share) <= missed]
    return ordered[low[-1] - 1] if low else math.nan, ordered[high[0] - 1] if high else math.nan


def quantile_json(name: str, value: float, values: Sequence[float], share: float) -> dict[str, object]:
    """Return a quantile with its confidence as a JSON object; null for what so few samples do not tell.

    Parameters
    ----------
    name : of the value, for example ``magnification``.
    value : the estimate; NaN if samples are not known.
    """
    known = math.isfinite(value)
    ends = interval(values, share) if known else (math.nan, math.nan)
    return {
        "share": share, name: value if known and enough(len(values), share) else None,
        "interval": [end if math.isfinite(end) else None for end in ends], "confidence": CONFIDENCE,
    }  # fmt: skip


def quantile_words(
    found: Mapping[str, Any], key: str, samples: str, show: Callable[[float], str] = units.number
) -> str:
    """Return a quantile with the ends between which it lies; that so few samples do not tell it.

    Parameters
    ----------
    found : of `quantile_json`; one of an earlier version has no interval.
    key, samples : name of the value, and what the samples are called.
    show : puts a number in words.
    """
    value = found[key]
    if "interval" not in found:
        return "not known" if value is None else show(value)
    low, high = (None if end is None else show(end) for end in found["interval"])
    sure = f"{100.0 * found['confidence']:g} % sure"
    ends = {
        (True, True): f"{sure}: {low} to {high}", (True, False): f"{sure}: {low} or more, no upper end known",
        (False, True): f"{sure}: {high} or less, no lower end known", (False, False): "no end known",
    }[low is not None, high is not None]  # fmt: skip
    if value is None:
        return f"not told, at least {needed(found['share'])} {samples} are needed ({ends})"
    return f"{show(value)} ({ends})"
