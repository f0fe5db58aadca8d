"""What people read of responses and plans, given as the JSON object a program reads."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping, Sequence
from typing import Any

from solver.results import units
from solver.results.measures import HALF_PEAK_TO_PEAK, MAX_ABS, WORDS, Measured
from solver.results.notes import BAND_OPEN, FLAGS, between_points, drift_words, flag_words, note_pairs
from solver.results.told import Block, ResultTable, Summary
from solver.scene.parameter_paths import parameter

Json = Mapping[str, Any]
Pairs = list[tuple[str, str]]

ROUNDING = 1e-14  # share of the largest harmonic that may be left where there is none
_ACCURACY_COLUMNS = ("", "harmonics", "contact forces", "max|x|", "error", "ms", "iterations")
_SOLUTION_COLUMNS = ("half peak to peak", "mean", "", "largest multiplier", "found by", "residual forces")
_EFFECT_COLUMNS = ("used", "effect", "reason")


def plan(found: Json) -> Iterator[Block]:
    """The effects in use and left out, the sizes and the cost."""
    effects = [("yes" if e["used"] else "no", e["name"], e["reason"]) for e in found["effects"]]
    yield ResultTable(f"Plan of {found['scene']}", _EFFECT_COLUMNS, effects)
    seconds = found["estimated_seconds_of_stability"]
    stability = "not known" if seconds is None else f"about {units.duration(seconds)} a response"
    yield Summary(
        "",
        [
            (
                "unknowns",
                f"{found['unknowns']} ({found['contacts']} contacts, {found['n_harmonics']} harmonics)",
            ),
            ("linear DOFs", str(found["linear_dofs"])),
            ("dense matrices", f"{found['estimated_dense_bytes'] / 1e6:.3g} MB"),
            ("performance curve", found["performance_curve"]),
            ("estimated cost", f"{units.duration(found['estimated_seconds_a_point'])} a point of a branch"),
            ("stability", stability),
            *note_pairs(found),
        ],
    )


def solution(found: Json) -> Iterator[Block]:
    """One response, or all that were found."""
    if found.get("solutions") is not None:
        yield from _all_solutions(found)
        return
    title = f"{found['scene']} at {found['frequency_hz']:g} Hz, {found['n_harmonics']} harmonics"
    if not found["converged"]:
        yield Summary(title, [("converged", "no"), *_drift(found), *_notes(found)])
        return
    pairs = _amplitudes(found)
    if found["error_estimate"] is not None:
        of = WORDS[HALF_PEAK_TO_PEAK if "mean_undetermined" in found["flags"] else MAX_ABS]
        pairs.append(("estimated error", f"{units.length(found['error_estimate'])} of {of}"))
    pairs += proved([found["certificate"]] if found.get("certificate") else [])
    pairs.append(("harmonics 1 to 5", _harmonics(found["harmonics"])))
    pairs += [(f"contact {name}", state) for name, state in found["contacts"].items()]
    if "stable" in found:
        pairs.append(("stable", f"{found['stable']}: {found['stable_ground']}"))
    if "unique" in found:
        pairs.append(("one response alone", f"{found['unique']}: {found['unique_ground']}"))
    pairs += _notes(found)
    low, high = found.get("mean_range", (None, None))
    if low is not None and high is not None:
        pairs.append(("mean, any history", f"{units.length(low)} to {units.length(high)}"))
    pairs += [("residual", f"{found['residual']:.1e}"), ("time", units.duration(found["seconds"]))]
    yield Summary(title, pairs)


def _notes(found: Json) -> Pairs:
    """What a response says of itself by flags, and its notes."""
    return [("note", words) for words in flag_words(found.get("flags", ()))] + note_pairs(found)


def _harmonics(amplitudes: Sequence[float]) -> str:
    """Return the first five; what rounding leaves of one is 0."""
    least = ROUNDING * max(amplitudes)
    return ", ".join(units.length(a if a > least else 0.0) for a in amplitudes[1:6])


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
        at = "" if of == "response" else f" at {proof['frequency_hz'][0]:.12g} Hz"
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
                "" if stable is None else f"{stable['radius']:.4g}",
                each["found_by"],
                f"max|x| {' to '.join(map(units.length, ends))}" if ends else "",
            )
        )
    if found["solutions"]:
        first = found["solutions"][0]
        title = f"{first['scene']} at {first['frequency_hz']:g} Hz, {first['n_harmonics']} harmonics"
        yield ResultTable(title, _SOLUTION_COLUMNS, rows)
    alone = f"{found['unique']}: {found['unique_ground']}"
    yield Summary("", [("one response alone", alone), ("note", found["note"])])


def branch(found: Json) -> Iterator[Block]:
    """A branch: its peaks and its band."""
    path = found["parameter_path"]
    pairs = [*Measured.of_result(found).pairs, *_peaks(found, path)]
    if found["error_estimate"] is not None:
        pairs.append(("estimated error", f"{units.length(found['error_estimate'])} of the highest"))
    if found.get("stable"):
        pairs.append(("stable at the peak", f"{found['stable']}: {found['stable_ground']}"))
    if found.get("mean_undetermined"):
        pairs.append(("note", "at the highest peak " + FLAGS["mean_undetermined"]))
    if found["band_hz"] is not None:
        pairs.append(("band", _band(found)))
    effort = f"{found['newton_iterations']} Newton iterations, {found['rejected_steps']} steps rejected"
    pairs += sure_of(found)
    pairs += _drift(found)
    pairs += _notes(found) + _marks(found, path)
    pairs.append(("points", f"{found['points']} ({effort}, {found['folds']} folds)"))
    pairs.append(("time", units.duration(found["seconds"])))
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
            f"{units.length(mark['amplitude'])} at {parameter(path, mark['at'])}",
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


def accuracy(found: Json) -> Iterator[Block]:
    """Error against time, the rows nothing beats marked."""
    size = found["reference"]
    rows = [
        (
            "*" if row["pareto"] else "",
            str(row["harmonics"] or ""),
            row["evaluator"] if row["samples"] == 0 else f"{row['samples']} samples",
            units.length(row["max_abs"]),
            f"{row['error'] / size:.1e}" if size > 0.0 else "",
            f"{row['milliseconds']:.3g}",
            str(row["iterations"]),
        )
        for row in found["rows"]
    ]
    title = f"{found['scene']} at {found['frequency_hz']:.6g} Hz: {units.length(size)}"
    if found["reference_error"] is not None:
        by = found["reference_harmonics"]
        way = f"with {by} harmonics" if by else "exact"
        title += f" {way}, to {units.length(found['reference_error'])}"
    yield ResultTable(title, _ACCURACY_COLUMNS, rows)
    yield Summary("", [("*", "nothing else here is both as accurate and as fast")])


def march(found: Json) -> Iterator[Block]:
    """What a time march came to."""
    pairs = _amplitudes(found)
    if found["error_estimate"] is not None:
        pairs.append(("estimated error", f"{found['error_estimate']:.1e} of max|x|"))
    pairs.append(("periods", f"{found['periods']} of {found['steps_per_period']} steps"))
    pairs.append(("time", units.duration(found["seconds"])))
    yield Summary("Time march", pairs)


def transient(found: Json) -> Iterator[Block]:
    """What a run through a range of frequencies came to."""
    begin, end = units.number(found["begin_hz"]), units.number(found["end_hz"])
    pairs = []
    if found["max_abs"] is not None:
        at = f"{units.number(found['at_hz'])} Hz, after {units.number(found['at_seconds'])} s"
        pairs.append(("largest max|x|", f"{units.length(found['max_abs'])} at {at}"))
    if found["error_estimate"] is not None:
        pairs.append(("estimated error", f"{found['error_estimate']:.1e} of it"))
    for rate, size in zip(found.get("rates") or [], found.get("rates_max_abs") or [], strict=True):
        pairs.append((f"at {units.number(rate)} Hz/s", units.length(size)))
    took = f"{units.number(found['ramp_seconds'])} s"
    if found["ring_down_seconds"] > 0.0:
        took += f", then {units.number(found['ring_down_seconds'])} s without excitation"
    pairs += [("run", took), ("steps", f"{found['steps_per_period']} a period of the highest frequency")]
    pairs.append(("time", units.duration(found["seconds"])))
    yield Summary(f"{found['scene']} from {begin} to {end} Hz", pairs)


def _reached(hours: float) -> str:
    return f"reached after {units.number(hours)} h" if hours > 0.0 else "exceeded from the beginning"


def wear_life(found: Json) -> Iterator[Block]:
    """What contacts lose over hours, and what the response comes to."""
    hours, amplitude, pairs = found["hours"], found["amplitude"], _chosen(found.get("chosen"))
    where = "at the highest peak" if found["at_peak"] else "at given frequencies"
    if hours:
        for name, at in (("max|x| at the beginning", 0), (f"after {units.number(hours[-1])} h", -1)):
            pairs.append(
                (name, f"{units.length(amplitude[at])} at {units.number(found['frequency_hz'][at])} Hz")
            )
        pairs.append(
            ("largest", f"{units.length(found['highest'])} after {units.number(found['highest_hours'])} h")
        )
    if found["limit"] is not None:
        met = found["hours_to_limit"]
        said = "not reached" if met is None else _reached(met)
        pairs.append((f"limit {units.length(found['limit'])}", said))
    used, met = found.get("used", ()), found.get("hours_to_margin")
    if met is not None or any(one is not None for one in used):
        # Beside a margin that is known, null is a mean stress that leaves nothing.
        first, last = ("infinite" if one is None else units.number(one, 4) for one in (used[0], used[-1]))
        share = f"{first} at the beginning, {last} at the end"
        pairs.append(("of the stress allowed", share))
        pairs.append(("margin 1", "kept" if met is None else _reached(met)))
    for one in found["switches"]:
        pairs.append(("another peak is highest", f"from {units.number(one)} h on"))
    if found["ended_by"]:
        pairs.append(("ended by", found["ended_by"]))
    pairs.append(("steps", f"{found['steps']}, {found['responses']} responses"))
    pairs.append(("time", units.duration(found["seconds"])))
    yield Summary(f"{found['scene']}, wear {where}", pairs)
    if hours:
        of_each = (found[key] for key in ("contacts", "depths", "loads", "power"))
        rows = [
            (
                name, units.length(depth[-1]), _force(load[0]), _force(load[-1]), f"{power[0]:.4g} W",
                f"{power[-1]:.4g} W",
            )
            for name, depth, load, power in zip(*of_each, strict=True)
        ]  # fmt: skip
        heads = ("contact", "depth", "load at first", "at last", "power at first", "at last")
        yield ResultTable("Contacts", heads, rows)
    if found["paths"]:
        columns = [found[f"{name}_slopes"] for name in ("end", "highest", "limit", "margin")]
        slopes = [
            (path, *("" if one is None else f"{one:.6g}" for one in each))
            for path, *each in zip(found["paths"], *columns, strict=True)
        ]
        by = ("by", "of the last amplitude", "of the largest", "of the time to the limit", "to margin 1")
        yield ResultTable("Derivatives", by, slopes)


def _chosen(found: Json | None) -> list[tuple[str, str]]:
    """What was chosen for the life, and the worst amplitude with it."""
    if found is None:
        return []
    if found["at"] is None:
        return [("chosen", found["status"])]
    worst = f"{units.length(found['worst'])} at worst, {units.length(found['first'])} when new"
    return [
        (found["parameter"], f"{units.number(found['at'], 6)} {found['unit']}".rstrip()),
        ("chosen", worst),
    ]


def least_worn_peak(found: Json) -> Iterator[Block]:
    """The best value of a parameter for contacts that wear."""
    pairs: Pairs = []
    if found["at"] is not None:
        pairs.append(("best", f"{found['parameter']} = {parameter(found['parameter'], found['at'])}"))
        when = f"after {units.number(found['worst_hours'])} h"
        pairs.append(("worst amplitude", f"{units.length(found['worst'])} {when}"))
        pairs.append(("before anything is worn", units.length(found["first"])))
    pairs += [("lives looked at", str(len(found["looked_at"]))), ("time", units.duration(found["seconds"]))]
    yield Summary(f"{found['scene']}, least amplitude of worn contacts", pairs)


def _force(value: float | None) -> str:
    return "" if value is None else f"{units.number(value)} N"


def _amplitudes(found: Json) -> Pairs:
    known = {key: found[key] for key in WORDS if found[key] is not None}
    show = units.length_unit(max((abs(value) for value in known.values()), default=0.0)).show
    return [(WORDS[key], show(value)) for key, value in known.items()]


def _peaks(found: Json, path: str) -> Pairs:
    peak, interior = found["peak"], found["peaks"]
    if peak is None:
        return []
    highest = "peak" if peak in interior else "highest, at an end"
    others = [other for other in interior if other != peak]
    named = [(highest, peak), *(("further peak", other) for other in others)]
    return [(name, f"{units.length(p['value'])} at {parameter(path, p['at'])}") for name, p in named]


def _band(found: Json) -> str:
    above = f"{units.number(found['band_hz'])} Hz above {units.length(found['band_limit'])}"
    intervals = [f"{low:.6g} to {high:.6g}" for low, high in found["band_intervals_hz"]]
    return f"{above}: {', '.join(intervals)}" if intervals else above


def _torus_curve(found: Json) -> Iterator[Block]:
    """The responses to two base frequencies over the first of them."""
    keys = ("max_abs", "rms", "first_amplitude", "second_amplitude", "error_estimate")
    rows = []
    for i, hertz in enumerate(found["frequency_hz"]):
        sizes = ["" if found[key][i] is None else units.length(found[key][i]) for key in keys]
        note = "repeats" if found["repeats"][i] else "" if found["known"][i] else "not known well"
        rows.append((units.number(hertz), *sizes, note))
    heads = ("frequency [Hz]", "max|x|", "root mean square", "at the first", "at the second", "± error", "")
    yield ResultTable(f"{found['scene']} with {units.number(found['second_hz'])} Hz", heads, rows)
    yield Summary("", [("time", units.duration(found["seconds"]))])


def quasi_periodic(found: Json) -> Iterator[Block]:
    """What the response to two base frequencies is, or a curve of such responses."""
    if isinstance(found["frequency_hz"], list):
        yield from _torus_curve(found)
        return
    first, second = units.number(found["frequency_hz"]), units.number(found["second_hz"])
    pairs = []
    if found["max_abs"] is not None:
        pairs += [
            ("max|x|", units.length(found["max_abs"])),
            ("half peak to peak", units.length(found["half_peak_to_peak"])),
            ("root mean square", units.length(found["rms"])),
            (f"amplitude at {first} Hz", units.length(found["first_amplitude"])),
            (f"amplitude at {second} Hz", units.length(found["second_amplitude"])),
        ]
        if found["error_estimate"] is not None:
            pairs.append(
                ("estimated error", f"{found['error_estimate'] / found['half_peak_to_peak']:.1e} of it")
            )
        between = " and ".join(f"{p} : {q}" for p, q in found["turns"])
        pairs.append(("repeats after turns" if found["repeats"] else "between turns", between))
    pairs += [(name, state) for name, state in found["contacts"].items()]
    pairs += [("flags", ", ".join(found["flags"]))] if found["flags"] else []
    pairs.append(("time", units.duration(found["seconds"])))
    yield Summary(f"{found['scene']} at {first} and {second} Hz", pairs)
