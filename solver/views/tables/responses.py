"""What people read of responses and plans, given as the JSON object a program reads."""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterable, Iterator, Mapping
from typing import Any

from solver.results import units
from solver.results.known import (
    BAND_OPEN,
    FLAGS,
    HALF_PEAK_TO_PEAK,
    MAX_ABS,
    WORDS,
    Measured,
    between_points,
    drift_words,
    flag_words,
    note_pairs,
    stable_pairs,
)
from solver.results.told import Block, ResultTable, Summary
from solver.results.units import duration, hertz, number, quantity, span
from solver.scene.parameter_paths import parameter

Json = Mapping[str, Any]
Pairs = list[tuple[str, str]]

ROUNDING = 1e-14  # share of the largest harmonic that may be left where there is none
_SOLUTION_COLUMNS = ("half peak to peak", "mean", "", "largest multiplier", "found by", "residual forces")
_EACH_CONTACT = 20  # of more contacts it is counted how many are in each state
_EFFECT_COLUMNS = ("used", "effect", "reason")


def plan(found: Json) -> Iterator[Block]:
    """The effects in use and left out, the sizes and the cost."""
    effects = [("yes" if e["used"] else "no", e["name"], e["reason"]) for e in found["effects"]]
    yield ResultTable(f"Plan of {found['scene']}", _EFFECT_COLUMNS, effects)
    seconds = found["estimated_seconds_of_stability"]
    stability = "not known" if seconds is None else f"about {duration(seconds)} a response"
    yield Summary(
        "",
        [
            (
                "unknowns",
                f"{found['unknowns']} ({found['contacts']} contacts, {found['n_harmonics']} harmonics)",
            ),
            ("linear DOFs", str(found["linear_dofs"])),
            ("dense matrices", f"{number(found['estimated_dense_bytes'] / 1e6, 3)} MB"),
            ("performance curve", found["performance_curve"]),
            ("estimated cost", f"{duration(found['estimated_seconds_a_point'])} a point of a branch"),
            ("stability", stability),
            *note_pairs(found),
        ],
    )


def solution(found: Json) -> Iterator[Block]:
    """One response, or all that were found."""
    if found.get("solutions") is not None:
        yield from _all_solutions(found)
        return
    title = f"{found['scene']} at {hertz(found['frequency_hz'])}, {found['n_harmonics']} harmonics"
    if not found["converged"]:
        yield Summary(title, [("converged", "no"), *_drift(found), *_notes(found)])
        return
    of = HALF_PEAK_TO_PEAK if "mean_undetermined" in found["flags"] else MAX_ABS
    pairs = _amplitudes(found, of, found["error_estimate"])
    pairs += proved([found["certificate"]] if found.get("certificate") else [])
    # The first five; what rounding leaves of one is 0.
    amplitudes = found["harmonics"]
    least = ROUNDING * max(amplitudes)
    told = ", ".join(units.length(a if a > least else 0.0) for a in amplitudes[1:6])
    pairs.append(("harmonics 1 to 5", told))
    states = found["contacts"]
    pairs += [(f"contact {name}", state) for name, state in states.items()][:_EACH_CONTACT]
    if len(states) > _EACH_CONTACT:
        counts = Counter(states.values()).items()
        pairs.append((f"all {len(states)}", ", ".join(f"{count}: {state}" for state, count in counts)))
    pairs += stable_pairs(found)
    if "unique" in found:
        pairs.append(("one response alone", f"{found['unique']}: {found['unique_ground']}"))
    pairs += _notes(found)
    low, high = found.get("mean_range", (None, None))
    if low is not None and high is not None:
        pairs.append(("mean, any history", f"{units.length(low)} to {units.length(high)}"))
    pairs += [("residual", number(found["residual"], 2)), ("time", duration(found["seconds"]))]
    yield Summary(title, pairs)


