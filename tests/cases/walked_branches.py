"""Branches walked for several tests."""

from dataclasses import dataclass, replace
from itertools import islice

import numpy as np
from scene_cases import oscillator

from solver import BranchStatus, ContinuationSettings, Predictor, Scene
from solver.balance.balance import Balance, build
from solver.balance.workspace import Workspace
from solver.continuation.branches.sweep import Stretch, walk_branch


@dataclass(frozen=True, kw_only=True)
class Walked:
    """A branch of a balance that no scene describes."""

    status: BranchStatus | None
    values: np.ndarray
    solutions: np.ndarray
    measures: np.ndarray

    @property
    def turns(self) -> np.ndarray:
        """Parameter values at which the branch turns back."""
        return self.values[1:-1][np.diff(np.sign(np.diff(self.values))) != 0]


def with_damping(scene: Scene, path: str, damping: float, frequency_hz: float | None = None) -> Balance:
    """The balance of a scene whose modes are all given this damping, which may be negative."""
    balance = build(scene, path, harmonics=5, frequency_hz=frequency_hz)
    dampings = np.full_like(balance.system.dampings, damping)
    return replace(balance, system=balance.system._replace(dampings=dampings))


def walked(balance: Balance, start: float, stop: float, predictor: Predictor = Predictor.TANGENT) -> Walked:
    stretches: list[Stretch] = list(
        islice(walk_branch(Workspace.of(balance), start, stop, ContinuationSettings(predictor=predictor)), 20)
    )
    solutions = np.concatenate([stretch.solutions for stretch in stretches])
    return Walked(
        status=stretches[-1].status,
        values=balance.parameter.all_outside(solutions[:, -1].copy()),
        solutions=solutions,
        measures=np.concatenate([stretch.measures for stretch in stretches]),
    )


UNSTABLE = oscillator({"kt": 0.5, "mu": 0.3, "N0": 5.0}, k=1.0, c=0.05)
