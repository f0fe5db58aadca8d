"""What people read of tracked peaks, maps and sensitivities, given as the JSON object a program reads."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from service.rendering.tables.text import print_pairs, print_table, say
from solver.results import units
from solver.results.known import known_pairs
from solver.scene.parameter_paths import parameter

Json = Mapping[str, Any]
Pairs = list[tuple[str, str]]
ON_THE_GRID = "resonances narrower than the grid are not on it: the tracked peaks, or a sweep, have them"


def track(found: Json) -> None:
    """The highest peak over a parameter: both ends, the exchanges, the least."""
    pairs = [*_ridge(found), *_plateau(found), *_sure(found)]
    pairs.append(("points", f"{len(found['parameter'])}, {found['sweeps']} sweeps"))
    pairs.append(("time", units.duration(found["seconds"])))
    print_pairs(_title(found), pairs)


def response_map(found: Json) -> None:
    """The size of a map, its highest amplitude, and its ridge."""
    path = found["parameter_path"]
    known = [
        (value, frequency, at)
        for at, row in zip(found["parameter"], found["amplitude"], strict=True)
        for frequency, value in zip(found["frequency"], row, strict=True)
        if value is not None
    ]
    size = f"{len(found['parameter'])} × {len(found['frequency'])}"
    pairs = [("points", f"{size}, {len(known)} solved, largest residual {found['largest_residual']:.1e}")]
    if known:
        value, frequency, at = max(known)
        place = f"{frequency:.6g} Hz, {path} {parameter(path, at)}"
        pairs.append(("highest of the grid", f"{units.length(value)} at {place}"))
    if found["ridge"] is not None:
        pairs += [*_ridge(found["ridge"]), *_plateau(found["ridge"])]
    else:
        pairs.append(("note", ON_THE_GRID))
    pairs += _sure(found if "measure" in found else found["ridge"] or {})
    pairs.append(("time", units.duration(found["seconds"])))
    print_pairs(_title(found), pairs)


def _title(found: Json) -> str:
    path, values = found["parameter_path"], found["parameter"]
    title = f"{found['scene']}, {path}"
    if values:
        title += f" from {parameter(path, values[0])} to {parameter(path, values[-1])}"
    return f"{title}, {found['n_harmonics']} harmonics"


def _ridge(found: Json) -> Pairs:
    path, best = found["parameter_path"], found["optimum"]
    pairs: Pairs = []
    for name, at in (("first peak", 0), ("last peak", -1)):
        if found["peak"]:
            value, frequency = found["peak"][at], found["frequency"][at]
            pairs.append((name, f"{units.length(value)} at {frequency:.6g} Hz"))
    for exchange in found["exchanges"]:
        height = units.length(exchange["peak"])
        pairs.append(("exchange", f"at {parameter(path, exchange['at'])}, both {height}"))
    if best["at"] is not None:
        held = ", ".join(f"{peak['frequency']:.6g} Hz" for peak in best["active"])
        height = units.length(best["peak"])
        pairs.append(("least peak", f"{height} at {path} = {parameter(path, best['at'])} ({held})"))
    return pairs


def _plateau(found: Json) -> Pairs:
    """How far other values of the parameter are as good."""
    path, best = found["parameter_path"], found["optimum"]
    if best.get("plateau") is None:
        return []
    low, high = (parameter(path, end) for end in best["plateau"])
    return [("as good", f"{low} to {high}"), ("chosen by", best["chosen_by"])]


def _sure(found: Json) -> Pairs:
    """How well the peaks are known; of an earlier version, why a higher one may hide between points."""
    older = [("warning", f"a response may have a higher peak. {why}") for why in found.get("peaks_open", ())]
    return known_pairs(found) if "measure" in found else older


def shares(found: Mapping[str, Any]) -> None:
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
    print_table(title, columns, rows, right="".join(str(i) for i in range(1, min(len(columns), 10))))
    say("for 1 % more of the parameter; an angle, or what is 0, has no per cent")
    if any(row["peak_slope"] is None for row in found["rows"]):
        say(found["status"])
    certificate = found["peak_certificate"]
    if peaks and not certificate["known"]:
        say(f"there may be higher peaks. {certificate['reason']}")
    for name, words in known_pairs(found, besides=("peaks_open",)) if peaks else ():
        say(f"{name}: {words}")
    for one in found["left_out"]:
        say(f"left out: {one['path']}: {one['reason']}")


def _share(share: float | None) -> str:
    # Added to 0: a share that rounds to nothing has no sign.
    return "" if share is None else f"{round(share, 4) + 0.0:+.4f}"
