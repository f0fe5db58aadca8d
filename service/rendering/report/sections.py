"""What every report has: the motion at the peak, the scene, the plan, and how to have it again."""

from __future__ import annotations

import platform
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from datetime import UTC, datetime
from html import escape
from importlib.metadata import PackageNotFoundError, version
from typing import Annotated, Any

import solver
from service.jobs.kind_registry import ABOUT_THE_JOB
from service.rendering.report.about import about_section
from service.rendering.report.responses_report import ReportLine, comparison_figure
from solver.continuation.branch import AnyBranch
from solver.results import units
from solver.results.notes import flag_words
from solver.scene.parameter_paths import parameter
from solver.scene.scene import Scene
from solver.scene.toml import toml_text
from solver.views.plots.html import image, pairs, table
from solver.views.plots.scenes import scene_figure

Json = Mapping[str, Any]
_PACKAGES = ("stickslip", "numpy", "scipy", "numba", "casadi", "cvxpy", "clarabel")


@dataclass(frozen=True, slots=True, kw_only=True)
class Designed:
    """What a report is of."""

    scene: Annotated[Scene, "As it was given, with its values set."]
    problem: Annotated[Json, "The arguments of the design layer."]
    result: Annotated[
        Json,
        "The JSON of `optim.DesignResult`, `optim.ParetoResult`, `optim.RobustResult` or "
        "`optim.Identification`.",
    ]
    about: Annotated[Json, "What is known of the run, as `service.rendering.report.about.About`."] = field(
        default_factory=dict
    )

    @property
    def harmonics(self) -> int:
        """Highest harmonic kept."""
        return int(self.problem.get("harmonics", 11))


def title_section(given: Designed, title: str, status: str) -> str:
    """What the report is of, whose, from when, and how the search ended."""
    about = about_section(given.about, datetime.now(UTC))
    return f"<h1>{escape(title)}</h1>{about}<p>{escape(status)}</p>"


KINDS = ("design", "pareto", "identify")
"""Kinds of job with a report."""
_NOT_OF_A_PROBLEM = ("kind", "scene", "set", *ABOUT_THE_JOB)


def problem_of_request(request: Json) -> dict[str, Any]:
    """What a job asked of the design layer, without what is said of the job itself."""
    return {key: value for key, value in request.items() if key not in _NOT_OF_A_PROBLEM}


def by_path(values: Mapping[str, float]) -> dict[str, float]:
    """The value of every parameter path; in a problem, paths that share one are separated by commas."""
    return {path.strip(): value for paths, value in values.items() for path in paths.split(",")}


def optimum_section(given: Designed, optima: Mapping[str, Mapping[str, float]]) -> str:
    """Every variable as given, at each of the optima, and its bounds if they were given."""
    rows: list[list[Any]] = []
    bounds = given.problem.get("variables") or {}
    for name in next(iter(optima.values()), {}):
        path = name.split(",")[0].strip()
        low, high = bounds.get(name, (None, None))
        within = "" if low is None else f"{units.number(low, 6)} to {parameter(path, high)}"
        found = [parameter(path, values[name]) for values in optima.values()]
        rows.append([name, parameter(path, given.scene.value(path)), *found, within])
    return f"<h2>Optimum</h2>{table(['variable', 'as given', *optima, 'bounds'], rows)}" if rows else ""


def violation_pair(violation: float) -> tuple[str, str]:
    """How much a limit is exceeded, if any is."""
    return "largest relative violation of a limit", f"{violation:.1e}" if violation > 0.0 else "none"


def branch_table(lines: Sequence[ReportLine]) -> str:
    """Peak, error, place and band of every response that is not a linear limit, and what is doubtful."""
    rows: list[list[Any]] = []
    doubts: list[str] = []
    for line in lines:
        branch = line.branch
        if line.linear or branch is None or branch.peak is None:
            continue
        band = "" if branch.band is None else f"{units.number(branch.band.width)} Hz"
        error, place = units.length(branch.error_estimate), f"{branch.peak.at:.6g} Hz"
        certificate = branch.peak_certificate
        rows.append(
            [line.name, units.length(branch.peak.value), error, place, band,
             "known" if certificate.known else "not known"]
        )  # fmt: skip
        if not certificate.known:
            doubts.append(f"{line.name}: between its points there may be a higher peak. {certificate.reason}")
        doubts += [f"{line.name}: {words}" for words in flag_words(branch.flags)]
    heads = ["response", "highest peak", "estimated error", "at", "band", "peaks between points"]
    said = "".join(f"<p>{escape(doubt)}</p>" for doubt in doubts)
    return f"{table(heads, rows)}{said}"


