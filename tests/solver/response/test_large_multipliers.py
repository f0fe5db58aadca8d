"""Multipliers by collocation beside exponentials and an integrator, of a share of a wave; stops."""

import math
from itertools import pairwise
from typing import Any

import numpy as np
import pytest
from mistuned_cases import disk
from moving_scenes import moving_scene
from scipy.integrate import solve_ivp

from solver import Scene, StoppedError, annulus, load_scene, plan, solve, stability
from solver.contacts.pieces.piece import Rates, StateEntry, StatePiece, steady
from solver.jit.fourier import Real
from solver.response.stability import monodromy as module
from solver.response.stability.cost import forecast
from solver.response.stability.floquet import scene_monodromy
from solver.response.stability.monodromy import PERIOD, LinearPart, PeriodElement, blocks_of, monodromy


def maps(scene: Scene, frequency_hz: float, harmonics: int) -> tuple[Real, Real]:
    """The map by a share of the wave, and that of the annulus written out over the whole period."""
    whole = annulus(scene)
    solution = solve(scene, frequency_hz=frequency_hz, harmonics=harmonics)
    assert solution.converged
    motions = tuple(np.array(contact.motions) for contact in solution.contacts)
    every = []
    sectors = scene.structure.sector_count
    for contact in whole.contacts:
        name, j = contact.name.split("@")
        i = [each.name for each in scene.contacts].index(name)
        angle = PERIOD * (scene.engine_order * int(j) % sectors) / sectors
        turned = motions[i].copy()
        for k in range(1, harmonics + 1):
            c, s = math.cos(k * angle), math.sin(k * angle)
            cosine, sine = motions[i][:, 2 * k - 1], motions[i][:, 2 * k]
            turned[:, 2 * k - 1], turned[:, 2 * k] = c * cosine + s * sine, c * sine - s * cosine
        every.append(turned)
    found = scene_monodromy(scene, frequency_hz, motions)
    return found.matrix, scene_monodromy(whole, frequency_hz, tuple(every)).matrix


def in_space(order: int, sectors: int, seed: int) -> Scene:
    """A disk of parts that move in space, with contacts in space between neighbours that open and turn."""
    rng = np.random.default_rng([41, seed])
    raw: dict[str, Any] = disk(order, sectors=sectors).to_dict()
    ways = "xyz"
    raw["structure"] |= {
        "masses": {way: rng.uniform(0.8, 1.5) for way in ways}, "dampers": [],
        "springs": [
            *({"between": [w, "ground"], "k": rng.uniform(0.8, 2.0), "c": 0.06} for w in ways),
            *({"between": [w, f"{w}@next"], "k": rng.uniform(0.1, 0.4), "c": 0.01} for w in ways),
            {"between": ["x", "y"], "k": 0.3, "c": 0.0}, {"between": ["y", "z"], "k": 0.2, "c": 0.0},
        ],
    }  # fmt: skip
    raw["contacts"] = [
        {
            "name": "shroud", "law": "coulomb-3d", "limit": "circle", "prestressed": True,
            "between": ["x", "x@next"], "between_second": ["y", "y@next"], "normal_between": ["z", "z@next"],
            "kt": rng.uniform(0.5, 1.5), "kn": rng.uniform(0.5, 2.0), "mu": 0.4, "N0": rng.uniform(0.2, 0.5),
        }
    ]  # fmt: skip
    raw["excitation"] = [
        {"dof": w, "amplitude": rng.uniform(0.3, 0.8), "phase": rng.uniform(-3.0, 3.0), "engine_order": order}
        for w in ways
    ]
    raw["observe"] = {"dof": "x", "band": [0.1, 0.5]}
    return Scene.from_dict(raw)


@pytest.mark.parametrize(("order", "sectors"), [(0, 3), (1, 3), (2, 4), (2, 5), (3, 6)])
def test_a_share_of_a_wave_gives_the_map_of_the_whole_period(order: int, sectors: int):
    found, expected = maps(in_space(order, sectors, 10 * sectors + order), 0.21, 9)
    np.testing.assert_allclose(found, expected, atol=1e-8 * np.abs(expected).max())


