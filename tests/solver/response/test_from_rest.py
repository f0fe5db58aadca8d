"""The transient from rest to a response whose contacts stick, against matrix exponentials of the annulus."""

import math
from dataclasses import replace

import numpy as np
import pytest
from scipy.linalg import block_diag, expm

import solver
from solver import Scene
from solver.jit.fourier import Real
from solver.linear.assembly import linear_model
from solver.linear.model import LinearModel
from solver.response.history_dependence import Start, keeps_sticking


def _disk() -> Scene:
    raw = solver.load_scene("bladed-disk").to_dict()
    raw["structure"]["sectors"] = 5
    return Scene.from_dict(raw)


SCENES = {"two-dof": lambda: solver.load_scene("two-dof"), "bladed-disk of 5 sectors": _disk}


def _start(scene: Scene) -> Start:
    model, rng = linear_model(scene), np.random.default_rng(3)
    x, v = rng.normal(size=(2, model.sectors, len(model.dofs)))
    omega = 2.0 * math.pi * float(np.mean(scene.observe.band))
    stiffness = model.port_stiffnesses
    return Start(model=model, stiffness=stiffness, x=x, v=omega * v, omega=omega)


def _whole(start: Start) -> tuple[Real, Real]:
    """Return the matrix of the decay by τ, and the ports of all sectors, both of the annulus written out."""
    model: LinearModel = start.model
    sectors, n = start.x.shape
    M, K = block_diag(*[model.M] * sectors), np.zeros((sectors * n, sectors * n))
    C, ports = K.copy(), np.zeros((sectors, len(model.contact_here), sectors * n))
    for s in range(sectors):
        here, beyond = slice(s * n, (s + 1) * n), slice((s + 1) % sectors * n, ((s + 1) % sectors + 1) * n)
        for whole, own, coupling in ((K, model.K0, model.Kp), (C, model.C0, model.Cp)):
            whole[here, here] += own
            whole[here, beyond] += coupling
            whole[beyond, here] += coupling.T
        ports[s, :, here] += model.contact_here
        ports[s, :, beyond] += model.contact_next
        K += ports[s].T @ (start.stiffness[:, None] * ports[s])
    nothing, one, omega = np.zeros_like(K), np.eye(len(K)), start.omega
    inverse = np.linalg.inv(M)
    generator = np.block([[nothing, one], [-inverse @ K / omega**2, -inverse @ C / omega]])
    return generator, ports


@pytest.mark.parametrize("name", SCENES)
def test_the_transient_is_that_of_matrix_exponentials_and_stays_below_its_bound(name: str) -> None:
    """Every port of every sector, at instants of three periods, and what bounds it from a period on."""
    start = _start(SCENES[name]())
    generator, ports = _whole(start)
    bounds: list[Real] = []
    periods: list[tuple[Real, Real]] = []

    def holds(moved: Real) -> bool:
        """Not at the beginning, but at the end; in between only after many halvings."""
        bounds.append(moved)
        return len(bounds) == 2 or len(bounds) > 14

    def fits(moved: Real, tau: Real) -> bool:
        periods.append((moved, tau))
        return len(periods) < 3

    assert not keeps_sticking(start, fits, holds)
    assert len(periods) == 3
    sectors, n = start.x.shape
    rest = -np.concatenate([start.x.ravel(), start.v.ravel() / start.omega])
    largest = np.zeros(ports.shape[1])
    for number, (moved, tau) in enumerate(periods):
        for i in range(0, tau.size, 37):
            state = expm((tau[i] + 2.0 * math.pi * number) * generator) @ rest
            there = ports @ state[: sectors * n]
            assert moved[i] == pytest.approx(there, rel=1e-9, abs=1e-9 * np.abs(there).max())
        largest = np.maximum(largest, np.abs(moved).max(axis=(0, 1)))
    assert np.all(largest <= bounds[0])
    assert np.all(bounds[0] <= 30.0 * largest)
    assert np.all(bounds[1] < bounds[0])


def test_a_transient_below_the_limit_is_not_followed() -> None:
    """The bound alone proves it."""
    start = _start(_disk())

    def fits(_moved: Real, _tau: Real) -> bool:
        raise AssertionError

    assert keeps_sticking(start, fits, lambda _moved: True)


def test_a_motion_that_grows_is_not_proven() -> None:
    """Damping that gives power: the start may lead anywhere."""
    scene = solver.load_scene("two-dof")
    start = _start(scene)
    model = start.model
    grows = Start(
        model=replace(model, C0=-model.C0), stiffness=start.stiffness, x=start.x, v=start.v,
        omega=start.omega,
    )  # fmt: skip
    assert not keeps_sticking(grows, lambda _moved, _tau: True, lambda _moved: True)
