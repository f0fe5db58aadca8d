"""What reports are made of: responses, the motion at the peak, the scene, the plan, how to have it again."""

from __future__ import annotations

import platform
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from datetime import UTC, datetime
from html import escape
from importlib.metadata import PackageNotFoundError, version
from typing import Annotated, Any, TypeAlias

import numpy as np
from matplotlib.figure import Figure

import solver
from optim.problem.cases import LoadCase, read_cases
from optim.problem.uncertainty_set import Coordinate, Disk, How
from service.jobs.common.scene_requests import linear_limit
from service.jobs.kind_registry import ABOUT_THE_JOB
from service.rendering.report.about import about_section
from solver.continuation.branch import AnyBranch, Branch
from solver.continuation.branches.observation import observing
from solver.results import units
from solver.results.known import flag_words
from solver.scene.parameter_paths import parameter
from solver.scene.scene import Scene
from solver.scene.scene_records import LumpedStructure
from solver.scene.toml import toml_text
from solver.views.plots import style
from solver.views.plots.curves import Response
from solver.views.plots.html import image, pairs, table
from solver.views.plots.scenes import scene_figure

Dashes: TypeAlias = str | tuple[float, tuple[float, ...]]
SOLID: Dashes = "-"
DASHED: Dashes = (0, (5.0, 2.5))
_DOTTED: Dashes = (0, (1.2, 1.8))


@dataclass(frozen=True, slots=True, kw_only=True)
class ReportLine:
    """One response of the figure; without a branch it is not drawn."""

    name: str
    branch: AnyBranch | None
    color: str
    dashes: Dashes = SOLID
    width: float = 1.4
    linear: bool = False


@dataclass(frozen=True, slots=True, kw_only=True)
class Sweeps:
    """How the responses of a report are computed."""

    harmonics: Annotated[int, "Highest harmonic kept."]
    limit: Annotated[float | None, "Amplitude [m] at which the band is measured."]

    def of(self, scene: Scene) -> AnyBranch | None:
        """The response over the scene's band; None where it has no point."""
        branch = solver.sweep(scene, harmonics=self.harmonics, limit=self.limit)
        return branch if len(branch.values) and branch.peak is not None else None

    def worst(self, scene: Scene) -> AnyBranch | None:
        """As `of`, and of a mistuned disk the response of its worst blade."""
        branch = self.of(scene)
        structure, dof = scene.structure, scene.observe.dof
        if not isinstance(branch, Branch) or isinstance(structure, LumpedStructure):
            return branch
        if structure.mistuning is None:
            return branch
        if "@" in dof:
            return branch
        others = [observing(branch, f"{dof}@{j}", limit=self.limit) for j in range(1, structure.sector_count)]
        return max([branch, *others], key=lambda blade: blade.peak.value if blade.peak else 0.0)

    def governing(self, scene: Scene, problem: Mapping[str, Any], values: Mapping[str, float]) -> Governing:
        """The load case whose peak is highest at a design."""
        cases = read_cases(scene, problem.get("cases"))

        def height(case: LoadCase) -> float:
            found = self.of(case.scene.with_values(values))
            return 0.0 if found is None or found.peak is None else found.peak.value

        highest = max(cases, key=height) if len(cases) > 1 else cases[0]
        where = f", load case {highest.name}" if len(cases) > 1 else ""
        return Governing(scene=highest.scene, where=where)


@dataclass(frozen=True, slots=True, kw_only=True)
class Governing:
    """A load case: its scene as given, and what is said of it where there are several."""

    scene: Scene
    where: str


def linear_lines(scene: Scene, paths: Sequence[str]) -> list[ReportLine]:
    """The linear limits: the contacts of these parameters removed, and all stuck; none of other laws
    and of dampers, which move by themselves."""
    designed = {path.partition(".")[0] for path in paths}
    names = [contact.name for contact in scene.contacts]
    removed = [name for name in names if name in designed] or names
    if scene.dampers or not names or not all(contact.JENKINS for contact in scene.contacts):
        return []
    sweeps = Sweeps(harmonics=1, limit=None)
    limits = (
        ("contacts removed (linear)", linear_limit(scene, removed), _DOTTED),
        ("contacts stuck (linear)", linear_limit(scene, ()), DASHED),
    )
    return [
        ReportLine(
            name=name, branch=sweeps.of(limit), color=style.GREY, dashes=dashes, width=1.0, linear=True
        )
        for name, limit, dashes in limits
    ]


def in_scenario(scene: Scene, scenario: Mapping[str, Any]) -> Scene:
    """A design in a scenario of its uncertainty, from the scenario's JSON.

    SettingError, SceneError if the scenario does not fit the scene.
    """
    values: dict[str, float] = {}
    for one in scenario["parameters"]:
        paths = tuple(path.strip() for path in one["path"].split(","))
        coordinate = Coordinate(name=one["path"], paths=paths, how=How(one["how"]))
        values |= {path: coordinate.value(scene.value(path), one["value"]) for path in paths}
    there = scene.with_values(values)
    table = scenario.get("mistuning")
    if table is None:
        return there
    return Disk(**{**table, **{k: tuple(table[k]) for k in ("of", "values") if k in table}}).on(there)


def comparison_figure(scene: Scene, lines: Sequence[ReportLine]) -> Figure:
    """The responses on a logarithmic scale; at least one has a point."""
    curves = [(line, Response.of_branch(line.branch)) for line in lines if line.branch is not None]
    mine = [curve for line, curve in curves if not line.linear] or [curve for _, curve in curves]
    unit = scene.measured.unit_for(float(np.median([curve.amplitude.max() for curve in mine])))
    with style.styled():
        page, (axes,) = style.figure(6.6, 4.0)
        for line, curve in curves:
            axes.plot(
                curve.values, curve.amplitude * unit.per_one, color=line.color, linestyle=line.dashes,
                linewidth=line.width, label=line.name,
            )  # fmt: skip
        axes.set_yscale("log")
        style.plain_log(axes.yaxis)
        axes.margins(x=0.0)
        style.label(axes, "frequency [Hz]", scene.measured.label("amplitude", unit))
        axes.set_title(scene.name)
        columns = 4 if len(curves) <= 4 else 3
        axes.legend(loc="upper center", bbox_to_anchor=(0.5, -0.16), ncols=columns)
    return page


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
    return "largest relative violation of a limit", units.number(violation, 2) if violation > 0.0 else "none"


def branch_table(lines: Sequence[ReportLine]) -> str:
    """Peak, error, place and band of every response that is not a linear limit, and what is doubtful."""
    rows: list[list[Any]] = []
    doubts: list[str] = []
    for line in lines:
        branch = line.branch
        if line.linear or branch is None or branch.peak is None:
            continue
        band = "" if branch.band is None else units.hertz(branch.band.width)
        error, place = units.length(branch.error_estimate), units.hertz(branch.peak.at)
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
            ("base" if e.base else "force", f"{units.quantity(e.amplitude, e.unit)} on {e.place}")
            for e in scene.excitation
        ),
        ("observed", f"{scene.measured.name}, {units.span(low, high, 'Hz')}"),
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