def structure_of(rng: np.random.Generator, n: int, kind: str) -> LinearPart:
    """Random matrices: modal damping, dashpots anywhere, one rigid motion, or stiffness of no energy."""
    root, stiff = rng.normal(size=(n, n)), rng.normal(size=(n, n))
    M, K = root @ root.T + n * np.eye(n), stiff @ stiff.T + np.eye(n)
    if kind == "rigid":
        way = rng.normal(size=n)
        away = np.eye(n) - np.outer(way, way) / (way @ way)
        K = away @ K @ away
    C = 0.02 * K + 0.01 * M
    if kind == "dashpots":
        C = C + np.diag(rng.uniform(0.0, 1.0, n))
    if kind == "follower":
        K = K + 0.3 * (stiff - stiff.T)
    return LinearPart(M=M, C=C, K=K)


def elements_of(rng: np.random.Generator, n: int, *, constant: bool) -> tuple[PeriodElement, ...]:
    """Contacts that stick and slip, or whose stiffness and memory change all the time."""
    found = []
    for _ in range(2):
        edges = np.sort(rng.uniform(0.0, PERIOD, 3))
        stuck = StatePiece(
            begin=edges[0], end=edges[1], rates=steady(np.eye(1) * 2.0, -np.eye(1) * 2.0),
            entry=StateEntry(np.eye(1), None), carried=np.eye(1),
        )  # fmt: skip
        a, b, c = rng.uniform(0.3, 1.0, 3)

        def rates(tau: Real, a: float = a, b: float = b, c: float = c) -> Rates:
            one = np.ones((len(tau), 1, 1))
            turn = np.cos(tau)[:, None, None]
            return Rates((2.0 + turn) * one, b * turn * one, c * one, a * turn * one, -(b + turn) * one)

        slips = StatePiece(begin=edges[1], end=edges[2], rates=rates, entry=StateEntry(np.eye(1), np.eye(1)),
                      carried=np.zeros((1, 1)))  # fmt: skip
        pieces = (stuck,) if constant else (stuck, slips)
        found.append(PeriodElement(ports=rng.normal(size=(1, n)), pieces=pieces))
    return tuple(found)


@pytest.mark.parametrize("kind", ["modal", "dashpots", "rigid", "follower"])
def test_collocation_gives_what_exponentials_give(kind: str, monkeypatch: pytest.MonkeyPatch):
    rng = np.random.default_rng([42, len(kind)])
    structure, elements = structure_of(rng, 6, kind), elements_of(rng, 6, constant=True)
    exact = monodromy(structure, elements, 0.7)
    monkeypatch.setattr(module, "of_an_exponential", lambda *_: math.inf)
    found = monodromy(structure, elements, 0.7)
    np.testing.assert_allclose(found.matrix, exact.matrix, atol=1e-8 * np.abs(exact.matrix).max())
    assert found.neutral == exact.neutral
    blocks = blocks_of(structure.M, structure.C, structure.K, np.zeros((0, 6)), 0.7)
    assert len(blocks.stiffness) == (6 if kind in ("modal", "rigid") else 1)


