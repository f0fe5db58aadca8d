"""The responses of a report: as given, at the optima, and the linear limits between which they lie."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Annotated, Any, TypeAlias

import numpy as np
from matplotlib.figure import Figure

import solver
from optim.problem.cases import LoadCase, read_cases
from optim.problem.uncertainty_set import Coordinate, Disk, How
from service.jobs.common.scene_requests import linear_limit
from solver.continuation.branch import AnyBranch, Branch
from solver.continuation.branches.observation import observing
from solver.scene.scene import Scene
from solver.scene.scene_records import LumpedStructure
from solver.views.plots import style
from solver.views.plots.curves import Response

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
    """The linear limits: the contacts of these parameters removed, and all stuck; none of other laws."""
    designed = {path.partition(".")[0] for path in paths}
    names = [contact.name for contact in scene.contacts]
    removed = [name for name in names if name in designed] or names
    if not names or not all(contact.JENKINS for contact in scene.contacts):
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

    Raises
    ------
    SettingError, SceneError
        The scenario does not fit the scene.
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
                curve.values, curve.amplitude * unit.per_metre, color=line.color, linestyle=line.dashes,
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
