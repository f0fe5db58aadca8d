"""The options that `submit` makes of keys of every shape, and the body that comes of them."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Annotated, Any, Literal

import pytest
from pydantic import Field

from optim.problem.problem_keys import of_front
from service.cli.commands.client import submit
from service.errors import InputError
from service.jobs.common.problem_requests import Pair, ProblemRequest, Ranges
from service.jobs.common.scene_requests import Number, SceneRequest
from service.jobs.kind_registry import JobKind, JobRequest, KindView
from service.jobs.kinds import SHIPPED


class ShapesRequest(SceneRequest):
    """A key of every shape."""

    number: float = 1.5
    count: int | None = None
    word: Literal["up", "down"] = "up"
    words: list[str] = Field(default=[])
    numbers: list[float] = Field(default=[])
    pair: Pair | None = None
    ranges: Ranges | None = None
    table: dict[str, Number] | None = None
    nested: list[dict[str, Any]] | None = None
    off: bool = False
    on: bool = True
    no_echo: bool = False
    url: str | None = None
    renamed: Annotated[int, Field(description="Called otherwise.")] = 0


class Unsaid(JobRequest):
    """A kind without a scene."""


class Decided(JobRequest):
    """A key that must be yes or no."""

    really: bool


class _Further(ProblemRequest):
    """A design problem with a key of its own."""

    tries: int = 3


Further = of_front(_Further)


def kind(request: type[JobRequest], **view: Any) -> JobKind:
    def never(*_: object) -> Any:
        raise AssertionError("nothing is computed here")

    return JobKind(
        name="shapes", summary="Shapes.", request=request, resolve=never, run=never, view=KindView(**view)
    )


@pytest.fixture
def told(monkeypatch: pytest.MonkeyPatch) -> list[Mapping[str, Any]]:
    """The bodies that would be handed in."""
    found: list[Mapping[str, Any]] = []
    monkeypatch.setattr(submit, "hand_in", lambda _url, body, **_: found.append(body))
    return found


def run(one: JobKind, *words: str) -> Any:
    return submit.command_of(one).main(list(words), standalone_mode=False)


@pytest.mark.parametrize(
    ("words", "keys"),
    [
        ([], {}),
        (["--number", "2"], {"number": 2.0}),
        (["--number", "1.5"], {}),
        (["--count", "7"], {"count": 7}),
        (["--word", "down"], {"word": "down"}),
        (["--words", "a", "--words", "b"], {"words": ["a", "b"]}),
        (["--numbers", "1", "--numbers", "-2.5"], {"numbers": [1.0, -2.5]}),
        (["--pair", "1", "2"], {"pair": [1.0, 2.0]}),
        (["--ranges", "[[1, 2], [3, 4]]"], {"ranges": [[1, 2], [3, 4]]}),
        (["--table", "a=1", "--table", "b=2"], {"table": {"a": 1.0, "b": 2.0}}),
        (["--nested", '[{"a": 1}]'], {"nested": [{"a": 1}]}),
        (["--off"], {"off": True}),
        (["--no-on"], {"on": False}),
        (["--no-echo"], {"no_echo": True}),
        (["--url-key", "x"], {"url": "x"}),
        (["--other", "4"], {"renamed": 4}),
        (["--set", "damper.N0=80"], {"set": {"damper.N0": 80.0}}),
        (["--fresh", "--priority", "5"], {"fresh": True, "priority": 5}),
        (["--max-seconds", "9"], {"max_seconds": 9.0}),
    ],
)  # fmt: skip
def test_an_option_becomes_its_key(
    told: list[Mapping[str, Any]], words: list[str], keys: dict[str, Any]
) -> None:
    run(kind(ShapesRequest, flags={"renamed": "--other"}), "two-dof", *words)
    assert told == [{"kind": "shapes", "scene": "two-dof", **keys}]
    ShapesRequest.model_validate({key: value for key, value in told[0].items() if key != "kind"})


@pytest.mark.parametrize(
    ("words", "said"),
    [
        (["--number", "nan"], "`--number` must be a finite number, got nan"),
        (["--numbers", "1", "--numbers", "inf"], "`--numbers` must be a finite number, got inf"),
        (["--pair", "1", "inf"], "`--pair` must be a finite number, got inf"),
        (["--nested", "[{"], "`--nested` takes JSON, got '[{'"),
        (["--table", "a"], "takes PATH=VALUE"),
    ],
)
def test_what_cannot_be_read_names_its_option(words: list[str], said: str) -> None:
    with pytest.raises(InputError) as refused:
        run(kind(ShapesRequest), "two-dof", *words)
    assert said in str(refused.value)


def test_a_kind_without_a_scene_takes_none(told: list[Mapping[str, Any]]) -> None:
    run(kind(Unsaid), "--priority", "1")
    assert told == [{"kind": "shapes", "priority": 1}]


@pytest.mark.parametrize(("word", "value"), [("--really", True), ("--no-really", False)])
def test_a_yes_or_no_that_is_needed_is_given(told: list[Mapping[str, Any]], word: str, value: bool) -> None:
    run(kind(Decided), word)
    assert told == [{"kind": "shapes", "really": value}]


def test_a_problem_of_another_kind_has_the_options_of_problems(told: list[Mapping[str, Any]]) -> None:
    words = ("two-dof", "--variable", "damper.N0 20 300", "--limit", "2", "--tries", "5")
    run(kind(Further), *words)
    body = {"variables": {"damper.N0": [20.0, 300.0]}, "limit": 2.0, "tries": 5}
    assert told == [{"kind": "shapes", "scene": "two-dof", **body}]
    flags = submit.options_of(submit.submission(kind(Further), None))
    assert "--max-peak" in flags
    assert {"--basins", "--max-band"}.isdisjoint(flags), "keys of `design` alone"


def test_options_of_the_local_command_keep_their_words() -> None:
    """Every option of `stickslip KIND` that stands for a key is one of `stickslip submit KIND`."""
    own = {"plot", "out", "as_json", "accuracy", "effects", "report", "uncertain", "column", "without"}
    for one in SHIPPED:
        local = submit.TOP[one.name].function()
        known = {flag: param for flag, param in submit.options_of(local).items() if param.name not in own}
        made = submit.options_of(submit.submission(one, local))
        assert {flag: made[flag].annotation for flag in known} == {
            flag: param.annotation for flag, param in known.items()
        }
