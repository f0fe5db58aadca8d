"""Error estimates of stiff friction and of bars that slip bit by bit, by marches and a closed form."""

import math

import numpy as np
import pytest

from solver import Scene, march, solve, sweep
from stickslip.lab.proofs.exact.answer import solve_exactly

FEWEST_COVERED, FEWEST_USEFUL, USEFUL = 0.95, 0.9, 100.0
ROUNDING = 1e-9  # of the amplitude


def judged(asked: list[tuple[float, float, float, float]], rounding: float = ROUNDING) -> tuple[float, float]:
    """Shares of (answer, estimate, truth, its own error) covered, and with an estimate within 100 times."""
    answers, estimates, truth, own = np.array(asked).T
    error, own = np.abs(answers - truth), np.maximum(own, rounding * truth)
    covered = error <= estimates + own
    useful = estimates <= USEFUL * np.maximum(error, 10.0 * own)
    return float(np.mean(covered)), float(np.mean(useful))


def oscillator(k: float, m: float, zeta: float, contacts: list[dict[str, object]], force: float) -> Scene:
    """One mass on contacts to the ground."""
    return Scene.from_dict(
        {
            "name": "stiff",
            "structure": {
                "kind": "lumped",
                "masses": {"x": m},
                "springs": [{"between": ["x", "ground"], "k": k, "c": 2.0 * zeta * math.sqrt(k * m)}],
            },
            "contacts": contacts,
            "excitation": {"dof": "x", "amplitude": force},
            "observe": {"dof": "x", "band": [0.05, 2.0]},
        }
    )


def against_march(scene: Scene, frequency_hz: float, harmonics: int) -> tuple[float, float, float, float]:
    """The answer, its estimate, the truth and the error of that."""
    solution, marched = (
        solve(scene, frequency_hz=frequency_hz, harmonics=harmonics),
        march(scene, frequency_hz=frequency_hz),
    )
    assert solution.converged
    assert marched.converged
    return solution.max_abs, solution.error_estimate, marched.max_abs, marched.error_estimate


@pytest.mark.few(keep=(1, 6))
@pytest.mark.parametrize(
    ("stiffness", "count"), [(1e3, 6), (1e5, 1), (1e5, 2), (1e3, 40), (1e4, 40), (1e5, 40)]
)
def test_stiff_friction(stiffness: float, count: int):
    """Den Hartog's oscillator with and without stops, the contact up to 1e5 times as stiff as the spring."""
    rng, asked = np.random.default_rng(5), []
    for _ in range(count):
        ratio, load, zeta = rng.uniform(0.45, 2.0), rng.uniform(0.1, 0.75), rng.choice([0.0, 0.01, 0.05])
        contact = {"name": "f", "between": ["x", "ground"], "kt": stiffness, "mu": 1.0, "N0": float(load)}
        scene = oscillator(1.0, 1.0, float(zeta), [contact], 1.0)
        asked.append(against_march(scene, ratio / (2.0 * math.pi), int(rng.choice([7, 11, 15]))))
    covered, useful = judged(asked)
    assert covered >= FEWEST_COVERED
    assert useful >= FEWEST_USEFUL or count * (1.0 - useful) <= 1.0


@pytest.mark.few(3)
@pytest.mark.parametrize(("harmonics", "count"), [(11, 6), (11, 12), (21, 12)])
def test_stiff_contacts_under_small_loads(harmonics: int, count: int):
    """Far below the resonance, of any size of numbers."""
    asked = []
    for seed in range(count):
        rng = np.random.default_rng(seed)
        k, m, force = 10.0 ** rng.uniform(-2, 8), 10.0 ** rng.uniform(-4, 1), 10.0 ** rng.uniform(-4, 2)
        contacts: list[dict[str, object]] = [
            {
                "name": f"c{i}",
                "between": ["x", "ground"],
                "kt": k * 10.0 ** rng.uniform(-1, 3.5),
                "mu": 0.5,
                "N0": force * 10.0 ** rng.uniform(-5, 0),
            }
            for i in range(rng.integers(1, 4))
        ]
        scene = oscillator(k, m, 10.0 ** rng.uniform(-3.0, -1.5), contacts, force)
        ratio = rng.choice([0.22, 0.33, 0.5, 0.9, 1.1]) * rng.uniform(0.97, 1.03)
        asked.append(against_march(scene, ratio * math.sqrt(k / m) / (2.0 * math.pi), harmonics))
    covered, useful = judged(asked)
    assert covered >= 11 / 12
    assert useful >= FEWEST_USEFUL


