"""Known errors reach the user: every result made of responses says how well its numbers are known."""

import json
import math
import re
from collections.abc import Callable
from dataclasses import fields, is_dataclass
from itertools import pairwise
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from every_module import every_module

import optim
import solver
import stickslip.lab
from optim.results.design_result import DesignStatus
from optim.views.tables.design import robust
from service.cli import main
from service.rendering.text import print_told
from solver.results.base import MadeOfResponses, Shown
from solver.results.known import Known, worst_of
from solver.results.order_statistics import enough, interval, needed

DATA = Path(__file__).parents[1] / "data"
TWO = solver.load_scene("two-dof")
DISK = solver.load_scene("bladed-disk")
N0 = {"damper.N0": (60.0, 150.0)}
OVER = ("damper.N0", 60.0, 90.0)
KEYS = {"measure", "error_estimate", "relative_error", "flags", "peaks_open"}
OWN_WORDS = {"Branch", "AccuracyStudy"}
"""A branch has the errors itself; a study of accuracy is about nothing else, beside a reference."""


def _classes() -> list[type[Any]]:
    """Every dataclass of the solver and of designs, wherever it stands."""
    assert list(every_module(solver, optim, stickslip.lab))
    found, ahead = set[type[Any]](), [Shown]
    while ahead:
        one = ahead.pop()
        found |= {one} if is_dataclass(one) else set()
        ahead += one.__subclasses__()
    return sorted(found, key=lambda one: one.__name__)


HOLDS = {"Branch", "DesignEvaluation", "OrderResponse", "BladePeaks", "MistunedDisk", "PeakTrack",
         "LeastPeak", "Side", "ParetoPoint", "DesignResult"}  # fmt: skip


def test_no_result_made_of_branches_forgets_their_errors() -> None:
    """By their annotations: a new study that holds a branch, or what is made of some, must pass them on."""
    made = []
    for one in _classes():
        words = {word for each in fields(one) for word in re.findall(r"\w+", str(each.type))}
        if words & HOLDS and one.__name__ not in OWN_WORDS:
            made.append(one.__name__)
            assert issubclass(one, MadeOfResponses), f"{one.__name__} holds {words & HOLDS}"
    assert {
        "CampbellDiagram",
        "MistuningStudy",
        "PeakTrack",
        "ResponseMap",
        "SensitivityResult",
        "DesignResult",
        "RobustResult",
        "ParetoResult",
        "LeastPeak",
        "BladePeaks",
    } <= set(made)


STUDIES: dict[str, Callable[[], Any]] = {
    "track": lambda: solver.track_peak(TWO, *OVER, harmonics=3, checks=0),
    "least": lambda: solver.least_peak(TWO, *OVER, harmonics=3),
    "map": lambda: solver.response_map(TWO, *OVER, steps=2, frequencies=5, harmonics=3, ridge=False),
    "blades": lambda: solver.blade_peaks(DISK, 740.0, 780.0, harmonics=1),
    "mistuning": lambda: solver.mistuning_study(
        DISK, of="tip", samples=2, start=740.0, stop=780.0, harmonics=1
    ),
    "campbell": lambda: optim.campbell_diagram(TWO, speeds_rpm=[60.0, 100.0], harmonics=3),
    "sensitivities": lambda: optim.sensitivities(TWO, harmonics=3),
    "design": lambda: optim.design(TWO, variables=N0, harmonics=3),
    "robust": lambda: optim.robust_design(
        TWO, variables=N0, uncertain={"damper.mu": [0.29, 0.31]}, samples=3, harmonics=3
    ),
    "front": lambda: optim.pareto_front(TWO, variables=N0, points=3, limit=2.0, harmonics=3),
}  # fmt: skip


@pytest.mark.few(3)
@pytest.mark.parametrize("name", STUDIES)
def test_every_form_of_a_result_tells_its_error(name: str) -> None:
    found = STUDIES[name]()
    answer = json.loads(json.dumps(found.to_json()))
    assert set(answer) >= KEYS
    assert answer["error_estimate"] > 0.0
    assert answer["relative_error"] == pytest.approx(found.known.error / found.known.value)
    assert "estimated error" in repr(found)
    assert found.to_dataset().attributes["error_estimate"] == found.known.error_estimate
    if name == "design":
        assert found.known.error_estimate == found.evaluation.branch.error_estimate


def test_what_is_least_known_stands_for_all_with_every_flag() -> None:
    good = Known(peak_max_abs=2.0, error_estimate=0.1, flags=("a",))
    bad = Known(peak_max_abs=1.0, error_estimate=0.2, flags=("b", "a"), peaks_open=("why",))
    unknown = Known(peak_max_abs=5.0)
    assert worst_of([good, bad]).relative == 0.2
    assert worst_of([good, bad]).flags == ("a", "b")
    assert worst_of([bad, good]).peaks_open == ("why",)
    assert worst_of([good, unknown, bad]).to_json()["relative_error"] is None
    assert worst_of([]).pairs() == [("estimated error", "not known")]
    assert Known.from_json(json.loads(json.dumps(bad.to_json()))) == bad


def test_a_running_speed_is_clear_only_beyond_the_error() -> None:
    """11 harmonics give 8.273 mm of a limit of 9 mm; a march from rest settles at 9.1726 mm."""
    scene = solver.load_scene(DATA / "campbell_harmonics.toml")

    def clear(limit: float, harmonics: int = 11) -> tuple[bool | None, Any]:
        found = optim.campbell_diagram(
            scene, speeds_rpm=[33.0, 40.0], orders=[1], limit=limit, band_hz=[0.53, 0.68], harmonics=harmonics
        )  # fmt: skip
        return found.clear, found.orders[0].highest_running

    said, highest = clear(9e-3)
    assert said is None
    assert abs(9.1726e-3 - highest.amplitude) <= highest.error_estimate
    assert clear(highest.amplitude + 0.99 * highest.error_estimate)[0] is None
    assert clear(highest.amplitude + 1.01 * highest.error_estimate)[0] is True
    assert clear(9e-3, harmonics=61)[0] is False


