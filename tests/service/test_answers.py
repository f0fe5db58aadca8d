"""Computations for answers: limits of time and memory, turns of owners, budgets."""

from __future__ import annotations

import asyncio
import itertools
import os
import time
from collections.abc import Iterator
from typing import Any

import numpy as np
import pytest
from service_helpers import until

from service.auth.allowances import Buckets
from service.errors import InvalidRequestError, QueueFullError, TooManyRequestsError
from service.jobs.answering import Answering, Words
from service.jobs.kind_registry import SceneSource, no_warm_up
from service.settings.settings import Settings
from service.workers.warm_pool import Answers

LIMITS = Settings(
    answer_workers=2, answer_seconds=0.5, answer_memory_bytes=64 * 1024**2, answer_budget_seconds=1000
)


def turn(words: Words, _source: SceneSource) -> dict[str, Any]:
    """Wait without computing."""
    begin = time.monotonic()
    time.sleep(words["seconds"])
    return {"from": begin, "to": time.monotonic(), "pid": os.getpid()}


def compute(_words: Words, _source: SceneSource) -> int:
    count = 0
    while True:
        count += 1


def allocate(words: Words, _source: SceneSource) -> int:
    return int(np.ones((words["megabytes"], 1024**2), np.uint8).size)


def look_up(_words: Words, source: SceneSource) -> Any:
    return source.scene_body("mine")


def keep(words: Words, _source: SceneSource) -> int:
    """Make a matrix that the solver keeps for later."""
    from solver.linear import assembly

    return int(assembly._nothing(words["size"]).nbytes)


def mistaken(_words: Words, _source: SceneSource) -> Any:
    raise ZeroDivisionError("a mistake in the program")


RUNS = {task.__name__: Answering(task) for task in (turn, compute, allocate, keep, look_up, mistaken)}


def spec(**words: object) -> dict[str, Any]:
    return {"words": words, "scenes": {}, "uploads": {}}


@pytest.fixture(scope="module")
def answers() -> Iterator[Answers]:
    made = Answers(RUNS, no_warm_up, LIMITS)
    asyncio.run(made.ask("turn", spec(seconds=0.0)))
    yield made
    made.close()


def together(answers: Answers, *asked: tuple[str, dict[str, Any], str]) -> list[Any]:
    async def ask() -> list[Any]:
        tasks = [answers.ask(task, spec(**words), owner) for task, words, owner in asked]
        return await asyncio.gather(*tasks, return_exceptions=True)

    return asyncio.run(ask())


def test_what_takes_too_much_processor_time_is_ended_and_refused(answers: Answers) -> None:
    slow, quick = together(answers, ("compute", {}, "eve"), ("turn", {"seconds": 0.0}, "ann"))
    assert isinstance(slow, InvalidRequestError)
    assert slow.issues[0].pointer == "/scene"
    assert "0.5 s of processor time" in slow.issues[0].said()
    assert quick["found"]["pid"]


def test_waiting_costs_no_processor_time(answers: Answers) -> None:
    (found,) = together(answers, ("turn", {"seconds": 1.0}, "eve"))
    assert found["seconds"] < 0.5


def test_what_takes_too_much_memory_is_refused_and_the_next_goes_on(answers: Answers) -> None:
    large, small = together(
        answers, ("allocate", {"megabytes": 200}, "eve"), ("allocate", {"megabytes": 20}, "eve")
    )
    assert isinstance(large, InvalidRequestError)
    assert "67 MB of memory" in large.issues[0].said()
    assert small["found"] == 20 * 1024**2


def test_matrices_that_are_kept_make_room_for_others(answers: Answers) -> None:
    """Sixteen of them would take twice the memory there is."""
    found = together(answers, *[("keep", {"size": 1000 + n}, "eve") for n in range(20)])
    assert [one["found"] for one in found] == [8 * (1000 + n) ** 2 for n in range(20)]


def test_one_owner_leaves_a_process_for_another(answers: Answers) -> None:
    until(lambda: answers.ready == LIMITS.answer_workers)
    mine = [("turn", {"seconds": 0.3}, "eve")] * 3
    *first, other = [one["found"] for one in together(answers, *mine, ("turn", {"seconds": 0.0}, "ann"))]
    first.sort(key=lambda one: one["from"])
    for before, after in itertools.pairwise(first):
        assert after["from"] >= before["to"], "those of one owner take turns"
    assert other["to"] < first[0]["to"]


def test_who_ended_a_process_waits_until_there_is_another(answers: Answers) -> None:
    """Else one who does nothing else would end both, in turn."""
    until(lambda: answers.ready == LIMITS.answer_workers)

    async def ask() -> tuple[Any, bool]:
        with pytest.raises(InvalidRequestError):
            await answers.ask("compute", spec(), "eve")
        again = asyncio.ensure_future(answers.ask("compute", spec(), "eve"))
        await asyncio.sleep(0.05)
        other = await answers.ask("turn", spec(seconds=0.0), "ann")
        waited = not again.done()
        with pytest.raises(InvalidRequestError):
            await again
        return other, waited

    other, waited = asyncio.run(ask())
    assert other["found"]["pid"]
    assert waited


def test_a_budget_that_is_used_up_fills_again() -> None:
    now = [0.0]
    buckets = Buckets(steady=lambda: now[0])
    buckets.spend("eve", 60, 61.5)
    assert buckets.empty("eve", 60) == pytest.approx(1.5)
    assert buckets.empty("ann", 60) == 0.0
    now[0] = 2.0
    assert buckets.empty("eve", 60) == 0.0


@pytest.mark.long
def test_who_has_used_up_the_budget_is_told_when_to_ask_again() -> None:
    poor = Answers(
        RUNS,
        no_warm_up,
        Settings(answer_workers=1, answer_seconds=1.5, answer_memory_bytes=2**26, answer_budget_seconds=1),
    )
    try:
        first, second, other = [
            together(poor, (task, {"seconds": 0.0}, owner))[0]
            for task, owner in (("compute", "eve"), ("turn", "eve"), ("turn", "ann"))
        ]
    finally:
        poor.close()
    assert isinstance(first, InvalidRequestError)
    assert isinstance(second, TooManyRequestsError)
    assert 1 <= second.retry_after <= 60
    assert other["found"]["pid"]


def test_what_a_task_needs_is_said(answers: Answers) -> None:
    (found,) = together(answers, ("look_up", {}, ""))
    assert found["needs"] == {"scene": "mine"}


def test_a_mistake_of_the_program_is_an_error_of_the_program(answers: Answers) -> None:
    mistake, after = together(answers, ("mistaken", {}, ""), ("turn", {"seconds": 0.0}, ""))
    assert isinstance(mistake, RuntimeError)
    assert after["found"]["pid"]


def test_closing_tells_those_who_wait_and_ends_what_computes() -> None:
    closing = Answers(RUNS, no_warm_up, LIMITS)
    asyncio.run(closing.ask("turn", spec(seconds=0.0)))

    async def ask() -> list[Any]:
        tasks = [asyncio.ensure_future(closing.ask("turn", spec(seconds=60.0), "eve")) for _ in range(3)]
        await asyncio.sleep(0.2)
        begin = time.monotonic()
        await asyncio.to_thread(closing.close)
        assert time.monotonic() - begin < 10.0
        return await asyncio.gather(*tasks, return_exceptions=True)

    assert all(isinstance(one, QueueFullError) for one in asyncio.run(ask()))
    assert isinstance(together(closing, ("turn", {"seconds": 0.0}, ""))[0], QueueFullError)
