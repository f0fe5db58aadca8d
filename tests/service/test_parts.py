"""Kinds whose work is divided: the parts, in any order and after a trip through JSON, give the same job."""

import copy
import json
import random
from collections.abc import Mapping
from dataclasses import replace
from typing import Any

import pytest

import solver
from service.jobs.job_parts import Account, Division, JobPart, PartOutput, PartStoppedError, final_one
from service.jobs.kind_registry import JobKind
from service.jobs.kinds import SHIPPED
from service.jobs.outputs import JobOutput

DISK: dict[str, Any] = dict(solver.load_scene("bladed-disk").to_dict())
DISK["structure"] = {**DISK["structure"], "sectors": 3}
SPECS: dict[str, dict[str, Any]] = {
    "map": {
        "scene": solver.load_scene("two-dof").to_dict(), "parameter": "damper.N0", "start": 60.0,
        "stop": 160.0, "steps": 9, "frequencies": 1500, "ridge": True, "harmonics": 3,
    },
    "mistuning": {
        "scene": DISK, "of": ["tip_middle", "tip"], "spread": 0.03, "samples": 5, "seed": 5, "dof": None,
        "start": 700.0, "stop": 850.0, "harmonics": 1,
    },
}  # fmt: skip


def parts_of(name: str) -> Division:
    parts = SHIPPED[name].parts
    assert parts is not None
    return parts


def silent(_share: float, _points: int) -> None:
    pass


def go_on() -> bool:
    return False


def same(one: Any, other: Any) -> bool:
    """Whether two results are equal but for the time they took."""
    if isinstance(one, dict):
        return one.keys() == other.keys() and all(same(one[k], other[k]) for k in one if k != "seconds")
    if isinstance(one, list | tuple):
        return len(one) == len(other) and all(map(same, one, other))
    return bool(one == other)


def same_output(one: JobOutput, other: JobOutput) -> bool:
    timeless = [[replace(record, seconds=0.0) for record in output.sweeps] for output in (one, other)]
    return same(one.result, other.result) and timeless[0] == timeless[1] and one.shortfall == other.shortfall


def through_json(output: PartOutput) -> PartOutput:
    return replace(output, result=json.loads(json.dumps(output.result, allow_nan=False)))


@pytest.fixture(scope="module", params=SPECS)
def divided(request: pytest.FixtureRequest) -> tuple[JobKind, dict[str, Any], JobOutput]:
    kind, spec = SHIPPED[request.param], SPECS[request.param]
    return kind, spec, kind.run(spec, silent, go_on)


def test_parts_in_any_order_and_through_json_give_the_same_job(
    divided: tuple[JobKind, dict[str, Any], JobOutput],
) -> None:
    kind, spec, whole = divided
    parts = parts_of(kind.name)
    plan = list(parts.split(spec))
    assert len(plan) > 2
    assert plan == list(parts.split(json.loads(json.dumps(spec))))
    order = list(range(len(plan)))
    random.Random(3).shuffle(order)
    outputs = {
        index: through_json(parts.run_part(spec, json.loads(json.dumps(plan[index].spec)), silent, go_on))
        for index in order
    }
    assert whole.sweeps
    assert all(array.array() is not None for output in outputs.values() for array in output.arrays.values())
    assert same_output(parts.joined(spec, outputs), whole)


def test_known_parts_are_not_computed_again(divided: tuple[JobKind, dict[str, Any], JobOutput]) -> None:
    kind, spec, whole = divided
    parts = parts_of(kind.name)
    kept: dict[int, PartOutput] = {}
    shares: list[float] = []
    parts.run(spec, lambda share, _points: shares.append(share), go_on, on_part=kept.__setitem__)
    assert len(kept) == len(parts.split(spec))
    assert shares == sorted(shares)
    assert shares[-1] == pytest.approx(1.0)
    again: list[int] = []
    missing = kept.pop(1)
    shares.clear()
    output = parts.run(
        spec, lambda share, _points: shares.append(share), go_on, kept, lambda index, _: again.append(index)
    )
    assert again == [1]
    assert shares[0] > 0.3
    assert missing.points >= 0
    assert same_output(output, whole)


def test_told_to_stop(divided: tuple[JobKind, dict[str, Any], JobOutput]) -> None:
    """At once, and in the middle of every part: there is no output, and nothing is kept of that part."""
    kind, spec, _ = divided
    parts = parts_of(kind.name)
    with pytest.raises(PartStoppedError):
        parts.run(spec, silent, lambda: True)
    for part in parts.split(spec)[:3]:
        answers = iter([False])
        with pytest.raises(PartStoppedError):
            parts.run_part(spec, part.spec, silent, lambda answers=answers: next(answers, True))


def test_a_study_without_a_response_ends_with_its_first_part() -> None:
    still = copy.deepcopy(SPECS["mistuning"])
    still["scene"]["excitation"]["amplitude"] = 0.0
    kept: dict[int, PartOutput] = {}
    output = parts_of("mistuning").run(still, silent, go_on, on_part=kept.__setitem__)
    assert list(kept) == [0]
    assert kept[0].final
    assert output.result["samples"] == []
    assert output.shortfall is not None
    assert "no peak to compare" in output.shortfall


def test_the_division_stays_reasonable_for_large_jobs() -> None:
    large = {**SPECS["mistuning"], "samples": 10_000, "harmonics": 31}
    plan = parts_of("mistuning").split(large)
    assert len(plan) <= 257
    assert sum(part.weight for part in plan[1:]) == 10_000
    rows = [part.spec["rows"] for part in parts_of("map").split({**SPECS["map"], "steps": 1000})[1:]]
    assert [0, *(last for _, last in rows)] == [*(first for first, _ in rows), 1000]


def test_progress_is_weighted_and_does_not_fall_back() -> None:
    told: list[tuple[float, int]] = []
    plan = [JobPart(spec={}, weight=3.0), JobPart(spec={}, weight=1.0)]
    account = Account(plan, {}, lambda share, points: told.append((share, points)))
    account.of(0)(0.5, 10)
    account.of(1)(1.0, 4)
    account.of(0)(0.2, 2)  # computed again
    account.done(0, PartOutput(result={}, points=20))
    assert told == [(0.375, 10), (0.625, 14), (0.625, 14), (1.0, 24)]


def test_a_final_part_stands_alone() -> None:
    seen: list[Mapping[int, PartOutput]] = []

    def join(_spec: Mapping[str, Any], outputs: Mapping[int, PartOutput]) -> JobOutput:
        seen.append(outputs)
        return JobOutput(result={})

    outputs = {index: PartOutput(result={}, final=index == 1) for index in (2, 1, 0)}
    Division(split=lambda _spec: [], run_part=lambda *_: outputs[0], join=join).joined({}, outputs)
    assert [list(each) for each in seen] == [[1]]
    assert final_one({0: outputs[0]}) == {}
