"""Parts of a job on several workers of one machine; Dask's are in test_dask.py."""

from __future__ import annotations

import os
import pickle
import signal
import time
from collections.abc import Callable, Iterator, Sequence
from functools import partial
from typing import Any

import pytest
from private_kinds import PRIVATE
from service_helpers import PATIENCE, promptly, until, with_tables

import optim
import solver
from service.client.embedded import EmbeddedService
from service.db.models import JobState
from service.settings.settings import load_settings
from service.workers import spreading as spreading_module
from service.workers.spreading import BatchAnswer, Spreading, helped
from solver.results.spread import spreading

WORKERS = 2


@pytest.fixture(scope="module")
def embedded(tmp_path_factory: pytest.TempPathFactory) -> Iterator[EmbeddedService]:
    settings = load_settings(
        database=with_tables(tmp_path_factory.mktemp("spread")), workers=WORKERS, grace_seconds=2.0
    )
    with EmbeddedService(settings, PRIVATE) as service:
        until(lambda: service._service.queue.status().ready == WORKERS)
        yield service


def napped(service: EmbeddedService, job: str) -> dict[str, Any]:
    done = service.wait(job, timeout=PATIENCE)
    assert (done.status, done.attempt) == (JobState.SUCCESSFUL, 1), done
    return service.results(job).result


def idle(service: EmbeddedService) -> bool:
    return service._service.queue.status().busy == 0


def test_both_workers_compute_parts_and_lose_little_time(embedded: EmbeddedService) -> None:
    """Parts sleep, so that the time says what spreading costs, however many processors there are."""
    count, seconds = 40, 0.05

    def excess() -> float:
        begun = time.monotonic()
        result = napped(embedded, embedded.submit("naps", {"size": count, "seconds": seconds, "fresh": True}))
        assert result["square"] == [number**2 for number in range(count)]
        assert len(set(result["pid"])) == WORKERS
        # A worker has two batches at most, which may be those that end last.
        return (time.monotonic() - begun - count * seconds / WORKERS - 4 * seconds) * WORKERS / count

    promptly(excess, 0.015)


def test_a_helper_that_dies_costs_nothing_but_its_parts(embedded: EmbeddedService) -> None:
    warm = napped(embedded, embedded.submit("naps", {"size": 4, "seconds": 0.1, "fresh": True}))
    job = embedded.submit("naps", {"size": 20, "seconds": 0.15, "fresh": True})
    until(lambda: embedded.job(job).points > 2)
    slots = embedded._service.queue._executor._slots
    helper = next(slot for slot in slots if slot.busy and not slot.held)
    assert helper._child.process.pid in warm["pid"]
    os.kill(helper._child.process.pid, signal.SIGKILL)
    assert napped(embedded, job)["square"] == [number**2 for number in range(20)]
    until(lambda: embedded._service.queue.status().ready == WORKERS)


def test_another_job_waits_for_parts_and_not_for_the_whole(embedded: EmbeddedService) -> None:
    study = embedded.submit("naps", {"size": 500, "seconds": 0.1, "fresh": True})
    until(lambda: embedded.job(study).points > 3)
    small = embedded.wait(embedded.submit("iteration", {"fresh": True}), timeout=PATIENCE)
    assert (small.status, small.attempt) == (JobState.SUCCESSFUL, 1)
    assert embedded.job(study).status is JobState.RUNNING
    until(lambda: embedded._service.queue.status().busy == WORKERS, 10.0)
    assert embedded.dismiss(study).status is JobState.DISMISSED
    until(lambda: idle(embedded))
    assert embedded._service.queue.status().ready == WORKERS, "the helper heeded, it was not ended"


def test_a_helper_that_does_not_heed_is_ended(embedded: EmbeddedService) -> None:
    """A process that is frozen cannot answer: it is killed when the grace of the cancelled job is over."""
    job = embedded.submit("naps", {"size": 12, "seconds": 0.15, "fresh": True})
    until(lambda: embedded.job(job).points > 1)
    slots = embedded._service.queue._executor._slots
    helper = next(slot for slot in slots if slot.busy and not slot.held)
    process = helper._child.process.pid
    os.kill(process, signal.SIGSTOP)
    until(lambda: embedded.job(job).points >= 8)
    assert embedded.dismiss(job).status is JobState.DISMISSED
    until(lambda: helper._child is not None and helper._child.process.pid != process)
    until(lambda: idle(embedded) and embedded._service.queue.status().ready == WORKERS)


# What is sent and what is not ----------------------------------------------------------------------------


class Clock:
    """Time that passes by calls alone: what is sent does not depend on this machine."""

    def __init__(self) -> None:
        self.now = 0.0

    def perf_counter(self) -> float:
        return self.now


CLOCK = Clock()


