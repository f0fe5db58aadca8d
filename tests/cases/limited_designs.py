"""Random cheap designs with limits of every kind, and what keeps them on a grid over the bounds.

The limits are read off plain sweeps, not off the rows that lead a search.
"""

import itertools
import math
from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace
from typing import Any, NamedTuple

import numpy as np
from cases.random_designs import random_design_scene, random_variables
from cases.stress_scenes import stressed

import solver
from optim.criteria.evaluation import SETTINGS, evaluate
from optim.problem.cases import LoadCase
from optim.problem.design_problem import Problem, pose
from optim.problem.variables import parameter_values
from solver import Branch, Scene
from solver.modes.at_amplitudes import mode_at_amplitudes
from solver.response.worst_wear import Measure, worst_wear

GRID = 200
WEAR = 1e-12  # m³/J


@dataclass(frozen=True, slots=True, kw_only=True)
class Swept:
    """A design in one case with its response over the band."""

    problem: Problem
    case: LoadCase
    values: Mapping[str, float]
    scene: Scene
    branch: Branch

    @property
    def peak(self) -> float:
        """The highest amplitude [m]."""
        return math.nan if self.branch.peak is None else self.branch.peak.value

    def highest(self, hertz: tuple[float, float]) -> float:
        """The highest amplitude over other frequencies [m]."""
        found = _response(self.problem, self.scene, *hertz)
        return math.nan if found.peak is None or not found.reached else found.peak.value

    def worst(self, measure: Measure) -> float:
        """The largest of a measure of all contacts."""
        return max(worst_wear(self.branch, one.name, measure)[0].value for one in self.scene.contacts)

    def quality(self, amplitude: float) -> float:
        """1/(2ζ) of the first mode at an amplitude, without end where it is not damped."""
        points = mode_at_amplitudes(self.scene, np.array([amplitude]), (), harmonics=self.problem.harmonics)
        ratio = float(points.damping_ratio[0])
        return math.inf if ratio <= 0.0 else 0.5 / ratio

    def of_rows(self, name: str) -> float:
        """The largest row of a stress, whose own tests judge it by hand."""
        found = evaluate(
            replace(self.problem, cases=(self.case,)), self.values, gradients=False, errors=False
        )
        return max((row.value for row in found.rows if row.quantity.name == name), default=math.nan)


# What must be small, of a design and of what was drawn: a range [Hz], or a modal amplitude.
MEASURED: dict[str, Callable[[Swept, Any], float]] = {
    "running": lambda here, drawn: here.highest(drawn),
    "forbidden": lambda here, drawn: here.highest(drawn),
    "peak": lambda here, _: here.peak,
    "band": lambda here, _: 0.0 if here.branch.band is None else here.branch.band.width,
    "work": lambda here, _: here.worst(Measure.FRICTION_WORK),
    "wear": lambda here, _: WEAR * here.worst(Measure.FRICTION_POWER),
    "separation": lambda here, _: max(-one.load.least for one in here.scene.contacts[:1]),
    "damping": lambda here, drawn: here.quality(drawn),
    "quality": lambda here, drawn: here.quality(drawn),
    "stress": lambda here, _: here.of_rows("stress"),
    "margin": lambda here, _: here.of_rows("utilisation"),
    "mass": lambda here, _: sum(body.mass for body in here.scene.bodies),
}
BESIDE = ("running", "forbidden", "peak", "band")  # limits of which there may be a second


class Limit(NamedTuple):
    """What a design is to keep."""

    kind: str
    drawn: Any
    bound: float

    def keys(self) -> dict[str, Any]:
        """As arguments of `optim.design`."""
        a, bound = self.drawn, self.bound
        return {
            "running": lambda: {"running_rpm": [[60.0 * a[0], 60.0 * a[1]]], "max_running_amplitude": bound},
            "forbidden": lambda: {"forbidden_hz": [list(a)], "limit": bound},
            "peak": lambda: {"max_peak": bound},
            "band": lambda: {"max_band_hz": bound},
            "work": lambda: {"max_friction_work": bound},
            "wear": lambda: {"max_wear_rate": bound, "wear_coefficient": WEAR},
            "separation": lambda: {"contact_states": {a: "never-separates"}},
            "damping": lambda: {"min_damping": {"ratio": 0.5 / bound, "amplitude": a}},
            "quality": lambda: {"quality_factor": {"most": bound, "amplitude": a}},
            "stress": lambda: {"max_stress": bound},
            "margin": lambda: {"min_margin": 1.0 / bound},
            "mass": lambda: {"max_mass": bound},
        }[self.kind]()


