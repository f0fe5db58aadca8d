"""The list of scenes comes in pages, and no scene is read for it."""

from collections.abc import Iterator
from pathlib import Path

import pytest
from service_helpers import ServedClient, is_problem, serving
from sqlalchemy import event

import solver
from service.jobs.kinds import SHIPPED

NAMES = [f"mine-{number}" for number in range(5)]


@pytest.fixture(scope="module")
def service(tmp_path_factory: pytest.TempPathFactory) -> Iterator[ServedClient]:
    folder: Path = tmp_path_factory.mktemp("scenes")
    with serving(folder, SHIPPED, page_limit=4) as client:
        for name in NAMES:
            body = {**solver.load_scene("two-dof").to_dict(), "name": name}
            assert client.post("/v1/scenes", json=body).status_code == 201
        yield client


def names(answer: dict) -> list[str]:
    return [item["name"] for item in answer["items"]]


def test_pages_follow_each_other_until_all_were_listed(service: ServedClient) -> None:
    first = service.get("/v1/scenes", params={"limit": 2}).json()
    second = service.get(first["next"]).json()
    third = service.get(second["next"]).json()
    assert names(first) == [*solver.shipped_scenes(), *NAMES[:2]]
    assert names(second) == NAMES[2:4]
    assert names(third) == NAMES[4:]
    assert third["next"] is None


def test_a_page_holds_no_more_than_the_service_lists(service: ServedClient) -> None:
    assert names(service.get("/v1/scenes").json()) == [*solver.shipped_scenes(), *NAMES[:4]]


def test_a_place_that_no_page_named_is_refused(service: ServedClient) -> None:
    problem = is_problem(service.get("/v1/scenes", params={"cursor": "nowhere"}), 422)
    assert problem["errors"][0]["pointer"] == "/cursor"


def test_tables_of_scenes_are_not_read_for_the_list(service: ServedClient) -> None:
    said: list[str] = []
    engines = {service.service.database._read, service.service.database._write}
    for engine in engines:
        event.listen(engine, "before_cursor_execute", lambda *words: said.append(words[2]))
    service.get("/v1/scenes")
    asked = [text for text in said if "FROM scene" in text]
    assert asked
    assert not [text for text in asked if "scene.body" in text]