def bar(n: int, force: float, stiffness: float) -> tuple[Scene, float]:
    """A bar of n elements pressed along its length, hardly any mass, and its exact amplitude.

    Quasi-static and of Masing's kind: the amplitude is that of first loading, found by letting contacts slip
    one after the other.
    """
    element, traction, end = 1e6 * n, 1000.0 / n, n
    names = [f"u{i}" for i in range(n + 1)]
    springs: list[dict[str, object]] = [{"between": [names[i], names[i + 1]], "k": element} for i in range(n)]
    springs.append({"between": [names[end], "ground"], "k": 0.1 * element})
    limits = np.full(n + 1, traction)
    limits[[0, end]] *= 0.5
    kt = stiffness * element
    K = np.diag(np.append(np.full(n, 2.0 * element), 1.1 * element)) - element * (
        np.eye(n + 1, k=1) + np.eye(n + 1, k=-1)
    )
    K[0, 0] = element
    slips = np.zeros(n + 1, bool)
    while True:
        load = np.where(slips, -limits, 0.0)
        load[0] += force
        u = np.linalg.solve(K + np.diag(np.where(slips, 0.0, kt)), load)
        more = slips | (kt * np.abs(u) > limits)
        if np.array_equal(more, slips):
            break
        slips = more
    scene = Scene.from_dict(
        {
            "name": "bar",
            "structure": {"kind": "lumped", "masses": dict.fromkeys(names, 1e-6), "springs": springs},
            "contacts": [
                {"name": f"c{i}", "between": [name, "ground"], "kt": kt, "mu": 1.0, "N0": float(limits[i])}
                for i, name in enumerate(names)
            ],
            "excitation": {"dof": "u0", "amplitude": force},
            "observe": {"dof": "u0", "band": [0.01, 1.0]},
        }
    )
    return scene, float(u[0])


def test_bars_that_slip_little_by_little():
    """Goodman and Klumpp (1956), Menq, Bielak and Griffin (1986): the estimate is of use."""
    asked = []
    for n, force, stiffness, harmonics in (
        (n, force, stiffness, harmonics)
        for n in (5, 10)
        for force in (100.0, 300.0, 600.0)
        for stiffness in (1.0, 20.0, 200.0)
        for harmonics in (5, 11)
    ):
        scene, amplitude = bar(n, force, stiffness)
        solution = solve(scene, frequency_hz=0.01, harmonics=harmonics)
        if solution.converged:
            asked.append((solution.max_abs, solution.error_estimate, amplitude, 0.0))
    covered, useful = judged(asked)
    assert len(asked) >= 16
    assert covered >= FEWEST_COVERED
    assert useful >= FEWEST_USEFUL


def chain(rng: np.random.Generator, count: int) -> Scene:
    """Masses in a row with a damper at one end, forced and observed at the other."""
    dofs = [f"x{i}" for i in range(count)]
    ends = zip(["ground", *dofs], [*dofs, "ground"], rng.uniform(0.5, 1.5, count + 1), strict=True)
    return Scene.from_dict(
        {
            "name": "chain",
            "structure": {
                "kind": "lumped",
                "masses": dict.fromkeys(dofs, 1.0),
                "springs": [{"between": [a, b], "k": float(k), "c": 0.03} for a, b, k in ends],
            },
            "contacts": [
                {
                    "name": "damper",
                    "between": [dofs[-1], "ground"],
                    "kt": float(10.0 ** rng.uniform(-1, 2)),
                    "mu": 0.5,
                    "N0": float(10.0 ** rng.uniform(-1, 0.5)),
                }
            ],
            "excitation": {"dof": dofs[0], "amplitude": 1.0},
            "observe": {"dof": dofs[0], "band": [0.05, 0.5]},
        }
    )