class LimitedDesign(NamedTuple):
    """The arguments of `optim.design`, and their limits."""

    asked: dict[str, Any]
    limits: list[Limit]


def limited_design(seed: int) -> LimitedDesign:
    """A random problem with one or two limits, kept by a share of the designs, perhaps by none."""
    rng = np.random.default_rng([seed, 21])
    kinds = [list(MEASURED)[seed % len(MEASURED)]]
    kinds += [str(rng.choice(BESIDE))] if rng.random() < 0.4 else []
    asked = _without_limits(rng, seed, kinds[0], 2 if seed // len(MEASURED) % 3 == 2 else 1)
    limits = [_limit(rng, asked, kind) for kind in dict.fromkeys(kinds)]
    for limit in limits:
        asked |= limit.keys()
    if rng.random() < 0.3:
        asked["start"] = {path: low + 0.9 * (high - low) for path, (low, high) in asked["variables"].items()}
    return LimitedDesign(asked, limits)


def _without_limits(rng: np.random.Generator, seed: int, kind: str, n: int) -> dict[str, Any]:
    if kind in ("stress", "margin"):
        bounds = {"slides.N0": (0.05, 10.0), "structure.neck": (10.0, 40.0)}
        second = 0.3 * (seed % 8 == 2)  # a mean that moves
        scene = stressed(static=float(rng.uniform(-100.0, 800.0)), second=second, band=[0.8, 1.6])
        return {
            "scene": scene, "harmonics": 3 if second else 1, "variables": dict(list(bounds.items())[:n]),
        }  # fmt: skip
    if kind == "mass":
        bounds = {"block.mass": (0.1, 1.0), "slides.N0": (0.1, 10.0)}
        return {"scene": _with_a_body(), "harmonics": 1, "variables": dict(list(bounds.items())[:n])}
    scene = _light_scene(seed)
    asked: dict[str, Any] = {
        "scene": scene, "variables": random_variables(rng, scene, n),
        "harmonics": 3 if seed % 8 == 0 else 1,
    }  # fmt: skip
    if seed % 7 == 3:
        force = float(scene.value("excitation.amplitude")) * 10.0 ** rng.uniform(-0.3, 0.3)
        asked["cases"] = [
            {"name": "as built"}, {"name": "other", "set": {"excitation.amplitude": force}, "weight": 0.8},
        ]  # fmt: skip
    return asked


def _light_scene(seed: int) -> Scene:
    """A mass with a contact, or two of each, well damped, about their first frequency."""
    for number in itertools.count(1000 * seed):
        scene = random_design_scene(number, (2e-2, 8e-2))
        most = 1 + (seed % 4 == 0)
        if len(scene.structure.masses) <= most and len(scene.contacts) <= most:  # type: ignore[union-attr]
            low, high = scene.observe.band
            return scene.model_copy(
                update={"observe": scene.observe.model_copy(update={"band": (2.4 * low, 0.5 * high)})}
            )
    raise AssertionError


def _with_a_body() -> Scene:
    """A mass with a block that slides along it."""
    springs = [(["a", "ground"], 40.0, 0.5), (["block.x", "ground"], 10.0, 0.3)]
    springs += [([f"block.{dof}", "ground"], 1e3, 1.0) for dof in ("y", "rz")]
    return Scene.from_dict({
        "name": "block",
        "structure": {
            "kind": "lumped", "masses": {"a": 1.0},
            "springs": [{"between": between, "k": k, "c": c} for between, k, c in springs],
        },
        "bodies": [{"name": "block", "mass": 0.3, "inertia": 0.1, "plane": "xy", "at": [0.0, 0.0, 0.0]}],
        "contacts": [{"name": "slides", "between": ["a", "block.x"], "kt": 30.0, "mu": 0.3, "N0": 2.0}],
        "excitation": {"dof": "a", "amplitude": 1.0},
        "observe": {"dof": "a", "band": [0.6, 1.6]},
    })  # fmt: skip


def _limit(rng: np.random.Generator, asked: dict[str, Any], kind: str) -> Limit:
    """A limit at a value that a share of a few designs keep, or a little off."""
    scene = asked["scene"]
    drawn: Any = tuple(float(hertz) for hertz in np.sort(rng.uniform(*scene.observe.band, 2)))
    if kind == "separation":
        return Limit(kind, scene.contacts[0].name, 0.0)
    if kind in ("damping", "quality"):
        drawn = float(10.0 ** rng.uniform(-2.0, 0.0))
    problem = pose(**asked | Limit(kind, drawn, 1.0).keys())
    known = [max(MEASURED[kind](one, drawn) for one in swept(problem, place)) for place in grid(problem, 12)]
    finite = [value for value in known if 0.0 < value < math.inf] or [1.0]  # 1: kept by all, or by none
    share, off = rng.choice([0.0, 0.05, 0.1, 0.3, 0.7]), 1.0 + rng.choice([-0.05, 1e-3, 0.02])
    return Limit(kind, drawn, float(np.quantile(finite, share) * off))


def grid(problem: Problem, count: int) -> list[dict[str, float]]:
    """About so many designs over the bounds, in the scaling of the variables."""
    each = max(2, round(count ** (1.0 / len(problem.variables))))
    axes = [[variable.outside(z) for z in np.linspace(0.0, 1.0, each)] for variable in problem.variables]
    names = [variable.name for variable in problem.variables]
    return [dict(zip(names, place, strict=True)) for place in itertools.product(*axes)]


def swept(problem: Problem, values: Mapping[str, float], **settings: Any) -> list[Swept]:
    """The response of a design in every case."""
    found = []
    for case in problem.cases:
        scene = case.scene.with_values(parameter_values(problem.variables, values))
        branch = _response(problem, scene, **settings)
        found.append(Swept(problem=problem, case=case, values=values, scene=scene, branch=branch))
    return found


def _response(
    problem: Problem, scene: Scene, low: float | None = None, high: float | None = None, **settings: Any
) -> Branch:
    return solver.sweep(
        scene, start=low, stop=high, harmonics=problem.harmonics, limit=problem.limit,
        settings=replace(SETTINGS, errors=False, **settings),
    )  # fmt: skip


class Judgement(NamedTuple):
    """What is minimised of a design, and by how much it exceeds its limits, relative to them."""

    objective: float
    excess: float


def judged(problem: Problem, limits: list[Limit], values: Mapping[str, float]) -> Judgement:
    """Judge a design; what is not known of it exceeds every limit."""
    here = swept(problem, values)
    excesses = [
        (MEASURED[limit.kind](one, limit.drawn) - limit.bound) / (limit.bound or 1.0)
        for one in here for limit in limits
    ]  # fmt: skip
    known = all(one.branch.reached for one in here) and not any(math.isnan(each) for each in excesses)
    return Judgement(max(one.case.weight * one.peak for one in here), max(excesses) if known else math.inf)


def brute_force(problem: Problem, limits: list[Limit], enough: float, count: int = GRID) -> list[Judgement]:
    """The designs of a grid that keep all limits and have less than `enough` of what is minimised."""
    places = [values for values in grid(problem, count) if _may_beat(problem, limits, values, enough)]
    found = [judged(problem, limits, values) for values in places]
    return [one for one in found if one.excess <= 0.0 and one.objective < enough]


def _may_beat(problem: Problem, limits: list[Limit], values: Mapping[str, float], enough: float) -> bool:
    """Whether the amplitudes at a few frequencies, which no peak is below, leave it possible."""
    here = swept(problem, values, peaks=False, range_length=5.0)
    if max(one.case.weight * one.branch.amplitude.max(initial=0.0) for one in here) >= enough:
        return False
    for limit in limits:
        low, high = {"peak": (0.0, math.inf)}.get(limit.kind) or (
            limit.drawn if limit.kind in ("running", "forbidden") else (math.inf, 0.0)
        )
        for one in here:
            inside = (low <= one.branch.values) & (one.branch.values <= high)
            if one.branch.amplitude[inside].max(initial=0.0) > limit.bound:
                return False
    return True
