"""Random design problems, and what brute force finds: a grid over the bounds, refined at its best points."""

import itertools
import math
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from scipy.linalg import eigvalsh

import solver
from optim.criteria.constraint_rows import DesignEvaluation
from optim.criteria.evaluation import evaluate
from optim.problem.design_problem import Problem, pose
from optim.problem.variables import unscaled
from solver import Scene
from solver.linear.assembly import linear_model

KEPT = 1e-6  # relative excess over a bound up to which it counts as kept
HARMONICS = 3


def random_structure(rng: np.random.Generator, damping: tuple[float, float]) -> dict[str, Any]:
    """One to four masses in a chain with random ground springs, about 1 Hz; damping ratios in a range."""
    dofs = [f"m{i}" for i in range(int(rng.integers(1, 5)))]
    springs: list[dict[str, Any]] = []
    for i, dof in enumerate(dofs):
        if i == 0 or rng.random() < 0.4:
            springs.append({"between": [dof, "ground"], "k": 10.0 ** rng.uniform(1.0, 2.3)})
        if i > 0:
            springs.append({"between": [dof, dofs[int(rng.integers(i))]], "k": 10.0 ** rng.uniform(0.8, 2.3)})
    for i, spring in enumerate(springs):
        spring["name"] = f"k{i}"
    ratio = 10.0 ** rng.uniform(math.log10(damping[0]), math.log10(damping[1]))
    return {
        "kind": "lumped",
        "masses": {dof: float(rng.uniform(0.3, 3.0)) for dof in dofs},
        "springs": springs,
        "stiffness_proportional_damping": ratio / math.pi,
    }


def random_contact(
    rng: np.random.Generator, name: str, dofs: Sequence[str], force: float, n: int
) -> dict[str, Any]:
    """A contact to ground or another mass, from loads that hardly matter to loads that stick."""
    first = dofs[int(rng.integers(n))]
    others = ["ground", *(dof for dof in dofs if dof != first)]
    mu = float(rng.uniform(0.1, 0.7))
    return {
        "name": name,
        "between": [first, others[int(rng.integers(len(others)))]],
        "kt": float(10.0 ** rng.uniform(1.3, 3.0)),
        "mu": mu,
        "N0": float(force / mu * 10.0 ** rng.uniform(-0.7, 0.7)),
        "N1_ratio": 0.0 if rng.random() < 0.3 else float(rng.uniform(0.0, 1.8)),
        "N1_phase": 0.0 if rng.random() < 0.5 else float(rng.uniform(-math.pi, math.pi)),
    }


def random_design_scene(seed: int, damping: tuple[float, float] = (5e-3, 5e-2)) -> Scene:
    """A scene of one to three contacts with a band from a quarter to three times its lowest frequency."""
    rng = np.random.default_rng(seed)
    structure = random_structure(rng, damping)
    dofs = list(structure["masses"])
    force = float(10.0 ** rng.uniform(-1.0, 2.0))
    contacts = [random_contact(rng, f"c{i}", dofs, force, len(dofs)) for i in range(int(rng.integers(1, 4)))]
    raw = {
        "name": f"design-{seed}",
        "structure": structure,
        "contacts": contacts,
        "excitation": {"dof": dofs[int(rng.integers(len(dofs)))], "amplitude": force},
        "observe": {"dof": dofs[int(rng.integers(len(dofs)))], "band": [0.1, 2.0]},
    }
    model = linear_model(Scene.from_dict(raw))
    lowest = float(np.sqrt(eigvalsh(model.K0, model.M)[0])) / (2.0 * math.pi)
    raw["observe"]["band"] = [0.25 * lowest, 3.0 * lowest]
    return Scene.from_dict(raw)


def random_variables(rng: np.random.Generator, scene: Scene, n: int) -> dict[str, tuple[float, float]]:
    """Loads above all, else stiffnesses of contacts and springs, μ, the share of the load that varies."""
    names = [contact.name for contact in scene.contacts]
    loads = [f"{name}.N0" for name in names]
    springs = [f"structure.{spring.name}" for spring in scene.structure.springs if spring.name]  # type: ignore[union-attr]
    others = [*springs, *(f"{name}.{what}" for name in names for what in ("kt", "mu", "N1_ratio"))]
    chosen = [loads[int(rng.integers(len(loads)))]] if n > 1 or rng.random() < 0.7 else []
    while len(chosen) < n:
        pool = [path for path in (loads if rng.random() < 0.5 else others) if path not in chosen]
        if pool:
            chosen.append(pool[int(rng.integers(len(pool)))])
    return {path: _bounds(rng, scene, path) for path in chosen}


