"""What people read of Campbell diagrams and of sensitivities, given as the JSON object a program reads."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from typing import Any

from solver.results import units
from solver.results.known import known_pairs
from solver.results.measures import Measured
from solver.results.told import Block, ResultTable, Summary


def campbell(found: Mapping[str, Any]) -> Iterator[Block]:
    """The crossings, and what every order does at running speeds."""
    low, high = found["speeds_rpm"][0]
    title = f"{found['scene']}, {low:g} to {high:g} rpm, {found['n_harmonics']} harmonics"
    rows = [
        (
            str(order["order"]), f"{crossing['speed_rpm']:.6g}", f"{crossing['frequency_hz']:.6g}",
            _amplitude(crossing),
            "running speed" if crossing["inside"] else f"{100.0 * crossing['margin']:.3g} % away",
        )
        for order in found["orders"]
        for crossing in order["crossings"]
    ]  # fmt: skip
    yield ResultTable(title, ("order", "crossing [rpm]", "peak [Hz]", "amplitude", ""), rows)
    pairs = [*Measured.of_result(found).pairs]
    for order in found["orders"]:
        pairs.append((f"order {order['order']}", _running(order)))
        for what, name in (("stuck_hz", "all stuck"), ("open_hz", "all open")):
            pairs.append((f"  {name}", ", ".join(f"{value:.5g}" for value in order[what]) + " Hz"))
    pairs += known_pairs(found) if "measure" in found else _open_ends(found["orders"])
    words = {True: "no", False: "yes", None: "unknown"}[found["clear"]]
    what = "a peak" if found["limit"] is None else f"more than {units.length(found['limit'])}"
    pairs.append((f"{what} at a running speed", words))
    pairs.append(("time", units.duration(found["seconds"])))
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
        return units.length(height) + (" ± not known" if "error_estimate" in crossing else "")
    unit = units.length_unit(height)
    return f"{units.number(height * unit.per_metre)} ± {units.number(error * unit.per_metre, 2)} {unit.name}"


def _running(order: Mapping[str, Any]) -> str:
    """What one order does at running speeds, in words."""
    highest = order["highest_running"]
    text = "no response at running speeds"
    if highest is not None:
        text = f"at most {_amplitude(highest)}, at {highest['speed_rpm']:.6g} rpm"
    over = ", ".join(f"{low:.6g} to {high:.6g}" for low, high in order["exceeded_running_rpm"])
    if over:
        text += f"; above {units.length(order['limit'])} from {over} rpm"
    return text


def shares(found: Mapping[str, Any]) -> Iterator[Block]:
    """The peaks, and a row for every parameter."""
    peaks = [f"{units.length(peak['value'])} at {peak['at']:.6g} Hz" for peak in found["peaks"]]
    title = f"{found['scene']}: {'; '.join(peaks) or 'no peak'}"
    if found["band_hz"] is not None:
        title += f"; band {units.number(found['band_hz'])} Hz above {units.length(found['limit'])}"
    many = len(peaks) > 1
    columns = (
        "parameter", "value",
        *(f"peak {i + 1} [%]" if many else "peak [%]" for i in range(len(peaks))), "band [%]",
    )  # fmt: skip
    rows = [
        (
            row["path"],
            f"{units.number(row['value'], 6)} {row['unit']}".rstrip(),
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
