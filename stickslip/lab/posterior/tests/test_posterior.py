"""Samplers, posteriors, evidence and the level above, against closed forms and brute-force grids."""

import math
from typing import Any

import numpy as np
import pytest
from scipy.special import ndtr

import optim
import solver
from optim.identification.fit import Noise, Runs, search
from stickslip.lab.posterior.importance import importance, smoothed
from stickslip.lab.posterior.nuts import nuts
from stickslip.lab.posterior.reassemblies import Level
from stickslip.lab.posterior.target import Target
from optim.identification.reading import read_data
from optim.identification.fit import read_unknowns
from optim.problem.uncertainty_input import read_uncertain
from optim.problem.uncertainty_set import UncertaintyShape

COVARIANCE = np.array([[2.0, 0.8], [0.8, 1.0]])
PRECISION = np.linalg.inv(COVARIANCE)


def normal(x: np.ndarray) -> tuple[float, np.ndarray]:
    """A normal density without its constant."""
    return -0.5 * float(x @ PRECISION @ x), -PRECISION @ x


def curved(x: np.ndarray) -> tuple[float, np.ndarray]:
    """A curved density with a constant of 2π · ½."""
    y = x[1] - 0.25 * (x[0] ** 2 - 1.0)
    return -0.5 * x[0] ** 2 - 2.0 * y * y, np.array([-x[0] + 2.0 * y * x[0], -4.0 * y])


def test_importance_gives_the_constant_of_a_normal_and_of_a_curved_density() -> None:
    rng = np.random.default_rng(1)
    for density, constant, about in (
        (normal, 2.0 * math.pi * math.sqrt(np.linalg.det(COVARIANCE)), 1.5 * COVARIANCE),
        (curved, math.pi, np.diag([1.0, 0.25])),
    ):
        found = importance(lambda x, of=density: of(x)[0], np.array([0.1, 0.0]), about, 2000, rng)
        assert found.pareto_k < 0.7
        assert abs(found.log_evidence - math.log(constant)) < 4.0 * found.log_evidence_error
        assert found.log_evidence_error < 0.05


def test_the_diagnosis_sees_a_proposal_that_is_too_narrow() -> None:
    rng = np.random.default_rng(2)
    x = 0.3 * rng.normal(size=2000)
    assert smoothed(-0.5 * x**2 + 0.5 * (x / 0.3) ** 2)[1] > 0.7


def test_nuts_has_the_moments_of_normal_and_curved_densities() -> None:
    rng = np.random.default_rng(3)
    found = nuts(normal, rng.normal(size=(4, 2)), 500, 100, rng)
    assert found.agree
    assert found.effective > 300.0
    np.testing.assert_allclose(np.cov(found.x.reshape(-1, 2).T), COVARIANCE, rtol=0.2)
    bent = nuts(curved, rng.normal(size=(4, 2)), 500, 100, rng).x.reshape(-1, 2)
    assert np.mean(bent[:, 0] ** 2) == pytest.approx(1.0, rel=0.25)
    assert np.mean((bent[:, 1] - 0.25 * (bent[:, 0] ** 2 - 1.0)) ** 2) == pytest.approx(0.25, rel=0.25)


def test_chains_that_do_not_agree_are_seen() -> None:
    rng = np.random.default_rng(4)

    def two_hills(x: np.ndarray) -> tuple[float, np.ndarray]:
        side = 8.0 if x[0] > 0.0 else -8.0
        return -0.5 * float((x[0] - side) ** 2), np.array([side - x[0]])

    begin = np.array([[8.0], [8.0], [-8.0], [-8.0]])
    assert not nuts(two_hills, begin, 200, 50, rng).agree


