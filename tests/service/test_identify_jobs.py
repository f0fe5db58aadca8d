"""The kind `identify`: what it refuses, with the pointer of the field; that data are tables, never files."""

from collections.abc import Mapping
from typing import Any

import pytest
from each import each
from service_helpers import Shipped

from service.cli.commands.client import submit
from service.cli.options.inputs import join_words
from service.errors import InvalidRequestError
from service.jobs.outputs import Silent
from service.jobs.strict_json import validated
from service.jobs.studies.identify_study import Identify
from service.jobs.study import resolve

BODY: Mapping[str, Any] = {
    "scene": "two-dof",
    "harmonics": 5,
    "starts": 1,
    "data": [{"frequency": [1.0, 1.1, 1.2, 1.4], "amplitude": [1.93, 2.12, 1.775, 1.245]}],
    "unknowns": {"damper.mu": [0.1, 0.6]},
}


def test_it_finds_what_the_data_say() -> None:
    spec = resolve(validated(Identify, dict(BODY)), Shipped()).spec
    output = Identify.run(spec, Silent(), lambda: False)
    assert output.shortfall is None
    assert output.result["values"]["damper.mu"] == pytest.approx(0.3, rel=0.02)
    assert Identify.draw(output.result, (), lambda _: None).axes  # type: ignore[arg-type, return-value]


@each(
    ("changes", "pointer"),
    [
        ({"data": [{"frequency": [1.0, 0.9, 1.2], "amplitude": [1, 1, 1]}]}, "/data/0"),
        ({"data": [{"frequency": [1.0, 1.1], "amplitude": [1.0, None]}]}, "/data/0/amplitude"),
        ({"data": ["rig.csv"]}, "/data"),
        ({"data": []}, "/data"),
        ({"unknowns": {"damper.nu": [0.1, 0.6]}}, "/unknowns/damper.nu"),
        ({"unknowns": {"damper.mu": [0.6, 0.1]}}, "/unknowns/damper.mu"),
        ({"priors": {"damper.mu": [0.3, 0.0]}}, "/priors/damper.mu"),
        ({"candidates": {"damper.mu": [0.3]}}, "/candidates/damper.mu"),
        ({"noise": 3.0}, "/noise"),
    ],
)
def test_what_is_wrong_has_its_pointer(changes: Mapping[str, Any], pointer: str) -> None:
    with pytest.raises(InvalidRequestError) as caught:
        resolve(validated(Identify, {**BODY, **changes}), Shipped())
    assert caught.value.issues[0].pointer.startswith(pointer)


def test_submit_takes_the_options_of_the_command(monkeypatch: pytest.MonkeyPatch) -> None:
    told: list[Mapping[str, Any]] = []
    monkeypatch.setattr(submit, "hand_in", lambda _url, body, **_: told.append(body))
    words = ["submit", "identify", "two-dof", "--data", '[{"frequency": [1.0], "amplitude": [2.0]}]']
    words += ["--unknown", "damper.mu", "0.1", "0.6", "--prior", "damper.mu", "0.3", "0.1"]
    words += ["--candidate", "damper.N0=50,80", "--scaling", "damper.mu=linear", "--robust"]
    command = submit.command_of(Identify.as_kind())
    command.main(args=join_words(words)[2:], standalone_mode=False)
    (body,) = told
    assert body["unknowns"] == {"damper.mu": [0.1, 0.6]}
    assert body["priors"] == {"damper.mu": [0.3, 0.1]}
    assert body["candidates"] == {"damper.N0": [50.0, 80.0]}
    assert body["scaling"] == {"damper.mu": "linear"}
    assert body["robust"] is True
