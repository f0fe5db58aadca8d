"""What people read of a result, given as the JSON object a program reads."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from typing import TYPE_CHECKING, Any

from service.rendering.tables.text import print_pairs, print_table, say
from solver.results import units
from solver.results.notes import BAND_OPEN, FLAGS, between_points, drift_words, flag_words
from solver.results.views import on_demand
from solver.scene.parameter_paths import parameter

if TYPE_CHECKING:
    from solver.scene.scene import Scene

Json = Mapping[str, Any]
Pairs = list[tuple[str, str]]

_ACCURACY_COLUMNS = ("", "harmonics", "contact forces", "max|x|", "error", "ms", "iterations")
_SOLUTION_COLUMNS = ("half peak to peak", "mean", "", "largest multiplier", "found by", "residual forces")
_EFFECT_COLUMNS = ("used", "effect", "reason")
_SCENE_COLUMNS = ("name", "kind", "DOFs", "contacts", "observed", "band")


def scenes(known: Sequence[Scene]) -> None:
    """A table of scenes."""
    rows = [
        (
            scene.name,
            scene.structure.kind,
            str(len(scene.dofs)),
            ", ".join(contact.name for contact in scene.contacts),
            scene.observe.dof,
            f"{scene.observe.band[0]:g} to {scene.observe.band[1]:g} Hz",
        )
        for scene in known
    ]
    print_table("Shipped scenes", _SCENE_COLUMNS, rows)


def plan(found: Json) -> None:
    """The effects in use and left out, the sizes and the cost."""
    effects = [("yes" if e["used"] else "no", e["name"], e["reason"]) for e in found["effects"]]
    print_table(f"Plan of {found['scene']}", _EFFECT_COLUMNS, effects)
    seconds = found["estimated_seconds_of_stability"]
    stability = "not known" if seconds is None else f"about {units.duration(seconds)} a response"
    print_pairs(
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
        ],
    )


def solution(found: Json) -> None:
    """One response, or all that were found."""
    if found.get("solutions") is not None:
        all_solutions(found)
        return
    title = f"{found['scene']} at {found['frequency_hz']:g} Hz, {found['n_harmonics']} harmonics"
    if not found["converged"]:
        notes = [("note", words) for words in flag_words(found["flags"])]
        print_pairs(title, [("converged", "no"), *_drift(found), *notes])
        return
    pairs = _amplitudes(found)
    if found["error_estimate"] is not None:
        of = "half peak to peak" if "mean_undetermined" in found["flags"] else "max|x|"
        pairs.append(("estimated error", f"{units.length(found['error_estimate'])} of {of}"))
    pairs.append(("harmonics 1 to 5", ", ".join(units.length(a) for a in found["harmonics"][1:6])))
    pairs += [(f"contact {name}", state) for name, state in found["contacts"].items()]
    if "stable" in found:
        pairs.append(("stable", f"{found['stable']}: {found['stable_ground']}"))
    if "unique" in found:
        pairs.append(("one response alone", f"{found['unique']}: {found['unique_ground']}"))
    pairs += [("note", words) for words in flag_words(found["flags"])]
    low, high = found.get("mean_range", (None, None))
    if low is not None and high is not None:
        pairs.append(("mean, any history", f"{units.length(low)} to {units.length(high)}"))
    pairs += [("residual", f"{found['residual']:.1e}"), ("time", units.duration(found["seconds"]))]
    print_pairs(title, pairs)


def _drift(found: Json) -> list[tuple[str, str]]:
    """Return how far a part drifts in a period, where one ratchets and it was looked for."""
    if "drift_per_period" not in found:
        return []
    return [("drifts", drift_words(found["drift_per_period"], found["flags"]))]


def all_solutions(found: Json) -> None:
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
        print_table(title, _SOLUTION_COLUMNS, rows, right="013")
    say(f"One response alone: {found['unique']}. {found['unique_ground']}")
    say(found["note"])


def branch(found: Json) -> None:
    """A branch: its peaks and its band."""
    path, values = found["parameter_path"], found["parameter"]
    pairs = _peaks(found, path)
    if found["error_estimate"] is not None:
        pairs.append(("estimated error", f"{units.length(found['error_estimate'])} of the highest"))
    if found.get("stable"):
        pairs.append(("stable", f"at the highest peak {found['stable']}: {found['stable_ground']}"))
    if found.get("mean_undetermined"):
        pairs.append(("note", "at the highest peak " + FLAGS["mean_undetermined"]))
    if found["band_hz"] is not None:
        pairs.append(("band", _band(found)))
    effort = f"{found['newton_iterations']} Newton iterations, {found['rejected_steps']} steps rejected"
    pairs += sure_of(found)
    pairs += _drift(found)
    pairs += [("note", words) for words in flag_words(found.get("flags", ()))]
    pairs += _marks(found, path)
    pairs.append(("points", f"{found['points']} ({effort}, {found['folds']} folds)"))
    pairs.append(("time", units.duration(found["seconds"])))
    title = f"{found['scene']}, {path}"
    if values:
        title += f" from {parameter(path, values[0])} to {parameter(path, values[-1])}"
    print_pairs(f"{title}, {found['n_harmonics']} harmonics", pairs)


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


def accuracy(found: Json) -> None:
    """Error against time, the rows nothing beats marked."""
    size = found["reference"]
    rows = [
        (
            "*" if row["pareto"] else "",
            str(row["harmonics"]),
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
        title += (
            f" with {found['reference_harmonics']} harmonics, to {units.length(found['reference_error'])}"
        )
    print_table(title, _ACCURACY_COLUMNS, rows, right="13456")
    say("* nothing else here is both as accurate and as fast")


def march(found: Json) -> None:
    """What a time march came to."""
    pairs = _amplitudes(found)
    if found["error_estimate"] is not None:
        pairs.append(("estimated error", f"{found['error_estimate']:.1e} of max|x|"))
    pairs.append(("periods", f"{found['periods']} of {found['steps_per_period']} steps"))
    pairs.append(("time", units.duration(found["seconds"])))
    print_pairs("Time march", pairs)


def design(found: Json) -> None:
    """A design, of what is known or in spite of what is not."""
    from service.rendering.tables import design as design_reports
    from service.rendering.tables import robust as robust_reports

    if "nominal" in found:
        robust_reports.robust(found)
    else:
        design_reports.design(found)


_HOMES = {
    "solve": "results.solution", "sweep": "results.branch", "design": "results.design",
    "pareto": "design.front", "march": "results.march", "map": "track.response_map",
    "peaks": "track.track", "accuracy": "results.accuracy", "campbell": "disks.campbell",
    "interference": "disks.interference",
    "mistuning": "disks.mistuning", "identify": "identify.report", "modes": "modes.report",
    "controlled": "modes.held", "sensitivities": "track.shares", "plan": "results.plan",
}  # fmt: skip


def knows(kind: str) -> bool:
    """Whether results of a kind are printed as the local command prints them."""
    return kind in _HOMES


def of_kind(kind: str) -> Callable[[Json], None]:
    """What prints the result of a job of a kind, imported when it is asked for."""
    module, _, function = _HOMES[kind].partition(".")
    return on_demand(f"service.rendering.tables.{module}:{function}")


def _amplitudes(found: Json) -> Pairs:
    names = {"max_abs": "max|x|", "half_peak_to_peak": "half peak to peak", "mean": "mean"}
    known = {key: found[key] for key in names if found[key] is not None}
    show = units.length_unit(max((abs(value) for value in known.values()), default=0.0)).show
    return [(names[key], show(value)) for key, value in known.items()]


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
