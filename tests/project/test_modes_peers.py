"""What other codes are given of a nonlinear mode, and what is said of those that are not there."""

import math

import numpy as np
import pytest
from scipy.linalg import eigvals

import solver
from benchmarks import modes_peers
from benchmarks.harness import WrongResultError
from benchmarks.modes_peers import Case, PeerCurve


@pytest.fixture(params=range(len(modes_peers.cases())), ids=["one-mass", "case-a", "beam"])
def case(request: pytest.FixtureRequest) -> Case:
    return modes_peers.cases()[request.param]


def test_the_task_has_the_structure_of_the_scene(case: Case) -> None:
    """With stuck sliders as springs its first pole is the beginning of our curve."""
    task = modes_peers._task(case)
    M, C, K = (np.array(task[name]) for name in "MCK")
    for dof in task["sliders"]:
        K[dof, dof] += task["kt"]
    n = len(M)
    none, one = np.zeros((n, n)), np.eye(n)
    poles = eigvals(np.block([[none, one], [-K, -C]]), np.block([[one, none], [none, M]]))
    first = min(poles[poles.imag > 0.0], key=abs)
    low = case.amplitudes[0]
    found = solver.nonlinear_mode(case.scene, 1, amplitudes=(low, 1.1 * low), harmonics=3, errors=False)
    assert 2.0 * math.pi * found.frequency_hz[0] == pytest.approx(abs(first), rel=1e-3)
    assert found.damping_ratio[0] == pytest.approx(-first.real / abs(first), rel=1e-2)
    assert task["omega"] == pytest.approx(abs(first), rel=1e-3)
    assert len(task["sliders"]) == len(case.scene.contacts)


def test_a_code_that_is_not_there_says_so(monkeypatch: pytest.MonkeyPatch) -> None:
    for name in (modes_peers.TMDSIMPY, modes_peers.TMDSIMPY_PYTHON, modes_peers.NLVIB):
        monkeypatch.delenv(name, raising=False)
    monkeypatch.setattr(modes_peers.importlib.util, "find_spec", lambda _: None)
    answers = dict(modes_peers._peers(modes_peers._task(modes_peers.cases()[0])))
    assert all("not installed" in str(answer) for answer in answers.values())
    assert set(answers) == {"tmdsimpy", "tmdsimpy, odd harmonics alone", "NLvib, Octave"}


def as_peer(case: Case, factor: float = 1.0) -> PeerCurve:
    """Our own curve in the place of another's, its frequencies by a factor wrong."""
    found = solver.nonlinear_mode(case.scene, 1, amplitudes=case.amplitudes, errors=False)
    return PeerCurve(
        seconds=1.0, cpu_seconds=1.0, amplitude=found.amplitude.tolist(),
        omega=(2.0 * math.pi * factor * found.frequency_hz).tolist(), zeta=found.damping_ratio.tolist(),
    )  # fmt: skip


def test_a_curve_is_compared_where_it_has_points() -> None:
    case = modes_peers.cases()[0]
    points, _, _, slower, omega, zeta = modes_peers._beside(case, as_peer(case), 0.01, 0.04)
    assert (int(points) > 10, slower) == (True, "100")
    assert max(float(omega), float(zeta)) < 1e-6
    with pytest.raises(WrongResultError, match="ω agrees"):
        modes_peers._beside(case, as_peer(case, 1.01), 0.01, 0.04)
