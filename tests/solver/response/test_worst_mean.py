"""The worst mean that stuck contacts may hold, against marches, closed forms and differences."""

import math
from typing import Any

import numpy as np
import pytest
from history_scenes import history_scene
from stress_scenes import STEEL

from solver import Scene, march, solve, sweep
from solver.balance.balance import build
from solver.balance.workspace import Workspace
from solver.continuation.branches.observation import observed_balance, observing
from solver.continuation.from_nothing import solve_from_nothing
from solver.marching.march import MarchStart
from solver.response.worst_mean import WorstMean, WorstMeanSlopes, used_most
from solver.scene.materials import haigh_of
from solver.sensitivity.gradient import Sensitivities
from solver.studies.margin_diagram import margin_diagram

MARCHED = {"tolerance": 1e-9, "max_periods": 1500}


def pulled(force: float = 1.0, mean: float = 0.4, load: float = 0.8, **contact: Any) -> Scene:
    """One mass on a spring of 2 N/m, pulled by `mean` [N]; its stress is 1 MPa a millimetre."""
    return Scene.from_dict({
        "name": "pulled",
        "structure": {"kind": "lumped", "masses": {"a": 1.0}, "springs": [
            {"between": ["a", "ground"], "k": 2.0, "c": 0.1, "name": "leaf"},
        ]},
        "contacts": [{"name": "d", "between": ["a", "ground"], "kt": 0.6, "mu": 0.5, "N0": load, **contact}],
        "excitation": [
            {"dof": "a", "amplitude": force}, {"dof": "a", "amplitude": mean, "harmonic": 0},
        ],
        "observe": {"dof": "a", "band": [0.12, 0.4]},
        "recovery": [
            {"name": "root", "unit": "MPa", "terms": {"a": 1000.0}, "static": 0.0, "material": "steel"},
        ],
        "materials": [STEEL],
    })  # fmt: skip


def row_of(scene: Scene, name: str = "root") -> Scene:
    """The scene with a recovered row observed."""
    return scene.model_copy(update={"observe": scene.observe.model_copy(update={"dof": name})})


def added(scene: Scene, hertz: float, harmonics: int) -> float:
    """By how much the mean of what a scene observes may be larger; NaN where that is not known."""
    means = WorstMean(build(scene, harmonics=harmonics))
    u = solve_from_nothing(Workspace.of(means.balance), 2.0 * math.pi * hertz).u
    sides = means.sides(u, hertz)
    return math.nan if sides is None else means.added(sides, hertz)


@pytest.mark.parametrize(("mean", "load"), [(0.4, 0.5), (0.7, 0.6), (-0.3, 0.38), (0.0, 0.3)])
def test_one_mass_has_the_closed_form_and_a_march_reaches_it(mean: float, load: float) -> None:
    scene, hertz = pulled(0.3, mean, load), 0.15
    found = solve(row_of(scene), frequency_hz=hertz, harmonics=5)
    assert "mean_undetermined" in found.flags
    omega = 2.0 * math.pi * hertz
    x = 0.3 / (2.6 - omega**2 + 0.1j * omega)
    left = 0.5 * load - 0.6 * abs(x)
    worst = (mean + left) / 2.0
    assert found.mean + added(row_of(scene), hertz, 5) == pytest.approx(1000.0 * worst, rel=1e-4, abs=1e-3)
    # From where the friction pushes as much as it can, and from elsewhere.
    pushed = MarchStart(
        displacements={"a": worst + x.real}, velocities={"a": -omega * x.imag},
        tractions={"d": 0.6 * x.real - 0.9999 * left},
    )  # fmt: skip
    reached = march(scene, frequency_hz=hertz, start=pushed, **MARCHED).mean  # type: ignore[arg-type]
    assert reached == pytest.approx(worst, abs=2e-4 * load)
    for share in np.linspace(-1.0, 1.0, 5):
        pull = {"d": float(0.5 * load * share)}
        other = march(scene, frequency_hz=hertz, tractions=pull, **MARCHED)  # type: ignore[arg-type]
        assert other.mean <= worst * (1.0 + 1e-6)


@pytest.mark.parametrize(("mean", "load"), [(0.4, 3.0), (-0.4, 3.0)])
def test_what_a_stuck_contact_holds_of_a_mean_load_may_be_lost(mean: float, load: float) -> None:
    scene = row_of(pulled(1e-3, mean, load))
    found = solve(scene, frequency_hz=0.15, harmonics=5)
    assert "mean_undetermined" not in found.flags
    assert found.mean == pytest.approx(1000.0 * mean / 2.6)
    assert found.mean + added(scene, 0.15, 5) == pytest.approx(1000.0 * max(mean / 2.0, mean / 2.6))


def random_pulled(seed: int) -> tuple[Scene, float]:
    """A scene of given loads, some with a mean one, that observes a sum of its motions."""
    scene, hertz = history_scene(seed, "given")
    rng = np.random.default_rng(seed)
    terms = {dof: float(rng.uniform(-1.0, 1.0)) for dof in scene.dofs}
    told = scene.to_dict() | {"recovery": [{"name": "row", "unit": "m", "terms": terms}]}
    return row_of(Scene.from_dict(told), "row"), hertz