def linear() -> tuple[solver.Scene, list[dict[str, Any]], np.ndarray]:
    """A linear mass whose response is its excitation times a constant, and its responses with noise."""
    scene = solver.Scene.from_dict(
        {
            "name": "linear",
            "structure": {
                "kind": "lumped",
                "masses": {"m": 1.0},
                "springs": [{"between": ["m", "ground"], "k": 40.0, "c": 0.5}],
            },
            "contacts": [{"name": "s", "law": "polynomial", "between": ["m", "ground"], "a1": 1.0}],
            "excitation": {"dof": "m", "amplitude": 2.0},
            "observe": {"dof": "m", "band": [0.8, 1.4]},
        }
    )
    hertz = np.linspace(0.9, 1.2, 4)
    w = 2.0 * np.pi * hertz
    x = 1.0 / (41.0 - w**2 + 0.5j * w)
    unit = np.column_stack([x.real, x.imag]).ravel()
    noisy = 2.0 * unit + 0.05 * np.random.default_rng(5).normal(size=8)
    table = {"frequency": hertz, "real": noisy[::2], "imag": noisy[1::2], "sd": np.full(4, 0.05)}
    return scene, [table], unit


def test_a_linear_model_with_known_noise_and_a_normal_prior_is_conjugate() -> None:
    scene, data, unit = linear()
    seen = np.column_stack([data[0]["real"], data[0]["imag"]]).ravel()
    mean, sd = 2.2, 0.1
    found = optim.posterior(
        scene, data, {"excitation.amplitude": (1.2, 3.2)}, priors={"excitation.amplitude": (mean, sd)},
        scaling={"excitation.amplitude": "linear"},
        sampling=optim.Sampling(harmonics=1, starts=1, draws=500),
    )  # fmt: skip
    precision = unit @ unit / 0.05**2 + 1.0 / sd**2
    middle = (unit @ seen / 0.05**2 + mean / sd**2) / precision
    (one,) = found.marginals
    assert found.reached
    assert one.mean == pytest.approx(middle, abs=0.1 / math.sqrt(precision))
    assert one.sd == pytest.approx(1.0 / math.sqrt(precision), rel=0.08)
    wide = 0.05**2 * np.eye(8) + sd**2 * np.outer(unit, unit)
    rest = seen - mean * unit
    evidence = -0.5 * (
        rest @ np.linalg.solve(wide, rest) + np.linalg.slogdet(wide)[1] + 8 * math.log(2.0 * math.pi)
    )
    assert abs(found.log_evidence - evidence) < 4.0 * found.log_evidence_error + 1e-3


def test_noise_of_unknown_level_gives_the_intervals_of_student() -> None:
    scene, data, unit = linear()
    data = [{key: values for key, values in data[0].items() if key != "sd"}]
    runs = Runs(
        scene, read_data(scene, data), read_unknowns(scene, {"excitation.amplitude": (1.2, 3.2)}, {}, None), 1
    )
    fit = search(
        runs, Noise(level=None, robust=False), starts=1, seed=0, on_progress=None, should_stop=None
    ).best
    assert fit is not None
    target = Target(runs, fit, None)
    x = np.linspace(*np.array([[-0.6], [0.2]]), 4001)
    density = np.exp([target.log(one) - target.log(x[0]) for one in x[::40]])
    z = ndtr(x[::40, 0])
    values = np.array([runs.unknowns.values(np.array([one]))[0] for one in z])
    sd = fit.sd / fit.level
    best = (unit / sd) @ (runs.observations / sd) / ((unit / sd) @ (unit / sd))
    squares = np.sum(((runs.observations - np.outer(values, unit)) / sd) ** 2, axis=1)
    least = float(np.sum(((runs.observations - best * unit) / sd) ** 2))
    prior = np.exp(-0.5 * x[::40, 0] ** 2)
    wanted = prior * (squares / least) ** -4.0
    np.testing.assert_allclose(density / density.max(), wanted / wanted.max(), rtol=1e-6, atol=1e-12)


