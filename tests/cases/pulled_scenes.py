"""Random scenes with a mean load on what contacts alone hold, near the most that friction can carry.

The limits are closed forms that no code of the solver computes: sums of μ times mean loads.
"""

import math
from typing import Any, NamedTuple

import numpy as np
from floating_bars import CAPACITY, Bar

from solver import Scene, load_scene

MEANS = 20_000  # instants of a period over which a load that opens is averaged


class Pulled(NamedTuple):
    """A scene and a frequency [Hz] at which it is solved."""

    scene: Scene
    frequency_hz: float


def pulled_bar(seed: int, share: float) -> Pulled:
    """A bar pulled along its axis by a share of all its friction, and a little to and fro."""
    drawn = Bar.of(seed)
    bar = Bar(
        n=min(drawn.n, 12), force=0.01 * CAPACITY, stiffness_ratio=drawn.stiffness_ratio, mass=drawn.mass,
        frequency_hz=drawn.frequency_hz,
    )  # fmt: skip
    raw = bar.scene().to_dict()
    rng = np.random.default_rng([seed, 13])
    pull = {"dof": f"u{rng.integers(bar.n + 1)}", "amplitude": share * CAPACITY, "harmonic": 0}
    scene = Scene.from_dict({**raw, "excitation": [{"dof": "u0", "amplitude": bar.force}, pull]})
    return Pulled(scene, bar.frequency_hz)


def pulled_mass(seed: int, share: float) -> Pulled:
    """A mass in a plane on sliders with a circular or a box limit, pulled some way, loads that may open."""
    rng = np.random.default_rng([seed, 14])
    angle, box = float(rng.uniform(0.0, 2.0 * math.pi)), bool(rng.integers(2))
    contacts: list[dict[str, Any]] = []
    limit = 0.0
    for i in range(int(rng.integers(1, 4))):
        N0, ratio, mu = float(10.0 ** rng.uniform(0.0, 3.0)), float(rng.choice([0.0, 0.5, 1.8])), 0.3
        tau = 2.0 * math.pi / MEANS * np.arange(MEANS)
        limit += mu * float(np.maximum(N0 * (1.0 + ratio * np.cos(tau)), 0.0).mean())
        contacts.append(
            {
                "name": f"c{i}", "law": "coulomb-3d", "between": ["x", "ground"],
                "between_second": ["y", "ground"], "kt": float(10.0 ** rng.uniform(5.0, 7.0)), "mu": mu,
                "N0": N0, "N1_ratio": ratio, "N1_phase": float(rng.uniform(-3.0, 3.0)),
                "limit": "box" if box else "circle",
            }
        )  # fmt: skip
    pull = share * limit
    if box:  # the larger share of the two directions is the limit
        pull /= max(abs(math.cos(angle)), abs(math.sin(angle)))
    means = {"x": pull * math.cos(angle), "y": pull * math.sin(angle)}
    scene = Scene.from_dict(
        {
            "name": f"pulled-mass-{seed}",
            "structure": {"kind": "lumped", "masses": {"x": 0.1, "y": 0.1}, "springs": []},
            "contacts": contacts,
            "excitation": [
                {"dof": "x", "amplitude": 1e-3 * limit},
                *({"dof": dof, "amplitude": size, "harmonic": 0} for dof, size in means.items()),
            ],
            "observe": {"dof": "x", "band": [1.0, 20.0]},
        }
    )
    return Pulled(scene, float(rng.uniform(1.0, 20.0)))


def pulled_wedge(newtons: float, amplitude: float = 60.0) -> Scene:
    """The shipped wedge under two platforms with a force along its axis, which friction alone holds."""
    raw = load_scene("platform-wedge").to_dict()
    forces = [{**each, "amplitude": amplitude} for each in raw["excitation"]]  # type: ignore[attr-defined]
    return Scene.from_dict(
        {**raw, "excitation": [*forces, {"dof": "wedge.z", "amplitude": newtons, "harmonic": 0}]}
    )


def pulled_body(seed: int) -> Pulled:
    """A shipped wedge or cylinder in space, pulled by a constant force.

    An even seed pulls the wedge along its axis by up to all its friction; an odd one scales mass and contacts
    of either by 0.3 to 3, shakes it by up to 25 times its force and pulls it any way.
    """
    rng = np.random.default_rng([seed, 15])
    if seed % 2 == 0:
        pull = wedge_limit(load_scene("platform-wedge")) * float(10.0 ** rng.uniform(-3.0, 0.0))
        return Pulled(pulled_wedge(pull, float(10.0 ** rng.uniform(0.5, 2.7))), float(rng.uniform(300, 420)))
    name = str(rng.choice(["wedge", "cylinder"]))
    raw: dict[str, Any] = load_scene(f"platform-{name}").to_dict()
    damper = raw["dampers"][0]
    damper |= {key: damper[key] * float(10.0 ** rng.uniform(-0.5, 0.5)) for key in ("kt", "kn", "mu", "mass")}
    shaken = float(10.0 ** rng.uniform(-1.3, 1.4))
    forces = [{**each, "amplitude": shaken * each["amplitude"]} for each in raw["excitation"]]
    way, pull = str(rng.choice(["x", "y", "z"])), float(10.0 ** rng.uniform(-1.0, 2.3))
    forces.append({"dof": f"{name}.{way}", "amplitude": pull, "harmonic": 0})
    scene = Scene.from_dict({**raw, "excitation": forces})
    return Pulled(scene, float(rng.uniform(*scene.observe.band)))


def wedge_limit(scene: Scene) -> float:
    """The largest axial force that both faces of a wedge can carry, pressed outward by its rotation [N].

    With T the friction inward along a face, R/2 = N cos α − T sin α; of T² + A² <= μ² N² the axial part A is
    largest at A = ½ R μ / √(cos² α − μ² sin² α).
    """
    wedge = scene.dampers[0]
    pressed = wedge.mass * wedge.radius_of_rotation * (2.0 * math.pi * scene.speed / 60.0) ** 2
    c, s, mu = math.cos(wedge.angle), math.sin(wedge.angle), wedge.mu
    return float(pressed * mu / math.sqrt(c * c - mu * mu * s * s))