def check(seed: int, starts: int, settings: dict[str, float]) -> str:
    """March one scene from starts anywhere; no mean is above what is told."""
    scene, hertz = random_pulled(seed)
    found = solve(scene, frequency_hz=hertz, harmonics=21)
    if not found.converged or not math.isfinite(worst := found.mean + added(scene, hertz, 21)):
        return "not known"
    rng = np.random.default_rng(seed)
    names = march(scene, frequency_hz=hertz, max_periods=1, tolerance=1e-2).contacts
    limits = [c.mu * abs(c.N0) for c in scene.contacts]  # type: ignore[union-attr]
    seen = []
    for i in range(starts + 1):
        shares = rng.uniform(-1.0, 1.0, len(names)) if i > 1 else np.full(len(names), 1.0 - 2.0 * i)
        if i == starts:
            shares *= 0.0  # at rest
        pulls = dict(zip(names, (shares * limits).tolist(), strict=True))
        marched = march(scene, frequency_hz=hertz, tractions=pulls, **settings)  # type: ignore[arg-type]
        if marched.converged:
            seen.append(marched.mean)
    room = 1e-3 * found.max_abs + 10.0 * found.error_estimate
    free = "mean_undetermined" in found.flags
    assert all(mean <= worst + room for mean in (seen if free else seen[-1:])), (scene.name, seen, worst)
    return "free" if free else "held"


@pytest.mark.parametrize("seed", [0, 7, 11])
def test_no_start_leads_to_a_larger_mean(seed: int) -> None:
    assert check(seed, 3, {"tolerance": 1e-8, "max_periods": 150})


@pytest.mark.long
@pytest.mark.parametrize("first", range(0, 100, 20))
def test_no_start_leads_to_a_larger_mean_in_many_scenes(first: int) -> None:
    said = [check(seed, 6, MARCHED) for seed in range(first, first + 20)]
    assert said.count("free") >= 2


PATHS = ("d.N0", "d.mu", "d.kt", "leaf.k")


@pytest.mark.parametrize(("force", "load"), [(0.3, 1.1), (1e-3, 3.0)], ids=["free", "held"])
@pytest.mark.parametrize("path", range(4))
def test_slopes_are_differences(force: float, load: float, path: int) -> None:
    scene, hertz = pulled(force, 0.5, load), 0.15
    paths = [p for p in scene.parameter_paths() if p in ("d.N0", "d.mu", "d.kt") or p.endswith("leaf")]
    assert len(paths) == 4

    def used(value: float | None) -> float:
        there = scene if value is None else scene.with_values({paths[path]: value})
        seen = observing(
            sweep(there, start=0.9 * hertz, stop=1.1 * hertz, harmonics=3),
            "root",
            measure=haigh_of(there, "root"),
        )
        means = WorstMean(seen.balance)
        u = means.solved(hertz, seen.solutions[0, :-1].copy())
        assert u is not None
        found = means.used(u, hertz)
        assert found is not None
        if value is None:
            slopes.append(WorstMeanSlopes(seen.balance, paths).gradient(u, hertz))
            plain.append(Sensitivities(seen.balance, paths).gradient(u, hertz))
        return found

    slopes: list[Any] = []
    plain: list[Any] = []
    here, value = used(None), scene.value(paths[path])
    assert slopes[0].value == pytest.approx(here, rel=1e-12)
    assert slopes[0].value > plain[0].value
    step = 1e-4 * value
    expected = (used(value + step) - used(value - step)) / (2.0 * step)
    assert slopes[0].by_parameters[path] == pytest.approx(expected, rel=1e-5, abs=1e-9)


def test_the_worst_mean_is_found_over_the_frequency() -> None:
    scene = pulled(0.03, 0.4, 0.4)
    branch = sweep(scene, harmonics=5)
    found = used_most(observing(branch, "root", measure=haigh_of(scene, "root"), peaks_alone=True))
    assert found.known
    assert found.worst is not None
    assert found.flags == ("worst_mean",)
    means = WorstMean(observed_balance(branch.balance, "root", haigh_of(scene, "root")), found.free)
    dense = [
        means.used(u, hertz)
        for hertz in np.linspace(0.12, 0.4, 141)
        if (u := means.solved(hertz, branch.solutions[0, :-1].copy())) is not None
    ]
    assert found.highest.value >= max(x for x in dense if x is not None) * (1.0 - 1e-9)
    assert found.highest.value == pytest.approx(means.used(found.highest.solution, found.highest.at))


def test_a_diagram_judges_by_the_worst_mean() -> None:
    # What slips on its way carries nothing for sure: 400 MPa by the pull, 600 MPa by the force that is left.
    scene = pulled(1.0, 0.8, 2.4)
    diagram = margin_diagram(scene, start=1e-3, stop=2e-3, points=2, harmonics=3)
    assert np.isfinite(diagram.used).all()
    assert "worst_mean" in diagram.known.flags or diagram.used.max() < 1.0