def _notes(found: Json) -> Pairs:
    """What a response says of itself by flags, and its notes."""
    return [("note", words) for words in flag_words(found.get("flags", ()))] + note_pairs(found)


def proved(proofs: Iterable[Json]) -> Pairs:
    """Return what is proved of a response and of peaks, or why nothing is."""
    pairs = []
    for proof in proofs:
        of = proof.get("proves", "response")
        if not proof["certified"]:
            pairs.append(("proved", f"no {of}: {proof['reason'] or proof['status']}"))
            continue
        held = of == "response" and proof["held"]
        what = WORDS[HALF_PEAK_TO_PEAK if held else MAX_ABS] if of == "response" else of
        low, high = proof["half_peak_to_peak" if held else "max_abs"]
        at = "" if of == "response" else f" at {hertz(proof['frequency_hz'][0])}"
        factor = proof["load_factor"]
        least = f", the load {factor[0]!r} to {factor[1]!r} of that" if of == "least peak" else ""
        pairs.append(("proved", f"{what} from {low!r} to {high!r} m{at}{least}"))
    return pairs


def _drift(found: Json) -> list[tuple[str, str]]:
    """Return how far a part drifts in a period, where one ratchets and it was looked for."""
    if "drift_per_period" not in found:
        return []
    return [("drifts", drift_words(found["drift_per_period"], found["flags"]))]


def _all_solutions(found: Json) -> Iterator[Block]:
    """The solutions of one frequency, and whether there are others."""
    rows = []
    for each in found["solutions"]:
        stable, left = each["stability"], each["residual_forces"]
        ends = [] if left is None else [end for end in left["max_abs"] if end is not None]
        rows.append(
            (
                units.length(each["half_peak_to_peak"]),
                units.length(each["mean"]),
                "not known" if stable is None else "stable" if stable["stable"] else "not stable",
                "" if stable is None else number(stable["radius"]),
                each["found_by"],
                f"max|x| {' to '.join(map(units.length, ends))}" if ends else "",
            )
        )
    if found["solutions"]:
        first = found["solutions"][0]
        title = f"{first['scene']} at {hertz(first['frequency_hz'])}, {first['n_harmonics']} harmonics"
        yield ResultTable(title, _SOLUTION_COLUMNS, rows)
    alone = f"{found['unique']}: {found['unique_ground']}"
    yield Summary("", [("one response alone", alone), ("note", found["note"])])


def branch(found: Json) -> Iterator[Block]:
    """A branch: its peaks and its band."""
    path = found["parameter_path"]
    pairs = [*Measured.of_result(found).pairs, *_peaks(found, path)]
    pairs += stable_pairs(found, "stable at the peak")
    if found.get("mean_undetermined"):
        pairs.append(("note", "at the highest peak " + FLAGS["mean_undetermined"]))
    if found["band_hz"] is not None:
        above = f"{hertz(found['band_hz'])} above {_size(found, found['band_limit'])}"
        intervals = [span(low, high, "Hz") for low, high in found["band_intervals_hz"]]
        pairs.append(("band", f"{above}: {', '.join(intervals)}" if intervals else above))
    effort = f"{found['newton_iterations']} Newton iterations, {found['rejected_steps']} steps rejected"
    pairs += sure_of(found)
    pairs += _drift(found)
    pairs += _notes(found) + _marks(found, path)
    pairs.append(("points", f"{found['points']} ({effort}, {found['folds']} folds)"))
    pairs.append(("time", duration(found["seconds"])))
    yield Summary(title_over(found), pairs)


def title_over(found: Json) -> str:
    """Scene, parameter with its ends, and harmonics of what goes over a parameter."""
    path, values = found["parameter_path"], found["parameter"]
    ends = f" from {parameter(path, values[0])} to {parameter(path, values[-1])}" if values else ""
    return f"{found['scene']}, {path}{ends}, {found['n_harmonics']} harmonics"


