"""Hessians beside differences of the gradient through the whole solve."""

import math
from collections.abc import Callable

import numpy as np
from contact_cases import central_difference

import solver
from solver.balance.balance import Balance, build
from solver.balance.simplifications import Effects
from solver.balance.workspace import Workspace
from solver.scene.scene import Scene
from solver.sensitivity.gradient import Sensitivities

HARMONICS = 7
ALL = Effects(even_harmonics=True)


def solved(
    scene: Scene, hz: float, effects: Effects, guess: np.ndarray | None = None
) -> tuple[Balance, np.ndarray]:
    balance = build(scene, harmonics=HARMONICS, effects=effects)
    found = Workspace.of(balance).solve(2.0 * math.pi * hz, guess)
    assert found.converged
    return balance, found.u


def sizes(scene: Scene, paths: tuple[str, ...]) -> np.ndarray:
    """A size of each parameter, in which derivatives are compared."""
    return np.array([abs(scene.value(path)) or 1.0 for path in paths])


def difference(function: Callable[[float], np.ndarray], exact: np.ndarray, size: float) -> np.ndarray:
    """The central difference nearest to the exact value among some steps."""
    found = [central_difference(function, step * size) for step in (1e-3, 1e-4, 1e-5)]
    return min((d for d in found if d is not None), key=lambda d: float(np.abs(d - exact).max()))


def error_of_hessian(scene: Scene, hz: float, paths: tuple[str, ...], effects: Effects = ALL) -> float:
    """Largest error of the Hessian of the amplitude by frequency and paths, each in its size."""
    balance, u = solved(scene, hz, effects)
    found = Sensitivities(balance, paths).hessian(u, hz)
    size = np.append(0.1 * hz, sizes(scene, paths))
    exact = np.block([[np.array([[found.by_frequency_twice]]), found.mixed[None]],
                      [found.mixed[:, None], found.hessian]])  # fmt: skip
    assert np.isfinite(exact).all()
    scale = max(found.value, float(np.abs(exact * np.outer(size, size)).max()))

    def slopes(there: Scene, at: float) -> np.ndarray:
        moved, solution = solved(there, at, effects, u)
        gradient = Sensitivities(moved, paths).gradient(solution, at)
        return np.append(gradient.by_frequency, gradient.by_parameters) * size

    worst = 0.0
    for i in range(len(size)):

        def moved(x: float, i: int = i) -> np.ndarray:
            if i == 0:
                return slopes(scene, hz + x)
            return slopes(scene.with_values({paths[i - 1]: scene.value(paths[i - 1]) + x}), hz)

        wanted = exact[i] * size
        error = np.abs(difference(moved, wanted, size[i]) - wanted) * size[i]
        worst = float(np.maximum(worst, error.max() / scale))
    return worst


def peak_of(scene: Scene, near: float) -> tuple[solver.Branch, solver.Peak]:
    branch = solver.sweep(scene, harmonics=HARMONICS, effects=ALL)
    assert branch.reached
    return branch, min((p for p in branch.peaks if p.interior), key=lambda p: abs(p.at - near))


def check_hessian_of_a_peak(scene: Scene, near: float, paths: tuple[str, ...]) -> None:
    """The Hessian of a peak, its gradient and its drift equal differences through the whole sweep."""
    branch, peak = peak_of(scene, near)
    found = Sensitivities(branch.balance, paths).peak_hessian(peak.solution, peak.at)
    assert np.isfinite(found.hessian).all()
    np.testing.assert_allclose(found.hessian, found.hessian.T, rtol=1e-9, atol=1e-12 * peak.value)
    size = sizes(scene, paths)
    scale = max(1.0, float(np.abs(found.hessian * np.outer(size, size)).max()) / peak.value)
    for i, path in enumerate(paths):

        def moved(x: float, path: str = path) -> np.ndarray:
            there, shifted = peak_of(scene.with_values({path: scene.value(path) + x}), peak.at)
            slopes = Sensitivities(there.balance, paths).gradient(shifted.solution, shifted.at).by_parameters
            return np.append(slopes * size / peak.value, [shifted.at / peak.at, shifted.value / peak.value])

        wanted = np.append(found.hessian[i] * size / peak.value,
                           [found.drift[i] / peak.at, found.gradient[i] / peak.value])  # fmt: skip
        error = np.abs(difference(moved, wanted, size[i]) - wanted) * size[i]
        assert error.max() <= 1e-6 * scale, (path, error)
