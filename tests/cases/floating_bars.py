"""Bars of light masses that sliders alone hold, and what they do quasi-statically: an increment at a time."""

from __future__ import annotations

import itertools
import math
from dataclasses import dataclass

import numpy as np

from solver import Scene

EA, CAPACITY = 1e6, 1000.0  # N; friction of the whole bar, of length 1 m [N]
_STEPS = 400  # of a quarter of a period


@dataclass(frozen=True, slots=True, kw_only=True)
class Bar:
    """n pieces, pulled at the first end by F cos ωt."""

    n: int
    force: float
    stiffness_ratio: float
    mass: float
    frequency_hz: float

    @classmethod
    def of(cls, seed: int) -> Bar:
        """A random one, far from any resonance."""
        rng = np.random.default_rng(seed)
        return cls(
            n=int(rng.integers(2, 41)), force=float(rng.uniform(300.0, 900.0)),
            stiffness_ratio=float(10.0 ** rng.uniform(0.0, math.log10(200.0))),
            mass=float(10.0 ** rng.uniform(-6.0, -2.0)), frequency_hz=float(10.0 ** rng.uniform(-2.0, 2.0)),
        )  # fmt: skip

    @property
    def piece(self) -> float:
        """Stiffness of a piece [N/m]."""
        return EA * self.n

    @property
    def limits(self) -> np.ndarray:
        """What each slider carries [N]."""
        ends = np.isin(np.arange(self.n + 1), (0, self.n))
        return CAPACITY / self.n * np.where(ends, 0.5, 1.0)

    def scene(self, ground: float = 0.0) -> Scene:
        """The scene; `ground` is a spring at the far end [N/m]."""
        names = [f"u{i}" for i in range(self.n + 1)]
        springs = [{"between": [*pair], "k": self.piece} for pair in itertools.pairwise(names)]
        springs += [{"between": [names[-1], "ground"], "k": ground}] if ground else []
        return Scene.from_dict(
            {
                "name": "floating-bar",
                "structure": {
                    "kind": "lumped",
                    "masses": dict.fromkeys(names, self.mass),
                    "springs": springs,
                },
                "contacts": [
                    {"name": f"c{i}", "between": [name, "ground"], "kt": self.stiffness_ratio * self.piece,
                     "mu": 1.0, "N0": float(limit)}
                    for i, (name, limit) in enumerate(zip(names, self.limits, strict=True))
                ],
                "excitation": {"dof": "u0", "amplitude": self.force},
                "observe": {
                    "dof": "u0",
                    "band": [0.5 * self.frequency_hz, 2.0 * self.frequency_hz],
                },
            }
        )  # fmt: skip

    @property
    def inertia(self) -> float:
        """What inertia can change at most, relative to the motion: its forces over the bar's stiffness."""
        return self.mass * (self.n + 1) * (2.0 * math.pi * self.frequency_hz) ** 2 / EA

    def quasi_static(self) -> float:
        """Motion of the loaded end at the full force [m], pulled from rest by equal increments.

        Of proportional loading with no friction beyond Coulomb's that is the amplitude of the cycle (Masing's
        rule: every later branch is the first one doubled).
        """
        kt, limits = self.stiffness_ratio * self.piece, self.limits
        K = self.piece * (2.0 * np.eye(self.n + 1) - np.eye(self.n + 1, k=1) - np.eye(self.n + 1, k=-1))
        K[0, 0] = K[-1, -1] = self.piece
        u, load = np.zeros(self.n + 1), np.zeros(self.n + 1)
        for level in np.linspace(0.0, self.force, _STEPS + 1)[1:]:
            load[0] = level
            for _ in range(50):  # monotonic loading: the friction is min(kt u, limit)
                slips = kt * u > limits
                new = np.linalg.solve(
                    K + np.diag(np.where(slips, 0.0, kt)), load - np.where(slips, limits, 0)
                )
                if np.array_equal(kt * new > limits, slips):
                    break
                u = new
            u = new
        return float(u[0])
