"""Error estimates of stiff friction and of bars that slip bit by bit, by marches and a closed form."""

import math

import numpy as np
import pytest

from solver import Scene, march, solve

FEWEST_COVERED, FEWEST_USEFUL, USEFUL = 0.95, 0.9, 100.0
ROUNDING = 1e-9  # of the amplitude


def judged(asked: list[tuple[float, float, float, float]]) -> tuple[float, float]:
    """Shares of (answer, estimate, truth, its own error) covered, and with an estimate within 100 times."""
    answers, estimates, truth, own = np.array(asked).T
    error, own = np.abs(answers - truth), np.maximum(own, ROUNDING * truth)
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
