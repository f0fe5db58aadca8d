"""Answers as functions for other programs: their derivatives are differences of the whole answer."""

from collections.abc import Iterator
from typing import Any

import numpy as np
import pytest

import solver
from stickslip.lab.exports import exact_functions as functions
from stickslip.lab.exports.exact_functions import ExactFunction

TWO = solver.load_scene("two-dof")
DISK = solver.load_scene("bladed-disk")
PATHS = ["damper.N0", "damper.kt", "damper.mu", "structure.k1"]


@pytest.fixture
def jax() -> Iterator[Any]:
    """JAX with 64 bits; imported here, it takes each process that collects tests half a second."""
    module = pytest.importorskip("jax", reason="jax is not installed")
    module.config.update("jax_enable_x64", True)
    yield module
    module.config.update("jax_enable_x64", False)


def at(scene: solver.Scene, paths: list[str], **others: float) -> np.ndarray:
    return np.array([others[path] if path in others else scene.value(path) for path in paths])


def difference(function: ExactFunction, x: np.ndarray, i: int) -> float:
    """By the parameter i, of sixth order: errors of the values are all that counts."""
    step = 2e-3 * x[i]
    values = {k: function(x + k * step * np.eye(x.size)[i])[0] for k in (-3, -2, -1, 1, 2, 3)}
    weights = {1: 45.0, 2: -9.0, 3: 1.0}
    return sum(weight * (values[k] - values[-k]) for k, weight in weights.items()) / (60.0 * step)


IN_ALL, OF_DISK = [*PATHS, "frequency"], ["shroud.N0", "shroud.kt"]
WITH_SIZE = [*PATHS, "amplitude"]
CASES = {
    "solve": (functions.solve(TWO, IN_ALL), at(TWO, IN_ALL, frequency=1.05), 1e-8),
    "solve a disk": (functions.solve(DISK, OF_DISK, frequency_hz=760.0), at(DISK, OF_DISK), 1e-8),
    "peak": (functions.peak(TWO, PATHS), at(TWO, PATHS), 1e-8),
    "least peak": (functions.least_peak(TWO, "damper.N0", 20.0, 900.0, PATHS[1:]), at(TWO, PATHS[1:]), 1e-8),
    # The optimum between two peaks is found to 1e-10, which differences enlarge.
    "least of two peaks": (
        functions.least_peak(DISK, "shroud.N0", 20.0, 3000.0, ["shroud.kt"]), at(DISK, ["shroud.kt"]), 1e-6,
    ),
    "damping ratio": (functions.damping_ratio(TWO, WITH_SIZE), at(TWO, WITH_SIZE, amplitude=2.5), 1e-8),
}  # fmt: skip


@pytest.mark.few(3)
@pytest.mark.parametrize("name", CASES)
def test_gradients_are_differences_of_the_answer(name: str) -> None:
    function, x, tolerance = CASES[name]
    value, gradient = function(x)
    assert value > 0.0
    found = np.array([difference(function, x, i) for i in range(x.size)])
    scale = np.abs(gradient * x).max()
    assert np.abs((found - gradient) * x).max() <= tolerance * scale


def test_jax_differentiates_both_ways_compiles_and_maps(jax: Any) -> None:
    import stickslip.jax

    jnp = jax.numpy
    x = jnp.array(at(TWO, PATHS))
    exact = functions.peak(TWO, PATHS)
    peak = stickslip.jax.peak(TWO, PATHS)
    value, gradient = jax.jit(jax.value_and_grad(peak))(x)
    np.testing.assert_allclose(value, exact(x)[0], rtol=1e-12)
    np.testing.assert_allclose(gradient, exact(x)[1], rtol=1e-9)
    _, along = jax.jvp(peak, (x,), (jnp.array([1.0, 0.0, 0.0, 0.0]),))
    np.testing.assert_allclose(along, gradient[0], rtol=1e-9)
    both = jax.vmap(peak)(jnp.stack([x, 1.1 * x]))
    np.testing.assert_allclose(both, [exact(x)[0], exact(1.1 * x)[0]], rtol=1e-12)

    def of_load(log_load: Any) -> Any:
        return jnp.log(peak(x.at[0].set(jnp.exp(log_load))))

    wanted = gradient[0] * x[0] / value
    np.testing.assert_allclose(jax.grad(of_load)(jnp.log(x[0])), wanted, rtol=1e-9)


def test_jax_is_told_what_is_wrong(jax: Any) -> None:
    import stickslip.jax

    jnp = jax.numpy
    peak = stickslip.jax.peak(TWO, PATHS)
    with pytest.raises(solver.SettingError, match=r"shape \(4,\): damper.N0"):
        peak(jnp.ones(3))
    with pytest.raises(solver.SettingError, match="frequency_hz"):
        stickslip.jax.solve(TWO, PATHS)
    with pytest.raises(solver.SettingError, match="amplitude"):
        stickslip.jax.damping_ratio(TWO, PATHS)
    with pytest.raises(solver.SettingError, match="must not hold"):
        stickslip.jax.least_peak(TWO, "damper.N0", 20.0, 900.0, PATHS)
    jax.config.update("jax_enable_x64", False)
    with pytest.raises(solver.SettingError, match="jax_enable_x64"):
        peak(jnp.ones(4))


def test_what_has_no_answer_is_no_number() -> None:
    springs = [{**spring, "c": 0.0} for spring in TWO.to_dict()["structure"]["springs"]]
    undamped = solver.Scene.from_dict(
        {**TWO.to_dict(), "structure": {**TWO.to_dict()["structure"], "springs": springs}}
    )
    # Friction below π/4 of the force: the response grows without bound.
    value, gradient = functions.peak(undamped, ["damper.N0"])(np.array([1e-3]))
    assert np.isnan(value)
    assert np.isnan(gradient).all()


def test_openmdao_finds_the_least_peak() -> None:
    om = pytest.importorskip("openmdao.api", reason="openmdao is not installed")
    import stickslip.openmdao

    problem = om.Problem(reports=None)
    function = stickslip.openmdao.peak(TWO, ["damper.N0", "damper.kt"])
    problem.model.add_subsystem("damper", stickslip.openmdao.FrictionComponent(function, TWO), promotes=["*"])
    problem.model.add_design_var("damper:N0", lower=20.0, upper=900.0, ref=100.0)
    problem.model.add_objective("peak")
    problem.driver = om.ScipyOptimizeDriver(optimizer="SLSQP", tol=1e-10, disp=False)
    problem.setup()
    problem.run_model()
    checked = problem.check_partials(out_stream=None, form="central", step=1e-5, step_calc="rel_avg")
    for (_, path), error in checked["damper"].items():
        assert error["abs error"].forward <= 1e-6 * abs(problem["peak"].item() / problem[path].item())
    problem.run_driver()
    best = solver.least_peak(TWO, "damper.N0", 20.0, 900.0)
    assert problem["peak"].item() == pytest.approx(best.peak, rel=1e-6)