def _bounds(rng: np.random.Generator, scene: Scene, path: str) -> tuple[float, float]:
    value, what = float(scene.value(path)), path.rpartition(".")[2]
    if what == "N1_ratio":
        return 0.0, 1.8
    wide = 10.0 if what == "N0" else 3.0
    shift = 10.0 ** rng.uniform(-0.3, 0.3)
    low, high = value / wide * shift, value * wide * shift
    return (low, min(high, 1.0)) if what == "mu" else (low, high)


def random_design(
    seed: int, n: int = 1, *, cases: int = 1, limits: bool = False,
    damping: tuple[float, float] = (5e-3, 5e-2), harmonics: int = HARMONICS,
) -> dict[str, Any]:  # fmt: skip
    """The arguments of `optim.design` of a random problem with `n` variables."""
    scene = random_design_scene(seed, damping)
    rng = np.random.default_rng([seed, n, cases])
    asked: dict[str, Any] = {
        "scene": scene, "variables": random_variables(rng, scene, n), "harmonics": harmonics,
    }  # fmt: skip
    if cases > 1:
        asked["cases"] = [{"name": "as built"}] + [_case(rng, scene, i) for i in range(1, cases)]
    if limits:
        asked |= random_limits(rng, scene, harmonics)
    return asked


def _case(rng: np.random.Generator, scene: Scene, i: int) -> dict[str, Any]:
    force = float(scene.value("excitation.amplitude")) * 10.0 ** rng.uniform(-0.3, 0.3)
    dofs = [mass.dof for mass in scene.structure.masses]  # type: ignore[union-attr]
    case: dict[str, Any] = {"name": f"case {i}", "set": {"excitation.amplitude": force}}
    if rng.random() < 0.5:
        case["observe"] = dofs[int(rng.integers(len(dofs)))]
    return {**case, "weight": float(rng.uniform(0.5, 1.5))}


def random_limits(rng: np.random.Generator, scene: Scene, harmonics: int) -> dict[str, Any]:
    """Limits from those that no design keeps to those that no design meets."""
    branch = solver.sweep(scene, harmonics=harmonics)
    peak = branch.peak.value if branch.peak is not None else 1.0
    low, high = scene.observe.band
    limits: dict[str, Any] = {"limit": float(peak * 10.0 ** rng.uniform(-1.0, 0.3))}
    while len(limits) == 1:
        if rng.random() < 0.5:
            limits["max_band_hz"] = float((high - low) * 10.0 ** rng.uniform(-1.7, 0.0))
        if rng.random() < 0.4:
            begin = float(rng.uniform(low, high))
            limits["forbidden_hz"] = [(begin, begin + 0.15 * (high - low))]
        if rng.random() < 0.3:
            limits["max_peak"] = float(peak * 10.0 ** rng.uniform(-0.5, 0.5))
    return limits


@dataclass(frozen=True, slots=True, kw_only=True)
class Brute:
    """What brute force found.

    Attributes
    ----------
    z : the best scaled variables; None if nothing could be evaluated.
    objective, violation : of the best design: the least objective of those that keep all limits, else the
        least violation.
    evaluations : how many.
    """

    z: tuple[float, ...] | None
    objective: float
    violation: float
    evaluations: int


def rank(problem: Problem, evaluation: DesignEvaluation) -> tuple[float, float]:
    """What designs are compared by: violation of the limits, then the objective."""
    violation = max(evaluation.violation(problem.scales), 0.0)
    return (0.0 if violation <= KEPT else violation), evaluation.objective


def posed(asked: dict[str, Any]) -> Problem:
    """The problem of the arguments of `optim.design`."""
    return pose(asked["scene"], **{key: value for key, value in asked.items() if key != "scene"})


def brute_force(problem: Problem, n: int, *, places: int = 3, levels: int = 4, fine: int = 7) -> Brute:
    """A grid of n points a variable, refined round its best places."""
    known: dict[tuple[float, ...], tuple[float, float]] = {}
    at = _ranking(problem, known)
    count = len(problem.variables)
    step = 1.0 / (n - 1)
    grid = itertools.product(*[np.linspace(0.0, 1.0, n).tolist()] * count)
    ranked = sorted(grid, key=at)
    for centre in _apart(ranked, 2.5 * step, places):
        best, reach = centre, step
        for _ in range(levels):
            for z in _round(best, reach, fine, count):
                at(z)
            best = min((z for z in known if _distance(z, best) <= reach), key=lambda z: known[z])
            reach *= 2.5 / (fine - 1)
    return _best_of(known)