def test_gradients_of_the_density_are_those_of_differences() -> None:
    scene, data, _ = linear()
    data = [{key: values for key, values in data[0].items() if key != "sd"}]
    bounds = {"s.a1": (0.2, 5.0), "excitation.amplitude": (1.2, 3.2)}
    runs = Runs(scene, read_data(scene, data), read_unknowns(scene, bounds, {}, {"s.a1": (1.0, 0.5)}), 1)
    fit = search(
        runs, Noise(level=None, robust=False), starts=1, seed=0, on_progress=None, should_stop=None
    ).best
    assert fit is not None
    target, x = Target(runs, fit, None), np.array([0.3, -0.4])
    for i, step in enumerate(1e-5 * np.eye(2)):
        difference = (target.log(x + step) - target.log(x - step)) / 2e-5
        assert target.at(x).slope[i] == pytest.approx(difference, rel=1e-5)


def test_the_level_of_a_population_is_that_of_a_grid() -> None:
    rng = np.random.default_rng(6)
    sds = np.full(6, 0.04)
    means = 0.5 + 0.1 * rng.normal(size=6)
    level = Level(means[:, None], (sds**2)[:, None, None], np.array([0]))
    spreads, middles, k = level.drawn(4000, rng)
    t, m = np.meshgrid(np.linspace(1e-3, 1.0 / math.sqrt(12.0), 400), np.linspace(0.0, 1.0, 400))
    total = sds**2 + t[..., None] ** 2
    log = -0.5 * np.sum((means - m[..., None]) ** 2 / total + np.log(total), axis=-1)
    weight = np.exp(log - log.max())
    assert k < 0.7
    assert spreads.mean() == pytest.approx(float(np.sum(weight * t) / weight.sum()), rel=0.03)
    assert middles.mean() == pytest.approx(float(np.sum(weight * m) / weight.sum()), abs=0.004)
    for draws, values in ((spreads, t), (middles, m)):
        share = np.sum(weight[values < np.quantile(draws, 0.9)]) / weight.sum()
        assert share == pytest.approx(0.9, abs=0.02)


def test_the_simpler_of_two_models_that_explain_the_same_is_more_probable() -> None:
    """One of them has an unknown more: what of its range the data rule out is what it costs."""
    scene, data, _ = linear()
    models = {
        "level": (scene, {"excitation.amplitude": (1.2, 3.2)}),
        "level and spring": (scene, {"excitation.amplitude": (1.2, 3.2), "s.a1": (0.01, 5.0)}),
    }
    found = optim.compare_models(models, data, sampling=optim.Sampling(harmonics=1, starts=1, draws=200))
    assert found.best is not None
    assert found.best.name == "level"
    assert sum(one.probability for one in found.models) == pytest.approx(1.0)
    assert found.models[1].probability > 1e-4
    assert "level and spring" in str(found.blocks()[0].rows)


@pytest.mark.parametrize(
    ("asked", "words"),
    [({"draws": 3}, "draws"), ({"sampler": "gibbs"}, "sampler"), ({"noise": 2.0}, "noise")],
)
def test_what_cannot_be_is_refused(asked: dict[str, Any], words: str) -> None:
    with pytest.raises(optim.DesignError, match=words):
        optim.Sampling(**asked)


def test_models_and_assemblies_that_cannot_be_are_refused() -> None:
    scene, data, _ = linear()
    bounds = {"excitation.amplitude": (1.2, 3.2)}
    with pytest.raises(optim.DesignError, match="two names"):
        optim.compare_models({"one": (scene, bounds)}, data)
    with pytest.raises(optim.DesignError, match="weights"):
        optim.compare_models({"a": (scene, bounds), "b": (scene, bounds)}, data, weights={"a": 1.0})
    with pytest.raises(optim.DesignError, match="at least 3"):
        optim.reassemblies(scene, [data], bounds, ["excitation.amplitude"])
    with pytest.raises(optim.DesignError, match="varied"):
        optim.reassemblies(scene, [data] * 3, bounds, ["s.a1"])


