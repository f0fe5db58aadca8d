"""Linear chains whose response is known to any number of digits, and random ones at nodes and resonances."""

import math
from dataclasses import dataclass
from typing import Any

import flint
import numpy as np

BITS = 400


@dataclass(frozen=True)
class Exact:
    """The structure of a lumped scene in ball arithmetic, from the numbers as they stand."""

    raw: dict[str, Any]

    def _matrices(self) -> tuple[Any, Any, Any, list[str]]:
        structure = self.raw["structure"]
        names = list(structure["masses"])
        K, C, M = (flint.arb_mat(len(names), len(names)) for _ in range(3))
        for i, name in enumerate(names):
            M[i, i] = flint.arb(structure["masses"][name])
        for spring in structure["springs"]:
            at = [names.index(end) for end in spring["between"] if end != "ground"]
            for i in at:
                for j in at:
                    sign = 1 if i == j else -1
                    K[i, j] += sign * flint.arb(spring["k"])
                    C[i, j] += sign * flint.arb(spring.get("c", 0.0))
        ratio = flint.arb(structure.get("stiffness_proportional_damping", 0.0))
        return K, C + ratio * K, M, names

    def amplitude(self, hertz: Any) -> Any:
        """The amplitude of the observed DOF at a frequency [Hz], a ball [m]."""
        before, flint.ctx.prec = flint.ctx.prec, BITS
        try:
            K, C, M, names = self._matrices()
            omega = 2 * flint.arb.pi() * flint.arb(hertz)
            Z = flint.acb_mat(K - M * omega * omega) + flint.acb_mat(C) * flint.acb(0, omega)
            force = flint.acb_mat(len(names), 1)
            force[names.index(self.raw["excitation"]["dof"]), 0] = flint.arb(
                self.raw["excitation"]["amplitude"]
            )
            return abs(Z.solve(force)[names.index(self.raw["observe"]["dof"]), 0])
        finally:
            flint.ctx.prec = before

    def peak(self, near_hz: float, half_width: float) -> float:
        """The highest amplitude within a few half widths [Hz] of a frequency, by thirds of the interval."""
        before, flint.ctx.prec = flint.ctx.prec, BITS
        try:
            low, high = (flint.arb(near_hz) + way * 8 * flint.arb(half_width) for way in (-1, 1))
            for _ in range(120):
                third = ((high - low) / 3).mid()
                left, right = (low + third).mid(), (high - third).mid()
                if self.amplitude(left) < self.amplitude(right):
                    low = left
                else:
                    high = right
            return float(self.amplitude(((low + high) / 2).mid()))
        finally:
            flint.ctx.prec = before


def chain(rng: np.random.Generator, damping: float) -> dict[str, Any]:
    """Two to six masses in a row, maybe far apart in size, without a contact."""
    dofs = [f"x{i}" for i in range(rng.integers(2, 7))]
    spread = float(rng.choice([0.3, 0.3, 1.0, 2.0]))
    k = (2.0 * math.pi) ** 2 * 10.0 ** rng.uniform(-spread, spread, len(dofs) + 1)
    springs = [{"between": [dofs[0], "ground"], "k": float(k[0])}]
    springs += [
        {"between": [a, b], "k": float(each)} for a, b, each in zip(dofs, dofs[1:], k[1:], strict=False)
    ]
    if rng.random() < 0.5:
        springs.append({"between": [dofs[-1], "ground"], "k": float(k[-1])})
    for spring in springs:
        spring["c"] = damping * spring["k"]
    masses = {dof: float(10.0 ** rng.uniform(-spread, spread)) for dof in dofs}
    return {
        "name": "chain",
        "structure": {"kind": "lumped", "masses": masses, "springs": springs},
        "excitation": {"dof": str(rng.choice(dofs)), "amplitude": float(10.0 ** rng.uniform(-2.0, 3.0))},
        "observe": {"dof": str(rng.choice(dofs)), "band": [0.05, 5.0]},
    }


def matrices(raw: dict[str, Any]) -> tuple[Any, Any]:
    """K and M, rounded."""
    K, _, M, names = Exact(raw)._matrices()
    size = range(len(names))
    return tuple(np.array([[float(X[i, j]) for j in size] for i in size]) for X in (K, M))


def natural_hz(raw: dict[str, Any]) -> Any:
    """The natural frequencies [Hz], rounded."""
    K, M = matrices(raw)
    scale = 1.0 / np.sqrt(np.diag(M))
    return np.sqrt(np.linalg.eigvalsh(scale[:, None] * K * scale)) / (2.0 * math.pi)


def node_case(seed: int) -> tuple[dict[str, Any], float]:
    """A chain and a frequency at which the observed mass hardly moves, or one beyond all modes."""
    rng = np.random.default_rng(54_000 + seed)
    raw = chain(rng, float(10.0 ** rng.uniform(-14.0, -3.0)))
    natural = natural_hz(raw)
    if rng.random() < 0.3:
        return raw, float(natural[-1] * 10.0 ** rng.uniform(0.3, 2.0))
    hertz = np.geomspace(0.3 * natural[0], 1.5 * natural[-1], 400)
    K, M = matrices(raw)
    names = list(raw["structure"]["masses"])
    o, f = (names.index(raw[key]["dof"]) for key in ("observe", "excitation"))

    def response(at: float) -> float:
        return float(np.linalg.inv(K - (2.0 * math.pi * at) ** 2 * M)[o, f])

    values = np.array([response(at) for at in hertz])
    sizes, turns = np.abs(values), np.flatnonzero(values[:-1] * values[1:] < 0.0)
    # A sign changes at resonances too: there the values beside are larger.
    turns = turns[(turns > 0) & (turns < hertz.size - 2)]
    turns = turns[sizes[turns] + sizes[turns + 1] < sizes[turns - 1] + sizes[turns + 2]]
    if not turns.size:
        return raw, float(rng.choice(hertz))
    i = int(rng.choice(turns))
    low, high = float(hertz[i]), float(hertz[i + 1])
    for _ in range(int(rng.integers(5, 60))):
        middle = 0.5 * (low + high)
        low, high = (middle, high) if response(middle) * response(low) > 0.0 else (low, middle)
    return raw, low