def random_multistart(
    problem: Problem, seed: int, n: int, *, places: int = 3, levels: int = 5, each: int = 10
) -> Brute:  # fmt: skip
    """So many designs at random, and round the best of them random steps that become shorter."""
    rng = np.random.default_rng([seed, n])
    known: dict[tuple[float, ...], tuple[float, float]] = {}
    at = _ranking(problem, known)
    count = len(problem.variables)
    ranked = sorted(map(tuple, rng.random((n, count)).tolist()), key=at)
    for best in _apart(ranked, 0.1, places):
        reach = 0.2
        for _ in range(levels):
            for step in rng.uniform(-reach, reach, (each, count)):
                best = min(best, tuple(np.clip(np.array(best) + step, 0.0, 1.0).tolist()), key=at)
            reach *= 0.4
    return _best_of(known)


def _ranking(
    problem: Problem, known: dict[tuple[float, ...], tuple[float, float]]
) -> Callable[[tuple[float, ...]], tuple[float, float]]:
    """What ranks scaled variables, each once."""

    def at(z: tuple[float, ...]) -> tuple[float, float]:
        if z not in known:
            found = evaluate(problem, unscaled(problem.variables, z), gradients=False, errors=False)
            known[z] = rank(problem, found) if found.good else (math.inf, math.inf)
        return known[z]

    return at


def _best_of(known: dict[tuple[float, ...], tuple[float, float]]) -> Brute:
    best = min(known, key=lambda z: known[z])
    violation, objective = known[best]
    nothing = not math.isfinite(violation)
    return Brute(
        z=None if nothing else best, objective=objective, violation=violation, evaluations=len(known)
    )


def limited_cases(seed: int) -> dict[str, Any]:
    """The arguments of a design of one to three masses: two or three cases, limits, two to five variables."""
    while len(random_design_scene(seed).structure.masses) > 3:  # type: ignore[union-attr]
        seed += 1000
    return random_design(seed, 2 + seed % 4, cases=2 + seed % 2, limits=True)


def _distance(one: Sequence[float], other: Sequence[float]) -> float:
    return max(abs(a - b) for a, b in zip(one, other, strict=True))


def _apart(ranked: Sequence[tuple[float, ...]], distance: float, most: int) -> list[tuple[float, ...]]:
    chosen: list[tuple[float, ...]] = []
    for z in ranked:
        if len(chosen) < most and all(_distance(z, other) > distance for other in chosen):
            chosen.append(z)
    return chosen


def _round(centre: tuple[float, ...], reach: float, n: int, count: int) -> Iterator[tuple[float, ...]]:
    for shift in itertools.product(*[np.linspace(-reach, reach, n).tolist()] * count):
        yield tuple(min(max(z + s, 0.0), 1.0) for z, s in zip(centre, shift, strict=True))


def stands(problem: Problem, brute: Brute, near: float = 1e-6, within: float = 1e-3) -> bool:
    """Whether the best of brute force is one of a neighbourhood: a response that missed a peak is not."""
    if brute.z is None:
        return True
    for shift in (-near, near):
        z = [min(max(x + shift, 0.0), 1.0) for x in brute.z]
        beside = evaluate(problem, unscaled(problem.variables, z), gradients=False)
        violation, objective = rank(problem, beside) if beside.good else (math.inf, math.inf)
        if violation > brute.violation + within or objective > brute.objective * (1.0 + within):
            return False
    return True


def beaten_by(found: tuple[float, float], brute: Brute, tolerance: float = 1e-4) -> float:
    """By how much brute force beats a (violation, objective): 0 if not beyond the tolerance.

    Relative objective where both keep the limits, difference of the violations where neither does, infinite
    where brute force keeps them alone.
    """
    if brute.z is None:
        return 0.0
    violation, objective = found
    if violation == 0.0:
        gap = (objective - brute.objective) / brute.objective if brute.violation == 0.0 else 0.0
    else:
        gap = math.inf if brute.violation == 0.0 else violation - brute.violation
    return gap if gap > tolerance else 0.0


def random_uncertain(seed: int) -> dict[str, Any]:
    """The arguments of `optim.robust_design` of a random problem with one load and two or three intervals."""
    scene = random_design_scene(seed)
    rng = np.random.default_rng([seed, 7])
    first = scene.contacts[0]
    load = f"{first.name}.N0"
    paths = [f"{first.name}.{what}" for what in ("N1_ratio", "mu", "kt")]
    chosen = [paths[i] for i in sorted(rng.permutation(3)[: int(rng.integers(2, 4))])]
    intervals: dict[str, list[float]] = {}
    for path in chosen:
        value = float(scene.value(path))
        spread = float(rng.uniform(1.2, 2.5))
        intervals[path] = [value / spread, value * spread]
        if path.endswith("N1_ratio"):
            low = float(rng.uniform(0.0, 0.8))
            intervals[path] = [low, low + float(rng.uniform(0.2, 1.0))]
    N0 = float(scene.value(load))
    return {
        "scene": scene, "uncertain": intervals, "variables": {load: (N0 / 10.0, N0 * 10.0)},
        "harmonics": HARMONICS, "samples": 8,
    }  # fmt: skip