@pytest.fixture
def clock(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(spreading_module, "time", CLOCK)


class Here:
    """Helpers that compute when they are asked; `lost` of them do not."""

    alone = True

    def __init__(self, lost: Sequence[int] = ()) -> None:
        self.sent: dict[int, bytes] = {}
        self.batches: list[int] = []
        self.recalled = False
        self._lost = lost

    def room(self) -> int:
        return 2 - len(self.sent)

    def share(self) -> int:
        return 2

    def send(self, number: int, data: bytes) -> None:
        self.sent[number] = data
        self.batches.append(len(pickle.loads(data)[1]))

    def answers(self, _seconds: float) -> list[BatchAnswer]:
        sent, self.sent = self.sent, {}
        return [
            BatchAnswer(number, None if number in self._lost else helped(data, lambda: False))
            for number, data in sent.items()
        ]

    def end(self, *, recall: bool) -> None:
        self.recalled = recall


def squared(seconds: float, value: int, *, should_stop: Callable[[], bool]) -> int:
    assert not should_stop()
    CLOCK.now += seconds
    return value**2


def spread(
    helpers: Here, count: int, seconds: float, *, final: int | None = None, function: Any = squared
) -> dict[int, int]:
    found: dict[int, int] = {}

    def done(index: int, value: int) -> bool:
        assert index not in found, "each once"
        found[index] = value
        return index == final

    calls = [(value,) for value in range(count)]
    Spreading(helpers, lambda: False)(partial(function, seconds), calls, done, should_stop=lambda: False)
    return found


@pytest.mark.usefixtures("clock")
def test_what_costs_more_than_it_gains_stays() -> None:
    helpers = Here()
    assert spread(helpers, 20, 0.0005) == {value: value**2 for value in range(20)}
    assert helpers.batches == []


@pytest.mark.usefixtures("clock")
def test_short_calls_go_in_batches_and_long_ones_alone() -> None:
    short, long = Here(), Here()
    assert spread(short, 200, 0.002) == {value: value**2 for value in range(200)}
    assert max(short.batches) > 10
    assert spread(long, 6, 0.25) == {value: value**2 for value in range(6)}
    assert set(long.batches) == {1}


@pytest.mark.usefixtures("clock")
def test_what_is_lost_and_what_has_no_name_is_computed_here() -> None:
    helpers, expected = Here(lost=(1, 2)), {value: value**2 for value in range(30)}
    assert spread(helpers, 30, 0.01) == expected
    assert len(helpers.batches) > 2
    nameless = Here()

    def of_a_user(seconds: float, value: int, *, should_stop: Callable[[], bool]) -> int:
        return squared(seconds, value, should_stop=should_stop)

    assert spread(nameless, 30, 0.01, function=of_a_user) == expected
    assert nameless.batches == []


@pytest.mark.usefixtures("clock")
def test_a_final_result_ends_the_rest() -> None:
    helpers = Here()
    found = spread(helpers, 500, 0.002, final=1)
    assert len(found) < 500
    assert 1 in found


# Searches that spread what they evaluate -----------------------------------------------------------------

TWO_DOF: dict[str, Any] = {"variables": {"damper.N0": [20, 500]}, "harmonics": 3}
SEARCHES: dict[str, Callable[[], Any]] = {
    "robust": lambda: optim.robust_design(
        solver.load_scene("two-dof"), **TWO_DOF, uncertain={"damper.kt": [0.9, 1.1]}
    ),
    "samples": lambda: optim.robust_design(
        solver.load_scene("two-dof"), **TWO_DOF, uncertain={"damper.kt": [0.9, 1.1]}, aim="mean", samples=8
    ),
    "several variables": lambda: optim.design(
        solver.load_scene("two-dof"), variables={"damper.N0": [20, 500], "damper.kt": [0.5, 2.0]},
        harmonics=3, method="minimax",
    ),
    "front": lambda: optim.pareto_front(solver.load_scene("two-dof"), **TWO_DOF, points=3),
}  # fmt: skip


class Elsewhere(Here):
    """All calls but the first go through pickle to another place."""

    alone = False


def timeless(value: Any) -> Any:
    if isinstance(value, dict):
        return {key: timeless(one) for key, one in value.items() if key != "seconds"}
    return [timeless(one) for one in value] if isinstance(value, list | tuple) else value


@pytest.mark.few(keep=("samples", "several variables"))
@pytest.mark.parametrize("name", SEARCHES)
def test_a_search_finds_the_same_wherever_designs_are_evaluated(
    name: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(spreading_module, "_WORTH_SECONDS", 0.0)
    alone, helpers = SEARCHES[name](), Elsewhere()
    with spreading(Spreading(helpers, lambda: False)):
        spread_out = SEARCHES[name]()
    assert sum(helpers.batches) > 3
    assert timeless(spread_out.to_json()) == timeless(alone.to_json())
