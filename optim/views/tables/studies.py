"""What people read of Campbell diagrams, sensitivities and identifications, given as their JSON objects."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from typing import Any

from solver.results.known import Measured, known_pairs
from solver.results.told import Block, ResultTable, Summary
from solver.results.units import duration, hertz, length, number, quantity, span


def campbell(found: Mapping[str, Any]) -> Iterator[Block]:
    """The crossings, and what every order does at running speeds."""
    low, high = found["speeds_rpm"][0]
    title = f"{found['scene']}, {span(low, high, 'rpm')}, {found['n_harmonics']} harmonics"
    rows = [
        (
            str(order["order"]), number(crossing['speed_rpm']), number(crossing['frequency_hz']),
            _amplitude(crossing),
            "running speed" if crossing["inside"] else f"{number(100 * crossing['margin'], 3)} % away",
        )
        for order in found["orders"]
        for crossing in order["crossings"]
    ]  # fmt: skip
    yield ResultTable(title, ("order", "crossing [rpm]", "peak [Hz]", "amplitude", ""), rows)
    pairs = [*Measured.of_result(found).pairs]
    for order in found["orders"]:
        # What the order does at running speeds.
        highest = order["highest_running"]
        text = "no response at running speeds"
        if highest is not None:
            text = f"at most {_amplitude(highest)}, at {quantity(highest['speed_rpm'], 'rpm')}"
        over = ", ".join(span(low, high, "") for low, high in order["exceeded_running_rpm"])
        if over:
            text += f"; above {length(order['limit'])} from {over} rpm"
        pairs.append((f"order {order['order']}", text))
        for what, name in (("stuck_hz", "all stuck"), ("open_hz", "all open")):
            pairs.append((f"  {name}", ", ".join(number(value) for value in order[what]) + " Hz"))
    pairs += known_pairs(found) if "measure" in found else _open_ends(found["orders"])
    words = {True: "no", False: "yes", None: "unknown"}[found["clear"]]
    what = "a peak" if found["limit"] is None else f"more than {length(found['limit'])}"
    pairs.append((f"{what} at a running speed", words))
    pairs.append(("time", duration(found["seconds"])))
    yield Summary("", pairs)


def _open_ends(orders: Sequence[Mapping[str, Any]]) -> list[tuple[str, str]]:
    """Why a response may have further peaks, of a diagram of an earlier version."""
    found = (order["peak_certificate"] for order in orders if "peak_certificate" in order)
    reasons = dict.fromkeys(one["reason"] for one in found if not one["known"])
    return [("warning", f"a response may have a higher peak. {reason}") for reason in reasons]


def _amplitude(crossing: Mapping[str, Any]) -> str:
    """An amplitude with its estimated error; of an earlier version without."""
    error, height = crossing.get("error_estimate"), crossing["amplitude"]
    if error is None:
        return length(height) + (" ± not known" if "error_estimate" in crossing else "")
    return quantity(height, "m", error)


def shares(found: Mapping[str, Any]) -> Iterator[Block]:
    """The peaks, and a row for every parameter."""
    peaks = [f"{length(peak['value'])} at {hertz(peak['at'])}" for peak in found["peaks"]]
    title = f"{found['scene']}: {'; '.join(peaks) or 'no peak'}"
    if found["band_hz"] is not None:
        title += f"; band {hertz(found['band_hz'])} above {length(found['limit'])}"
    many = len(peaks) > 1
    columns = (
        "parameter", "value",
        *(f"peak {i + 1} [%]" if many else "peak [%]" for i in range(len(peaks))), "band [%]",
    )  # fmt: skip
    rows = [
        (
            row["path"],
            quantity(row["value"], row["unit"]),
            *(_share(share) for share in row["peaks_percent"]),
            _share(row["band_percent"]),
        )
        for row in found["rows"]
    ]
    yield ResultTable(title, columns, rows)
    pairs = [("note", "for 1 % more of the parameter; an angle, or what is 0, has no per cent")]
    if any(row["peak_slope"] is None for row in found["rows"]):
        pairs.append(("status", found["status"]))
    pairs += known_pairs(found) if peaks else []
    pairs += [("left out", f"{one['path']}: {one['reason']}") for one in found["left_out"]]
    yield Summary("", pairs)


def _share(share: float | None) -> str:
    # Added to 0: a share that rounds to nothing has no sign.
    return "" if share is None else f"{round(share, 4) + 0.0:+.4f}"


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
    pairs.append(("time", duration(found["seconds"])))
    yield Summary("", pairs)


def told_pairs(found: Mapping[str, Any]) -> list[tuple[str, str]]:
    """Noise, what the data do not tell or hardly keep apart, what does not count, other optima."""
    pairs: list[tuple[str, str]] = []
    if found["noise"] is not None:
        pairs.append(("noise", f"{number(100.0 * found['noise'], 3)} %"))
    if found["misfit"]:
        chi2 = f" (reduced chi² {number(found['reduced_chi2'], 3)})" if found["reduced_chi2"] > 1.0 else ""
        pairs.append(("warning", found["misfit"] + chi2))
    pairs += [("not told", one["words"]) for one in found["untold"]]
    for one in found["correlated"]:
        names = " and ".join(one["names"])
        pairs.append(("hardly apart", f"{names}, correlation {one['correlation']:+.3f}"))
    pairs += [("not reached", _lost(one)) for one in found["not_reached"]]
    for one in found["other_optima"]:
        values = ", ".join(f"{name} = {number(value)}" for name, value in one.items() if name != "misfit")
        pairs.append(("another optimum", f"{values}; misfit {number(one['misfit'], 3)} times as large"))
    return pairs


def estimate_row(one: Mapping[str, Any]) -> tuple[str, ...]:
    """An unknown: estimate, error, interval, and whether it lies at a bound."""
    if not one["told"]:
        low, high = one["bounds"]
        return one["name"], "not told", "", span(low, high, one["unit"]), "its bounds"
    low, high = one["interval"]
    value = quantity(one["value"], one["unit"])
    words = "at a bound" if one["at_bound"] else ""
    return one["name"], value, number(one["standard_error"], 2), span(low, high, ""), words


def _lost(one: Mapping[str, Any]) -> str:
    places = ", ".join(number(at) for at in one["at"])
    return f"{one['run']}: no response found at {places} Hz; these points do not count"


def candidate_words(one: Mapping[str, Any]) -> str:
    """Conditions of a measurement, and what it would tell."""
    conditions = ", ".join(f"{path} = {number(value)}" for path, value in one["conditions"].items())
    factor, gain = number(one["factor"], 2), number(one["gain"], 3)
    return f"{conditions}: error of {one['tells']} times {factor} (gain {gain})"