def integrated(structure: LinearPart, elements: tuple[PeriodElement, ...], omega: float) -> Real:
    """The map of displacements and velocities, by an integrator that shares nothing but the rates."""
    n, found = len(structure.M), []
    edges = {0.0, PERIOD, *(edge for e in elements for p in e.pieces for edge in (p.begin, p.end))}
    inverse = np.linalg.inv(structure.M)

    def slope(tau: float, z: Real, now: list[int]) -> Real:
        x, v, w = z[:n], z[n : 2 * n], z[2 * n :]
        force, more = (structure.K @ x) / omega**2 + (structure.C @ v) / omega, np.zeros(len(elements))
        for i, (element, at) in enumerate(zip(elements, now, strict=True)):
            if at < 0:
                continue
            rates, (row,) = element.pieces[at].at(np.array([tau])), element.ports
            values = [float(each[0, 0, 0]) for each in rates]
            force = force + row * (values[0] * (row @ x) + values[1] * w[i]) / omega**2
            more[i] = values[2] * (row @ x) + values[3] * (row @ v) + values[4] * w[i]
        return np.concatenate([v, -inverse @ force, more])

    for column in np.eye(2 * n):
        z, before = np.concatenate([column, np.zeros(len(elements))]), [-1] * len(elements)
        for begin, end in pairwise(sorted(edges)):
            now = [element.piece_at(0.5 * (begin + end)) for element in elements]
            for i, (element, old, new) in enumerate(zip(elements, before, now, strict=True)):
                if new == 0 and old != 0:
                    z[2 * n + i] = element.ports[0] @ z[:n]
                elif new == 1 and old == 0:
                    z[2 * n + i] += element.ports[0] @ z[:n]
            before = now
            run = solve_ivp(slope, (begin, end), z, "DOP853", rtol=1e-11, atol=1e-13, args=(now,))
            z = run.y[:, -1]
        found.append(z[: 2 * n])
    return np.array(found).T


@pytest.mark.parametrize("kind", ["modal", "dashpots", "rigid", "follower"])
def test_collocation_gives_what_an_integrator_gives(kind: str):
    rng = np.random.default_rng([43, len(kind)])
    structure, elements = structure_of(rng, 5, kind), elements_of(rng, 5, constant=False)
    found, expected = monodromy(structure, elements, 0.9).matrix, integrated(structure, elements, 0.9)
    np.testing.assert_allclose(found, expected, atol=1e-8 * np.abs(expected).max())


def test_finer_steps_change_nothing(monkeypatch: pytest.MonkeyPatch):
    """Contacts in space that open, with the steps that are taken and with steps four times as fine."""
    for seed in (1, 4, 7):
        scene, frequency_hz = moving_scene(seed)
        solution = solve(scene, frequency_hz=frequency_hz)
        motions = tuple(np.array(contact.motions) for contact in solution.contacts)
        found = scene_monodromy(scene, frequency_hz, motions).matrix
        with monkeypatch.context() as finer:
            finer.setattr(module, "FASTEST_IN_A_STEP", 1.0)
            finer.setattr(module, "SMOOTH", 1e-6)
            expected = scene_monodromy(scene, frequency_hz, motions).matrix
        np.testing.assert_allclose(found, expected, atol=1e-7 * np.abs(expected).max())


def test_progress_and_stop():
    scene, frequency_hz = moving_scene(1)
    solution = solve(scene, frequency_hz=frequency_hz)
    told: list[tuple[float, int]] = []
    stability(solution, on_progress=lambda share, count: told.append((share, count)))
    assert told == sorted(told)
    assert told[-1][0] == 1.0
    with pytest.raises(StoppedError, match="stopped"):
        stability(solution, should_stop=lambda: True)


def test_a_forecast_grows_with_what_there_is_to_do():
    """With contacts in space, with sectors that no wave spares, and with what is fast."""
    scene = in_space(1, 5, 3)
    assert forecast(scene) < forecast(annulus(scene))
    assert forecast(scene, 0.2) < forecast(scene, 0.002)
    stiff = scene.with_values({"shroud.kn": 1e6})
    assert forecast(stiff) > forecast(scene)
    assert plan(scene).seconds_of_stability == forecast(scene)


@pytest.mark.parametrize("mass", [5e-324, 1e-300, 1e-200, 1e-155, 1e15])
def test_a_forecast_of_any_mass_is_a_time(mass: float) -> None:
    """Infinite at most; products of what is in range leave it nowhere, and no warning is raised."""
    raw = load_scene("two-dof").to_dict()
    raw["structure"]["masses"]["m1"] = mass
    seconds = forecast(Scene.from_dict(raw))
    assert seconds > 0.0
    assert (plan(Scene.from_dict(raw)).to_json()["estimated_seconds_of_stability"] is None) == math.isinf(
        seconds
    )
