"""What people read of a quantile of samples, given as the JSON object a program reads."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import Any

from solver.results.order_statistics import needed


def quantile_words(
    found: Mapping[str, Any], key: str, samples: str, show: Callable[[float], str] = "{:.4g}".format
) -> str:
    """A quantile with the ends between which it lies; that so few samples do not tell it.

    Parameters
    ----------
    found : of `solver.results.order_statistics.quantile_json`; one of an earlier version has no interval.
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