def test_reassemblies_of_a_linear_mass_give_its_spread_and_scenarios_for_a_robust_design() -> None:
    scene, _, unit = linear()
    rng, hertz = np.random.default_rng(7), np.linspace(0.9, 1.2, 4)
    truths = 2.2 + 0.2 * np.array([-1.0, -0.4, 0.2, 0.5, 1.3])
    data = []
    for level in truths:
        noisy = level * unit + 0.01 * rng.normal(size=8)
        data.append([{"frequency": hertz, "real": noisy[::2], "imag": noisy[1::2], "sd": np.full(4, 0.01)}])
    name = "excitation.amplitude"
    found = optim.reassemblies(
        scene,
        data,
        {name: (0.5, 4.0)},
        [name],
        scaling={name: "linear"},
        sampling=optim.Sampling(harmonics=1, starts=1, draws=120),
    )
    assert found.reached
    (middle,), (spread,) = found.middles, found.spreads
    assert middle.mean == pytest.approx(truths.mean(), abs=0.05)
    assert spread.interval[0] < truths.std(ddof=1) < spread.interval[1]
    taken = read_uncertain(scene, (), found)
    assert taken.shape is UncertaintyShape.LIST
    assert len(taken.listed) == 32
    alone = found.assemblies[0]
    assert len(read_uncertain(scene, (), alone).listed) == 32
    assert alone.to_json()["samples"] == alone.samples.tolist()
    assert "excitation.amplitude" in repr(found)


@pytest.mark.parametrize(
    ("asked", "status"),
    [
        ({"sampler": "importance", "draws": 100}, optim.PosteriorStatus.UNRELIABLE),
        ({"noise": 1e-4, "draws": 150}, optim.PosteriorStatus.MODEL_DOUBTFUL),
        ({"should_stop": lambda: True}, optim.PosteriorStatus.STOPPED),
    ],
)
def test_what_the_samples_are_not_worth_is_told(asked: dict[str, Any], status: optim.PosteriorStatus) -> None:
    scene, data, _ = linear()
    asked = dict(asked)
    if "noise" in asked:
        data = [{key: values for key, values in data[0].items() if key != "sd"}]
    stop = asked.pop("should_stop", None)
    sampling = optim.Sampling(harmonics=1, starts=1, **asked)
    bounds = {"excitation.amplitude": (1.2, 3.2)}
    found = optim.posterior(scene, data, bounds, sampling=sampling, should_stop=stop)
    assert found.status is status
    assert not found.reached
    assert found.uncertain == []
    assert math.isnan(found.interval("excitation.amplitude")[0])
    assert "not told" in str(found.blocks()[0].rows)


def test_points_that_are_not_reached_leave_the_posterior_unknown() -> None:
    """The slider sticks at the least level, and the mass resonates above the frequencies looked at."""
    scene = solver.Scene.from_dict(
        {
            "name": "rig",
            "structure": {
                "kind": "lumped",
                "masses": {"m": 1.0},
                "springs": [{"between": ["m", "ground"], "k": 40.0, "c": 0.5}],
            },
            "contacts": [{"name": "s", "between": ["m", "ground"], "kt": 60.0, "mu": 0.3, "N0": 2.5}],
            "excitation": {"dof": "m", "amplitude": 4.0},
            "observe": {"dof": "m", "band": [0.8, 1.4]},
        }
    )
    data = {
        "level": [0.1, 5.0, 5.5, 6.0, 6.5, 7.0],
        "resonance_frequency": [1.6, 1.02, 1.02, 1.02, 1.02, 1.02],
    }
    unknowns = {"s.kt": (50.0, 70.0)}
    found = optim.posterior(
        scene, [data], unknowns, sampling=optim.Sampling(harmonics=1, starts=1, noise=0.05)
    )
    assert found.status is optim.PosteriorStatus.LOST
    lost = {"level": [0.1, 0.11], "resonance_frequency": [1.6, 1.6]}
    none = optim.posterior(scene, [lost], unknowns, sampling=optim.Sampling(harmonics=1, starts=1))
    assert none.status is optim.PosteriorStatus.NO_FIT