def motion_section(branch: AnyBranch | None, where: str = "At the peak") -> str:
    """One period at the highest peak of a response."""
    if branch is None or branch.peak is None:
        return ""
    solution = solver.solve(branch.scene, frequency_hz=branch.peak.at, harmonics=branch.n_harmonics)
    if not solution.converged:
        return ""
    words = "One period at the highest peak: motion, hysteresis loops, harmonics"
    states = [(contact.name, contact.state.value) for contact in solution.contacts]
    states += [("note", words) for words in flag_words(solution.flags)]
    return f"<h2>{escape(where)}</h2>{image(solution.plot(), words, words + '.')}{pairs(states)}"


def response_section(scene: Scene, lines: Sequence[ReportLine], words: str) -> str:
    """The responses in one picture, or that there are none; `words` end without a full stop."""
    if all(line.branch is None for line in lines):
        return "<p>No response could be computed over the band of the scene.</p>"
    linear = ", between the linear limits" if any(line.linear for line in lines) else ""
    return image(comparison_figure(scene, lines), words, f"{words}{linear}.")


def scene_section(scene: Scene) -> str:
    """The contacts, the force and what is observed; the rest is in the TOML."""
    contacts: list[list[Any]] = []
    for contact in scene.contacts:
        values = [
            f"{key} = {parameter(f'{contact.name}.{key}', value)}"
            for key in contact.parameters
            if (value := getattr(contact, key) if key in contact.PARAMETERS else contact.value_of(key))
            is not None
        ]
        contacts.append([contact.name, " – ".join(contact.between), ", ".join(values)])
    low, high = scene.observe.band
    about = [
        ("structure", f"{scene.structure.kind}, {len(scene.dofs)} DOFs"),
        *(
            ("base" if e.base else "force", f"{e.amplitude:g} {e.unit} on {e.place}")
            for e in scene.excitation
        ),
        ("observed", f"{scene.measured.name}, {low:g} to {high:g} Hz"),
    ]
    drawing = scene_figure(scene)
    words = f"What {scene.name} consists of: springs, contacts that rub, the force, the double ring observed"
    drawn = "" if drawing is None else image(drawing, words, f"{words}.")
    return f"<h2>Scene</h2>{drawn}{pairs(about)}{table(['contact', 'between', 'as given'], contacts)}"


def plan_section(scene: Scene, harmonics: int) -> str:
    """The effects in use and those left out."""
    found = solver.plan(scene, harmonics=harmonics)
    rows: list[list[Any]] = [[e.name, "in use" if e.used else "left out", e.reason] for e in found.effects]
    words = "What was computed, and what was left out without loss."
    return f"<h2>Plan</h2><p class=quiet>{words}</p>{table(['effect', '', 'why'], rows)}"


def again_section(given: Designed, command: str) -> str:
    """The files and the command that give the same, and the versions."""
    problem = toml_text({"scene": "scene.toml", **given.problem})
    return (
        "<h2>To have it again</h2>"
        f"<pre>stickslip {command} --problem problem.toml</pre>"
        f"<h3>problem.toml</h3><pre>{escape(problem)}</pre>"
        f"<h3>scene.toml</h3><pre>{escape(toml_text(given.scene.to_dict()))}</pre>"
        f"<h3>Versions</h3>{versions()}"
    )


def versions() -> str:
    """The packages that computed, with their versions."""
    return pairs([("Python", platform.python_version()), *((name, _version(name)) for name in _PACKAGES)])


def _version(name: str) -> str:
    try:
        return version(name)
    except PackageNotFoundError:
        return "not installed"
