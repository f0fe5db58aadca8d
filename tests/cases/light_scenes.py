"""Random lightly damped scenes: narrow resonances that a contact hardly sees, or does not see at all.

Damping ratios are those of blades and far beyond, 1e-5 to 0.1. Modes lie close together or far apart, force,
contact and observed DOF may be near nodes, loads go from slipping always to sticking always. The response is
unique wherever its mean is: the loads do not move with the parts and every mode is damped.
"""

import math
from collections.abc import Callable
from typing import Any, NamedTuple

import numpy as np
from scipy.linalg import eigvalsh

from solver import Scene
from solver.balance.balance import build
from solver.linear.assembly import linear_model
from solver.response.time_history import matrices

Rng = np.random.Generator
Tables = dict[str, Any]

LEAST_DAMPING, MOST_DAMPING = 1e-5, 0.1  # damping ratios
FAR_BELOW, FAR_ABOVE = 0.3, 1.3  # the band: shares of the lowest and of the highest natural frequency


class LightScene(NamedTuple):
    """A scene, the class it is drawn from and the highest harmonic kept."""

    scene: Scene
    kind: str
    harmonics: int


def light_scene(seed: int) -> LightScene:
    """The scene of a seed; its class follows from the seed, so that every hundred holds all of them."""
    rng = np.random.default_rng([seed, 20])
    kind = _TURNS[seed % len(_TURNS)]
    raw = _DRAWN[kind](rng)
    raw["name"] = f"light-{kind}-{seed}"
    if raw["contacts"]:
        harmonics = int(rng.choice([3, 5]))
    else:
        harmonics = max(2, max(force["harmonic"] for force in raw["excitation"]))
    raw["observe"]["band"] = [1.0, 2.0]
    raw["observe"]["band"] = _band(rng, Scene.from_dict(raw))
    return LightScene(Scene.from_dict(raw), kind, harmonics)


def _log(rng: Rng, low: float, high: float) -> float:
    """A number between two limits, uniform in its logarithm."""
    return float(math.exp(rng.uniform(math.log(low), math.log(high))))


def _lumped(rng: Rng, masses: Tables, springs: list[Tables]) -> Tables:
    """A lumped structure with its damping: proportional to the stiffness, or dashpots beside some springs."""
    structure: Tables = {"kind": "lumped", "masses": masses, "springs": springs}
    ratio = _log(rng, LEAST_DAMPING, MOST_DAMPING)
    k, m = max(spring["k"] for spring in springs), min(masses.values())
    omega = math.sqrt(k / m)
    if rng.random() < 0.5:
        structure["stiffness_proportional_damping"] = 2.0 * ratio / omega
        return structure
    for spring in springs:
        # Every spring has a dashpot, that no mode is without damping; they differ by up to thirty times.
        spring["c"] = 2.0 * ratio * spring["k"] / omega * _log(rng, 0.1, 3.0)
    return structure


def _contact(rng: Rng, name: str, between: tuple[str, str], force: float, k: float) -> Tables:
    """From loads that hardly matter to loads that stick whatever resonates; half of them vary."""
    mu = float(rng.uniform(0.1, 0.6))
    contact: Tables = {"name": name, "between": list(between), "kt": k * _log(rng, 1e-3, 1e3), "mu": mu}
    share = 1e8 if rng.random() < 0.15 else _log(rng, 1e-3, 1e3)
    contact["N0"] = force / mu * share
    if rng.random() < 0.4:
        contact["N1_ratio"] = float(rng.uniform(0.0, 1.8))
        contact["N1_phase"] = float(rng.uniform(-math.pi, math.pi))
    return contact


def _forces(rng: Rng, dofs: list[str], **more: Any) -> list[Tables]:
    """One to three forces, some at a multiple of the frequency, some static."""
    forces = [{"dof": str(rng.choice(dofs)), "amplitude": _log(rng, 0.1, 100.0), "harmonic": 1, **more}]
    first = forces[0]["amplitude"]
    if rng.random() < 0.3:
        other = str(rng.choice(dofs))
        forces.append({"dof": other, "amplitude": first * _log(rng, 1e-3, 3.0), "harmonic": 1,
                       "phase": float(rng.uniform(-math.pi, math.pi)), **more})  # fmt: skip
    if rng.random() < 0.3:
        forces.append({"dof": str(rng.choice(dofs)), "amplitude": first * _log(rng, 1e-2, 2.0),
                       "harmonic": int(rng.integers(2, 4)), **more})  # fmt: skip
    if rng.random() < 0.15:
        forces.append({"dof": str(rng.choice(dofs)), "amplitude": first * float(rng.normal()),
                       "harmonic": 0, **more})  # fmt: skip
    return forces


def _ends(rng: Rng, dofs: list[str]) -> tuple[str, str]:
    first = str(rng.choice(dofs))
    return first, str(rng.choice([dof for dof in [*dofs, "ground"] if dof != first]))


