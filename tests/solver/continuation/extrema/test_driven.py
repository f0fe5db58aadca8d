"""What forces in contacts can drive between two points of a branch, against solutions at many places."""

import math
from itertools import pairwise
from typing import Any

import numpy as np
import pytest

from solver import Scene
from solver.balance.balance import build
from solver.balance.workspace import Workspace
from solver.contacts.kernels.system import MODES, POLES
from solver.continuation.extrema.branch_error import Way, may_exceed
from solver.jit.fourier import Complex, Real

PLACES = 401
HARMONIC = 1  # number of the harmonic that is looked at
FORM = {"classical damping": MODES, "one dashpot": POLES}


def _scene(damping: str) -> Scene:
    """A chain of eight masses with a contact on every other one; damping on each spring, or on one alone."""
    dofs = [f"m{i}" for i in range(8)]
    ends = [("ground", dofs[0]), *pairwise(dofs)]
    springs: list[dict[str, Any]] = [{"between": list(pair), "k": 1000.0} for pair in ends]
    for i, spring in enumerate(springs):
        spring["c"] = 1.0 if damping == "classical damping" else 6.0 * (i == 3)
    return Scene.from_dict(
        {
            "name": "chain",
            "structure": {"kind": "lumped", "masses": dict.fromkeys(dofs, 1.0), "springs": springs},
            "contacts": [
                {"name": dof, "between": [dof, "ground"], "kt": 400.0, "mu": 0.3, "N0": 50.0}
                for dof in dofs[::2]
            ],
            "excitation": {"dof": "m7", "amplitude": 10.0},
            "observe": {"dof": "m3", "band": [0.5, 12.0]},
        }
    )


def _driven(workspace: Workspace, way: Way, i: int) -> Real:
    """Return the observed motion at many places of a way, solved for at each."""
    found = []
    for t in np.linspace(0.0, 1.0, PLACES):
        at, g, F = ((1.0 - t) * each[i, 0] + t * each[i, 1] for each in (way.at, way.stiffness, way.forces))
        linear = workspace.receptance(float(at))
        A, B = linear.A[0, HARMONIC], linear.B[0, HARMONIC]
        found.append(abs(B @ np.linalg.solve(np.eye(len(A)) + g @ A, F)))
    return np.array(found)


def _ways(count: int, contacts: int, length: float) -> Way:
    """Return ways with springs between free and stuck, complex where they dissipate."""
    rng = np.random.default_rng([5, count])

    def springs() -> Complex:
        diagonal = rng.uniform(0.0, 400.0, (count, contacts)) * (1.0 + 0.2j * rng.uniform(size=(count, 1)))
        found: Complex = diagonal[:, :, None] * np.eye(contacts)
        return found

    begin = 2.0 * math.pi * rng.uniform(0.5, 11.0, count)
    left, forces = (
        springs(),
        rng.normal(size=(count, 2, contacts)) + 1j * rng.normal(size=(count, 2, contacts)),
    )
    return Way(
        numbers=np.full(count, HARMONIC), at=np.stack([begin, begin + length], axis=1),
        stiffness=np.stack([left, left + 0.02 * (springs() - left)], axis=1), forces=forces,
    )  # fmt: skip


@pytest.mark.few(2)
@pytest.mark.parametrize("damping", FORM)
def test_what_is_said_not_to_be_exceeded_is_not(damping: str) -> None:
    """Short ways and long ones, limits below and above the largest motion: never wrong, and often told."""
    workspace = Workspace.of(build(_scene(damping), harmonics=3))
    system = workspace.balance.system
    assert system.form == FORM[damping]
    told = []
    for length in (0.02, 0.2, 2.0):
        way = _ways(40, workspace.balance.n_ports, length)
        largest = np.array([_driven(workspace, way, i).max() for i in range(40)])
        assert may_exceed(system, way, 0.999 * largest).all()
        told.append(1.0 - np.mean(may_exceed(system, way, 3.0 * largest)))
    assert told[0] > 0.9
    assert told[0] >= told[1] >= told[2]


def test_a_way_alone_is_as_told_among_others() -> None:
    """Ways do not change each other, however many are looked at together."""
    workspace = Workspace.of(build(_scene("classical damping"), harmonics=3))
    way = _ways(40, workspace.balance.n_ports, 0.2)
    allowed = np.array([_driven(workspace, way, i).max() for i in range(40)]) * np.tile([0.9, 3.0], 20)
    together = may_exceed(workspace.balance.system, way, allowed)
    assert 0 < np.count_nonzero(together) < 40
    for i in range(40):
        one = slice(i, i + 1)
        alone = way.only(np.arange(40)[one])
        assert may_exceed(workspace.balance.system, alone, allowed[one])[0] == together[i]
