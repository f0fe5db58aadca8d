"""What people read of sensitivities, given as the JSON object a program reads."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from service.rendering.tables.text import print_table, say
from solver.results import units
from solver.results.known import known_pairs


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