@pytest.mark.parametrize("seeds", [range(40), pytest.param(range(40, 400), marks=pytest.mark.long)])
def test_what_harmonics_do_one_after_the_other_is_not_lost_in_their_sum(seeds: range):
    """Against exact orbits: far from the damper the error changes sign from harmonic to harmonic."""
    asked = []
    for seed in seeds:
        rng = np.random.default_rng(seed)
        scene, harmonics = chain(rng, int(rng.integers(2, 5))), int(rng.choice([7, 11, 21, 41]))
        frequency_hz = float(rng.uniform(0.08, 0.4))
        solution = solve(scene, frequency_hz=frequency_hz, harmonics=harmonics)
        exact = solve_exactly(scene, frequency_hz, harmonics, near=solution)
        if exact.converged:
            asked.append((solution.max_abs, solution.error_estimate, exact.max_abs, 0.0))
    covered, useful = judged(asked, rounding=1e-12)
    assert len(asked) >= 0.95 * len(seeds)
    assert covered >= 0.99
    assert useful >= FEWEST_USEFUL


@pytest.mark.parametrize("harmonics", [7, 21, 41])
def test_two_numbers_of_harmonics_that_agree_by_accident(harmonics: int):
    """At the load that is best the peaks of 21 and of 41 harmonics are 2e-8 apart, and both 6e-7 off.

    The height of the best is that of FrictionBench's `optimum-chain`, proved by interval arithmetic.
    """
    damper = {"name": "damper", "between": ["x2", "ground"], "kt": 0.8, "mu": 0.5, "N0": 1.2844545657755282}
    pairs = [("ground", "x0", 1.0, 0.03), ("x0", "x1", 0.5, 0.03), ("x1", "x2", 0.5, 0.03)]
    springs = [{"between": [a, b], "k": k, "c": c} for a, b, k, c in (*pairs, ("x1", "ground", 1.0, 0.03))]
    springs.append({"between": ["x2", "ground"], "k": 1.0, "c": 0.03})
    scene = Scene.from_dict(
        {
            "name": "best",
            "structure": {
                "kind": "lumped",
                "masses": dict.fromkeys(("x0", "x1", "x2"), 1.0),
                "springs": springs,
            },
            "contacts": [damper],
            "excitation": {"dof": "x0", "amplitude": 1.0},
            "observe": {"dof": "x0", "band": [0.05, 0.5]},
        }
    )
    branch = sweep(scene, harmonics=harmonics)
    assert branch.peak is not None
    error = abs(branch.peak.value - 6.4272314860961230)
    assert 1e-7 < error <= branch.error_estimate <= 20.0 * error


def test_rounding_is_in_the_estimate():
    """A damper that sticks between blades: the same in units of mass that differ, but for rounding."""
    known, found = 0.00027175089903524436688211575, []
    for unit in np.random.default_rng(0).uniform(0.5, 2.0, 20).tolist():
        blades = {"b1": 0.1 * unit, "b2": 0.1 * unit, "d": 0.005 * unit}
        springs = [
            {"between": [f"b{i}", "ground"], "k": k * unit, "c": 0.5 * unit}
            for i, k in ((1, 4e5), (2, 4.1e5))
        ]
        faces = [
            {"name": f"f{i}", "between": ["d", f"b{i}"], "kt": 1e6 * unit, "mu": 0.5, "N0": 50.0 * unit}
            for i in (1, 2)
        ]
        scene = Scene.from_dict(
            {
                "name": "floating",
                "structure": {"kind": "lumped", "masses": blades, "springs": springs},
                "contacts": faces,
                "excitation": {"dof": "b1", "amplitude": 20.0 * unit},
                "observe": {"dof": "b1", "band": [200.0, 500.0]},
            }
        )
        found.append(solve(scene, frequency_hz=330.0))
    off = np.abs([one.half_peak_to_peak - known for one in found])
    estimates = np.array([one.error_estimate for one in found])
    assert np.all(off <= estimates)
    assert off.max() > 0.02 * estimates.max()
