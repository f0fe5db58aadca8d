"""The return map of a marched motion."""

import math

import numpy as np

from solver import (
    Scene,
    annulus,
)
from solver.linear.assembly import linear_model
from solver.marching.kernels import taylor as kernel
from solver.marching.march import MarchStart, state_at
from solver.marching.march_equations import equations_of_motion
from solver.scene.scene import CyclicStructure


class Return:
    """The marched map of the state from one period to the next, around the motion that repeats."""

    def __init__(self, scene: Scene, frequency_hz: float, steps: int = 1024) -> None:
        whole = annulus(scene) if isinstance(scene.structure, CyclicStructure) else scene
        equations = equations_of_motion(whole, 2.0 * math.pi * frequency_hz)
        self.system = equations.system
        self.steps = steps
        self.orbit = state_at(equations, MarchStart(), (), 1.0)
        code, _ = self.march(self.orbit, 5000, 1e-13)
        assert code == kernel.SETTLED
        self.ports = linear_model(whole).contact_here
        self.sliders = np.flatnonzero(self.orbit.mode == kernel.STICK)

    def march(self, state: kernel.State, periods: int, tolerance: float = 0.0) -> tuple[int, int]:
        one, many = np.zeros(0), np.zeros((self.system.kt.size, 0))
        nothing = kernel.Record(one, one, many, many, many)
        return kernel.run_periods(self.system, state, self.steps, tolerance, 0, nothing, np.empty(periods))

    def state(self, move: np.ndarray) -> kernel.State:
        """The orbit's state moved by (x, v, places of the sliders that are held)."""
        n, kt, held = self.orbit.x.size, self.system.kt, self.sliders
        force = self.orbit.force.copy()
        force[held] += kt[held] * (self.ports[held] @ move[:n] - move[2 * n :])
        return kernel.State(
            self.orbit.x + move[:n], self.orbit.v + move[n : 2 * n], force, self.orbit.mode.copy(),
            self.orbit.own.copy(),
        )  # fmt: skip

    def places(self, state: kernel.State) -> np.ndarray:
        held = self.sliders
        sliders = self.ports[held] @ state.x - state.force[held] / self.system.kt[held]
        return np.concatenate([state.x, state.v, sliders])

    def jacobian(self) -> np.ndarray:
        size = 2 * self.orbit.x.size + self.sliders.size
        step = 1e-6 * max(np.abs(self.orbit.x).max(), np.abs(self.orbit.v).max())
        columns = []
        for i in range(size):
            ends = []
            for sign in (1.0, -1.0):
                state = self.state(sign * step * np.eye(size)[i])
                self.march(state, 1)
                ends.append(self.places(state))
            columns.append((ends[0] - ends[1]) / (2.0 * step))
        return np.array(columns).T