def _assembled(
    rng: Rng, structure: Tables, forces: list[Tables], pairs: list[tuple[str, str]], observed: str, k: float
) -> Tables:
    size = forces[0]["amplitude"]
    contacts = [_contact(rng, f"c{i}", pair, size, k) for i, pair in enumerate(pairs)]
    return {"structure": structure, "contacts": contacts, "excitation": forces, "observe": {"dof": observed}}


def _chain(rng: Rng) -> Tables:
    """One to six masses in a row, some of them on the ground; weak springs among the strong ones."""
    dofs = [f"m{i}" for i in range(rng.integers(1, 7))]
    k = _log(rng, 10.0, 1e7)
    masses = {dof: float(rng.uniform(0.3, 3.0)) for dof in dofs}
    springs = []
    for i, dof in enumerate(dofs):
        if i == 0 or rng.random() < 0.5:
            springs.append({"between": [dof, "ground"], "k": k * float(rng.uniform(0.3, 3.0))})
        if i > 0:
            springs.append({"between": [dof, dofs[i - 1]], "k": k * _log(rng, 0.03, 3.0)})
    pairs = [_ends(rng, dofs) for _ in range(rng.integers(1, 4))]
    forces = _forces(rng, dofs)
    return _assembled(rng, _lumped(rng, masses, springs), forces, pairs, str(rng.choice(dofs)), k)


def _close(rng: Rng) -> Tables:
    """Blades that are nearly equal and weakly coupled: modes close together, small where others are large."""
    dofs = [f"b{i}" for i in range(rng.integers(2, 6))]
    k, apart = _log(rng, 10.0, 1e6), _log(rng, 1e-5, 1e-1)
    springs = [{"between": [dof, "ground"], "k": k * (1.0 + apart * float(rng.normal()))} for dof in dofs]
    for i, dof in enumerate(dofs[1:]):
        springs.append({"between": [dof, dofs[i]], "k": k * _log(rng, 1e-5, 0.1)})
    masses = dict.fromkeys(dofs, 1.0)
    pairs = [_ends(rng, dofs) for _ in range(rng.integers(1, 3))]
    forces = _forces(rng, dofs)
    return _assembled(rng, _lumped(rng, masses, springs), forces, pairs, str(rng.choice(dofs)), k)


def _in_phase(rng: Rng) -> Tables:
    """Equal blades driven alike, contacts between equal parts, which do not move or hardly do."""
    blades, k = int(rng.integers(2, 4)), _log(rng, 10.0, 1e6)
    apart = 0.0 if rng.random() < 0.5 else _log(rng, 1e-6, 1e-2)
    root, ratio, tip = (
        float(rng.uniform(0.5, 3.0)),
        float(rng.uniform(0.3, 3.0)),
        float(rng.uniform(0.2, 1.0)),
    )
    masses: Tables = {}
    springs: list[Tables] = []
    for i in range(blades):
        masses |= {f"tip{i}": tip, f"root{i}": 1.0}
        springs.append({"between": [f"tip{i}", f"root{i}"], "k": k * ratio * (1.0 + apart * i)})
        springs.append({"between": [f"root{i}", "ground"], "k": k * root})
    structure = _lumped(rng, masses, springs)
    for spring in structure["springs"]:
        if "c" in spring:
            spring["c"] = structure["springs"][0]["c"]
    where, amplitude = str(rng.choice(["tip", "root"])), _log(rng, 0.1, 100.0)
    forces = [{"dof": f"{where}{i}", "amplitude": amplitude, "harmonic": 1} for i in range(blades)]
    if rng.random() < 0.3:
        forces[0] = {**forces[0], "amplitude": amplitude * (1.0 + _log(rng, 1e-5, 0.3))}
    pairs = [(f"tip{i}", f"tip{i + 1}") for i in range(blades - 1)]
    return _assembled(rng, structure, forces, pairs, str(rng.choice(list(masses))), k)


def _nodes(rng: Rng) -> Tables:
    """Modes with a given share at force, contacts and observed DOF: near nodes of some, within 1e-6."""
    modes, contacts = int(rng.integers(1, 7)), int(rng.integers(1, 4))
    dofs = ["drive", "seen", *(f"r{i}" for i in range(contacts))]
    omega = 2.0 * math.pi * _log(rng, 1.0, 1000.0) * np.cumsum(
        [1.0, *(_log(rng, 1e-5, 1.0) for _ in range(modes - 1))]
    )  # fmt: skip
    signs = rng.choice([-1.0, 1.0], size=(len(dofs), modes))
    shares = 10.0 ** np.where(
        rng.random((len(dofs), modes)) < 0.5, 0.0, rng.uniform(-6.0, 0.0, (len(dofs), modes))
    )
    shapes = signs * shares * rng.uniform(0.5, 1.5, (len(dofs), modes))
    ratios = [_log(rng, LEAST_DAMPING, MOST_DAMPING)] * modes
    if rng.random() < 0.5:
        ratios = [_log(rng, LEAST_DAMPING, MOST_DAMPING) for _ in range(modes)]
    structure = {
        "kind": "matrices",
        "modes": {"omega2": (omega**2).tolist(), "modes": shapes.tolist(), "damping_ratio": ratios},
        "dofs": {dof: i for i, dof in enumerate(dofs)},
    }
    pairs = [(f"r{i}", "ground") for i in range(contacts)]
    return _assembled(rng, structure, _forces(rng, ["drive"]), pairs, "seen", float(omega[0] ** 2))