def _marks(found: Json, path: str) -> Pairs:
    """Folds, branch points and ends, what is not stable, and the branches that were followed."""
    pairs = [
        (
            mark["kind"].replace("_", " "),
            f"{_size(found, mark['amplitude'])} at {parameter(path, mark['at'])}",
        )
        for mark in found.get("marks", ())
    ]
    values = found["parameter"]
    for first, last in found.get("unstable", ()):
        ends = f"{parameter(path, values[first])} to {parameter(path, values[last])}"
        pairs.append(("not stable", f"{last - first + 1} points, {ends}"))
    for each in found.get("branches", ()):
        parts = [
            f"{one['points']} points to {parameter(path, one['parameter'][-1])}" for one in each["branches"]
        ]
        pairs.append((f"leaving at {parameter(path, each['mark']['at'])}", ", ".join(parts) or "not met"))
    return pairs


def sure_of(found: Json) -> Pairs:
    """What a branch knows between its points; nothing of one that an earlier version computed."""
    certificate = found.get("peak_certificate")
    if certificate is None or found["peak"] is None:
        return []
    said = between_points(known=certificate["known"], reason=certificate["reason"])
    pairs = [("between points", said)]
    if certificate["known"] and found.get("band_known") is False:
        pairs.append(("note", BAND_OPEN))
    return pairs


def march(found: Json) -> Iterator[Block]:
    """What a time march came to."""
    share = found["error_estimate"]
    pairs = _amplitudes(found, MAX_ABS, None if share is None else share * (found[MAX_ABS] or 0.0))
    pairs.append(("periods", f"{found['periods']} of {found['steps_per_period']} steps"))
    pairs.append(("time", duration(found["seconds"])))
    yield Summary("Time march", pairs)


def transient(found: Json) -> Iterator[Block]:
    """What a run through a range of frequencies came to."""
    pairs = []
    if found["max_abs"] is not None:
        at = f"{hertz(found['at_hz'])}, after {quantity(found['at_seconds'], 's')}"
        share = found["error_estimate"]
        error = None if share is None else share * found["max_abs"]
        pairs.append(("largest max|x|", f"{_size(found, found['max_abs'], error)} at {at}"))
    for rate, size in zip(found.get("rates") or [], found.get("rates_max_abs") or [], strict=True):
        pairs.append((f"at {quantity(rate, 'Hz/s')}", units.length(size)))
    took = quantity(found["ramp_seconds"], "s")
    if found["ring_down_seconds"] > 0.0:
        took += f", then {quantity(found['ring_down_seconds'], 's')} without excitation"
    pairs += [("run", took), ("steps", f"{found['steps_per_period']} a period of the highest frequency")]
    pairs.append(("time", duration(found["seconds"])))
    yield Summary(f"{found['scene']} from {span(found['begin_hz'], found['end_hz'], 'Hz')}", pairs)


def _size(found: Json, value: float, error: float | None = None) -> str:
    """An amplitude of a result with its error, in its own unit."""
    return quantity(value, Measured.of_result(found).unit, error)


def _amplitudes(found: Json, of: str, error: float | None) -> Pairs:
    known = {key: found[key] for key in WORDS if found[key] is not None}
    return [(WORDS[key], _size(found, value, error if key == of else None)) for key, value in known.items()]


def _peaks(found: Json, path: str) -> Pairs:
    peak, interior = found["peak"], found["peaks"]
    if peak is None:
        return []
    highest = "peak" if peak in interior else "highest, at an end"
    others = [other for other in interior if other != peak]
    named = [(highest, peak), *(("further peak", other) for other in others)]
    errors = (found["error_estimate"], *(None for _ in others))
    sizes = [_size(found, p["value"], error) for (_, p), error in zip(named, errors, strict=True)]
    return [
        (name, f"{size} at {parameter(path, p['at'])}") for (name, p), size in zip(named, sizes, strict=True)
    ]