def test_a_few_disks_tell_no_quantile_that_needs_many(capsys: pytest.CaptureFixture[str]) -> None:
    """Three disks with one harmonic: 2.936; with 41 harmonics it is 3.08."""
    args = ["--of", "air", "--spread", "0.0714", "--samples", "3", "--seed", "304", "--harmonics", "1"]
    assert main(["mistuning", str(DATA / "mistuning304.toml"), *args, "--json"]) == 0
    found = json.loads(capsys.readouterr().out)
    assert abs(found["mean"] - 3.08) <= found["mean_error"]
    by_share = {one["share"]: one for one in found["quantiles"]}
    for share in (0.05, 0.95, 0.99):
        assert by_share[share]["magnification"] is None
    assert by_share[0.99]["interval"][1] is None
    assert found["standard_error"] == pytest.approx(found["deviation"] / 3**0.5)
    assert "mean_undetermined" in found["flags"]
    assert main(["mistuning", str(DATA / "mistuning304.toml"), *args]) == 0
    told = capsys.readouterr().out
    assert "at least 100 disks are needed" in told
    assert "deviation of the disks" in told
    assert "estimated error" in told


@pytest.mark.parametrize(("share", "count"), [(0.5, 8), (0.95, 100), (0.05, 40), (0.99, 30)])
def test_the_interval_of_a_quantile_holds_it(share: float, count: int) -> None:
    """Drawn again and again from a distribution whose quantile is known: −log(1 − q)."""
    rng, true = np.random.default_rng(7), -np.log(1.0 - share)
    held = 0
    for _ in range(1000):
        low, high = interval(rng.exponential(size=count).tolist(), share)
        held += not low > true and not high < true
    assert held >= 0.95 * 1000 - 2.0 * (0.05 * 0.95 * 1000) ** 0.5


def test_how_many_samples_a_quantile_needs() -> None:
    assert (needed(0.99), needed(0.95), needed(0.5), needed(0.05)) == (100, 20, 2, 20)
    assert enough(100, 0.99)
    assert not enough(99, 0.99)
    assert np.isnan(interval([3.0, 1.0, 2.0], 0.99)[1])
    widths = [np.ptp(interval(np.linspace(0.0, 1.0, n).tolist(), 0.5)) for n in (10, 100, 1000)]
    assert all(small > large for small, large in pairwise(widths))


def test_quantiles_of_a_robust_design_come_with_their_confidence(capsys: pytest.CaptureFixture[str]) -> None:
    found = optim.robust_design(
        TWO, variables=N0, uncertain={"damper.mu": [0.25, 0.35]}, aim="quantile", quantile=0.75, samples=8,
        harmonics=3,
    )  # fmt: skip
    assert found.robust is not None
    samples = found.robust.to_json(0.75)["samples"]
    by_share = {one["share"]: one for one in samples["quantiles"]}  # type: ignore[index]
    assert by_share[0.95]["peak"] is None
    low, high = by_share[0.75]["interval"]
    assert high is None or low <= by_share[0.75]["peak"] <= high
    assert by_share[0.75]["confidence"] == 0.95
    print_told(robust(found.to_json()))
    told = capsys.readouterr().out
    assert "at least 20 samples are needed" in " ".join(told.split())


@pytest.mark.few(2)
@pytest.mark.parametrize("harmonics", [1, 3])
def test_harmonics_rise_until_the_peak_of_a_design_is_known(harmonics: int) -> None:
    """Three leave the peak of the disk open by more than its size: harmonics 3 and 5 meet its resonances."""
    found = optim.design(DISK, variables={"shroud.N0": (20.0, 3000.0)}, harmonics=harmonics)
    assert found.status is DesignStatus.OPTIMAL
    assert found.problem.harmonics > harmonics
    assert found.to_json()["n_harmonics"] == found.problem.harmonics
    assert found.known.relative <= 0.05
    assert found.peak is not None
    here = DISK.with_values(dict(found.optimum))
    marched = solver.march(here, frequency_hz=found.peak.at)
    assert marched.max_abs == pytest.approx(found.peak.value, rel=0.05)


@pytest.mark.long
def test_a_wedge_whose_peak_is_not_known_is_not_called_the_best() -> None:
    """Its mean is free, and with three harmonics the resonance of the light wedge on its faces is open."""
    wedge = solver.load_scene("platform-wedge")
    found = optim.design(wedge, variables={"wedge.mass": (0.004, 0.007)}, harmonics=3)
    assert found.known.relative <= 0.05 or not found.reached
    answer = found.to_json()
    assert answer["measure"] == "half_peak_to_peak"
    assert "mean_undetermined" in answer["flags"]


@pytest.mark.parametrize(
    ("error", "peak", "words"),
    [
        (1e-6, 1e-3, ["1 µm of max|x|, 0.1 %"]),
        (5.9e-15, 0.0, ["not known"]),  # of no peak
        (math.nan, 1e-3, ["not known"]),
        (0.0, 1e-3, ["0 m of max|x|, 0 %"]),
    ],
)
def test_an_error_is_told_once(error: float, peak: float, words: list[str]) -> None:
    known = Known(peak_max_abs=peak, error_estimate=error)
    assert [value for name, value in known.pairs() if name == "estimated error"] == words
