"""Random scenes with bodies that nothing but contacts holds: dampers between blades, in chains and in disks.

Lumped scenes have one or two bodies of one to three masses, joined among themselves by springs; each body
touches the blades, or the ground, at two to four places. In disks the body lies between two sectors.
Normal loads go from slipping all the time to sticking all the time; some vary, and some scenes have a static
force besides, on a blade or on the body itself.
"""

import math
from typing import Any

import numpy as np
from scipy.linalg import eigvalsh

from solver import Scene
from solver.linear.assembly import linear_model
from solver.scene.scene import CyclicStructure

K0 = 4e5  # N/m, of a blade of 0.1 kg


def floating_scene(seed: int) -> Scene:
    """A random scene with a floating body, and the band that holds its blades' resonances."""
    rng = np.random.default_rng(seed)
    zeta = 10.0 ** rng.uniform(-5.0, -1.0)
    raw = _disk(rng, zeta) if rng.random() < 0.25 else _chain(rng, zeta)
    raw["name"] = f"floating-{seed}"
    scene = Scene.from_dict({**raw, "observe": {"dof": "b0", "band": [1.0, 2.0]}})
    return Scene.from_dict({**raw, "observe": {"dof": "b0", "band": _band(scene)}})


def _chain(rng: np.random.Generator, zeta: float) -> dict[str, Any]:
    blades = [f"b{i}" for i in range(rng.integers(1, 4))]
    masses = {blade: float(rng.uniform(0.05, 0.2)) for blade in blades}
    springs = [_spring(rng, blade, "ground", zeta) for blade in blades]
    springs += [
        _spring(rng, blades[i], blades[i + 1], zeta, 10.0 ** rng.uniform(-3.0, 0.0))
        for i in range(len(blades) - 1)
        if rng.random() < 0.5
    ]
    force = float(10.0 ** rng.uniform(-1.0, 2.0))
    contacts: list[dict[str, Any]] = []
    for number in range(1 if rng.random() < 0.75 else 2):
        body = _body(rng, f"d{number}_", masses, springs, zeta)
        places = [*blades, *blades, "ground"]
        for _ in range(rng.integers(2, 5)):
            ends = [str(rng.choice(body)), str(rng.choice(places))]
            contacts.append(_contact(rng, f"c{len(contacts)}", ends, force))
    excitation: list[dict[str, Any]] = [{"dof": str(rng.choice(blades)), "amplitude": force}]
    if (draw := rng.random()) < 0.25:
        on = body[0] if draw < 0.1 else blades[0]
        pull = float(force * 10.0 ** rng.uniform(-2.0, 1.0))
        excitation.append({"dof": on, "amplitude": pull, "harmonic": 0})
    return {
        "structure": {"kind": "lumped", "masses": masses, "springs": springs},
        "contacts": contacts,
        "excitation": excitation,
    }


def _disk(rng: np.random.Generator, zeta: float) -> dict[str, Any]:
    sectors = int(rng.integers(6, 31))
    masses = {"b0": float(rng.uniform(0.05, 0.2)), "disk": float(rng.uniform(0.3, 1.0))}
    springs = [
        _spring(rng, "b0", "disk", zeta),
        _spring(rng, "disk", "disk@next", 0.0, 8.0),
        _spring(rng, "disk", "ground", zeta, 4.0),
    ]
    force = float(10.0 ** rng.uniform(-1.0, 2.0))
    body = _body(rng, "d_", masses, springs, zeta)
    ends = [[body[0], "b0"], [body[-1], "b0@next"], [body[0], "disk"]][: rng.integers(2, 4)]
    contacts = [_contact(rng, f"c{i}", pair, force) for i, pair in enumerate(ends)]
    return {
        "structure": {"kind": "cyclic", "sectors": sectors, "masses": masses, "springs": springs},
        "contacts": contacts,
        "excitation": {"dof": "b0", "amplitude": force, "engine_order": int(rng.integers(1, sectors // 2))},
    }


def _body(
    rng: np.random.Generator, name: str, masses: dict[str, float], springs: list[dict[str, Any]], zeta: float
) -> list[str]:
    """Add a body of one to three masses; return its DOFs."""
    body = [f"{name}{i}" for i in range(rng.integers(1, 4))]
    masses |= {dof: float(0.01 * 10.0 ** rng.uniform(-1.0, 0.5)) for dof in body}
    springs += [
        _spring(rng, *body[i : i + 2], zeta, 10.0 ** rng.uniform(-1.0, 2.0)) for i in range(len(body) - 1)
    ]
    return body


def _spring(
    rng: np.random.Generator, first: str, second: str, zeta: float, scale: float = 1.0
) -> dict[str, Any]:
    k = float(scale * K0 * rng.uniform(0.7, 1.4))
    return {"between": [first, second], "k": k, "c": 2.0 * zeta * k / math.sqrt(K0 / 0.1)}


def _contact(rng: np.random.Generator, name: str, ends: list[str], force: float) -> dict[str, Any]:
    """Loads from slipping nearly always to sticking always; one in six varies, perhaps separates."""
    mu = float(rng.uniform(0.1, 0.6))
    load = float(force / mu * 10.0 ** rng.uniform(-1.5, 2.0))
    varies = rng.random() < 1.0 / 6.0
    return {
        "name": name, "between": ends, "kt": float(K0 * 10.0 ** rng.uniform(-1.0, 1.5)), "mu": mu, "N0": load,
        "N1_ratio": float(rng.uniform(0.1, 1.5)) if varies else 0.0,
        "N1_phase": float(rng.uniform(-math.pi, math.pi)) if varies else 0.0,
    }  # fmt: skip


def _band(scene: Scene) -> list[float]:
    """Return a band [Hz] round the blades' resonances, contacts free and stuck."""
    model = linear_model(scene)
    theta = 0.0
    if isinstance(scene.structure, CyclicStructure):
        theta = 2.0 * math.pi * model.engine_order / model.sectors
    turn = np.exp(1j * theta)
    K = model.K0 + model.Kp * turn + model.Kp.T * np.conj(turn)
    L = model.contact_here + model.contact_next * turn
    free = eigvalsh(K, model.M)
    kt = np.array([contact.kt for contact in scene.contacts])
    stuck = eigvalsh(K + L.conj().T @ (kt[:, None] * L), model.M)
    lowest = math.sqrt(free[free > 1e-6 * K0].min()) / (2.0 * math.pi)
    top = math.sqrt(stuck.max()) / (2.0 * math.pi)
    return [0.7 * lowest, min(1.3 * top, 3.0 * lowest)]
