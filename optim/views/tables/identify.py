"""What people read of an identification, given as the JSON object a program reads."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from typing import Any

from solver.results import units
from solver.results.told import Block, ResultTable, Summary

_CANDIDATES = 5  # shown, the most telling
_TELLING = 0.99  # of an error, above which a measurement lowers none


def identification(found: Mapping[str, Any]) -> Iterator[Block]:
    """The estimates, what the data do not tell, and which measurement would tell most."""
    title = f"{found['scene']}, {len(found['runs'])} runs, {found['n_harmonics']} harmonics"
    rows = [estimate_row(one) for one in found["estimates"]]
    yield ResultTable(title, ("parameter", "estimate", "± error", "95 % interval", ""), rows)
    pairs = told_pairs(found)
    known = [one for one in found["candidates"] if one["gain"] is not None]
    telling = [one for one in known if one["factor"] < _TELLING]
    for place, one in enumerate(telling[:_CANDIDATES]):
        pairs.append(("measure next" if place == 0 else "  or", candidate_words(one)))
    if known and not telling:
        tried = f"none of the {len(known)} conditions tried lowers an error by 1 %"
        pairs.append(("measure next", f"{tried}: try others (--candidate), or another DOF"))
    pairs.append(("starts", f"{found['starts']}, of the best {found['agreeing']} ended at the same place"))
    pairs.append(("time", units.duration(found["seconds"])))
    yield Summary("", pairs)


def told_pairs(found: Mapping[str, Any]) -> list[tuple[str, str]]:
    """Noise, what the data do not tell or hardly keep apart, what does not count, other optima."""
    pairs: list[tuple[str, str]] = []
    if found["noise"] is not None:
        pairs.append(("noise", f"{100.0 * found['noise']:.3g} %"))
    if found["misfit"]:
        chi2 = f" (reduced chi² {found['reduced_chi2']:.3g})" if found["reduced_chi2"] > 1.0 else ""
        pairs.append(("warning", found["misfit"] + chi2))
    pairs += [("not told", one["words"]) for one in found["untold"]]
    for one in found["correlated"]:
        names = " and ".join(one["names"])
        pairs.append(("hardly apart", f"{names}, correlation {one['correlation']:+.3f}"))
    pairs += [("not reached", _lost(one)) for one in found["not_reached"]]
    for one in found["other_optima"]:
        values = ", ".join(f"{name} = {value:.5g}" for name, value in one.items() if name != "misfit")
        pairs.append(("another optimum", f"{values}; misfit {one['misfit']:.3g} times as large"))
    return pairs


def estimate_row(one: Mapping[str, Any]) -> tuple[str, ...]:
    """An unknown: estimate, error, interval, and whether it lies at a bound."""
    if not one["told"]:
        low, high = one["bounds"]
        return one["name"], "not told", "", f"{low:.6g} to {high:.6g} {one['unit']}", "its bounds"
    low, high = one["interval"]
    value = f"{one['value']:.6g} {one['unit']}".rstrip()
    words = "at a bound" if one["at_bound"] else ""
    return one["name"], value, f"{one['standard_error']:.2g}", f"{low:.6g} to {high:.6g}", words


def _lost(one: Mapping[str, Any]) -> str:
    places = ", ".join(f"{at:.6g}" for at in one["at"])
    return f"{one['run']}: no response found at {places} Hz; these points do not count"


def candidate_words(one: Mapping[str, Any]) -> str:
    """Conditions of a measurement, and what it would tell."""
    conditions = ", ".join(f"{path} = {value:.4g}" for path, value in one["conditions"].items())
    return f"{conditions}: error of {one['tells']} times {one['factor']:.2g} (gain {one['gain']:.3g})"