def _sector(rng: Rng, sectors: int, k: float) -> Tables:
    """One sector of a disk: a blade's tip and the disk below it."""
    springs = [
        {"name": "blade", "between": ["tip", "disk"], "k": k},
        {"name": "foot", "between": ["disk", "ground"], "k": k * _log(rng, 1.0, 100.0)},
        {"name": "rim", "between": ["disk", "disk@next"], "k": k * _log(rng, 0.01, 100.0)},
    ]
    masses = {"tip": float(rng.uniform(0.2, 1.0)), "disk": float(rng.uniform(1.0, 5.0))}
    return {**_lumped(rng, masses, springs), "kind": "cyclic", "sectors": sectors}


def _disk(rng: Rng) -> Tables:
    """A tuned disk under a travelling wave: shrouds between tips, and contacts at the feet."""
    sectors, k = int(rng.integers(3, 25)), _log(rng, 1e3, 1e7)
    order = {"engine_order": int(rng.integers(0, sectors))}
    forces = _forces(rng, ["tip", "disk"], **order)
    all_pairs = [("tip", "tip@next"), ("tip", "ground"), ("disk", "ground"), ("tip", "disk")]
    picked = rng.choice(len(all_pairs), size=int(rng.integers(1, 3)), replace=False)
    pairs = [all_pairs[i] for i in picked]
    return _assembled(rng, _sector(rng, sectors, k), forces, pairs, str(rng.choice(["tip", "disk"])), k)


def _free_annulus(rng: Rng) -> Tables:
    """A mistuned disk without contacts: as many narrow resonances as it has sectors, and more."""
    sectors, k = int(rng.integers(3, 25)), _log(rng, 1e3, 1e7)
    structure = _sector(rng, sectors, k)
    spread = _log(rng, 1e-3, 0.1)
    structure["mistuning"] = {"of": ["blade"], "spread": spread, "seed": int(rng.integers(1, 1000))}
    forces = [{"dof": "tip", "amplitude": _log(rng, 0.1, 100.0), "harmonic": 1,
               "engine_order": int(rng.integers(0, sectors))}]  # fmt: skip
    observed = f"tip@{rng.integers(0, sectors)}"
    return _assembled(rng, structure, forces, [], observed, k)


def _mistuned(rng: Rng) -> Tables:
    """A few blades that differ by little, a contact at each of them."""
    sectors, k = int(rng.integers(3, 5)), _log(rng, 1e3, 1e7)
    structure = _sector(rng, sectors, k)
    structure["mistuning"] = {
        "of": ["blade"],
        "spread": _log(rng, 1e-5, 0.05),
        "seed": int(rng.integers(1, 1000)),
    }
    forces = [{"dof": "tip", "amplitude": _log(rng, 0.1, 100.0), "harmonic": 1,
               "engine_order": int(rng.integers(0, sectors))}]  # fmt: skip
    pair = ("tip", "tip@next") if rng.random() < 0.5 else ("disk", "ground")
    return _assembled(rng, structure, forces, [pair], f"tip@{rng.integers(0, sectors)}", k)


_DRAWN: dict[str, Callable[[Rng], Tables]] = {
    "chain": _chain,
    "close": _close,
    "in-phase": _in_phase,
    "nodes": _nodes,
    "disk": _disk,
    "free-annulus": _free_annulus,
    "mistuned": _mistuned,
}
KINDS = tuple(_DRAWN)
# Classes of the seeds 0 to 9, again and again.
_TURNS = (
    *("chain", "close", "in-phase", "nodes", "disk", "chain", "close", "nodes"),
    "free-annulus",
    "mistuned",
)


def _band(rng: Rng, scene: Scene) -> list[float]:
    """From below the lowest natural frequency to above the highest, with the contacts free or stuck."""
    model = linear_model(build(scene, harmonics=1).scene)
    K, _, L = matrices(model, 1)
    low = math.sqrt(max(float(eigvalsh(K, model.M)[0]), 0.0)) / (2.0 * math.pi)
    kt = np.zeros(L.shape[0])
    if rng.random() < 0.4:
        kt[:] = max((contact.kt for contact in scene.contacts), default=0.0)
    high = math.sqrt(float(eigvalsh(K + L.conj().T @ (kt[:, None] * L), model.M)[-1])) / (2.0 * math.pi)
    return [FAR_BELOW * low, FAR_ABOVE * high]
