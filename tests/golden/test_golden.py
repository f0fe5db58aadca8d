"""What users see is what it was: ``python -m tests.golden --write`` after a change that is meant."""

from functools import cache
from pathlib import Path

import pytest

from tests.golden.faces import DATA, Studies, differences, joined, sections
from tests.golden.golden_cases import SHIPPED, Case, cases
from tests.golden.made import FILES

CASES = [pytest.param(case, marks=pytest.mark.long if case.long else (), id=case.name) for case in cases()]
PRINTED = [
    pytest.param(case, marks=pytest.mark.long if case.long or case.scene not in SHIPPED else (), id=case.name)
    for case in cases()
]


@cache
def kept(name: str) -> dict[str, str]:
    return sections((DATA / name).read_text("utf-8"))


@pytest.fixture(scope="module")
def studies(tmp_path_factory: pytest.TempPathFactory) -> Studies:
    return Studies(tmp_path_factory.mktemp("scenes"))


@pytest.mark.parametrize("name", ["openapi.txt", "help.txt", "docs.txt", "commands.txt", "refusals.txt"])
def test_it_is_as_it_was(name: str, tmp_path: Path) -> None:
    assert differences((DATA / name).read_text("utf-8"), joined(FILES[name](tmp_path))) == []


@pytest.mark.few(2)
@pytest.mark.parametrize("case", CASES)
def test_a_study_answers_as_it_did(case: Case, studies: Studies) -> None:
    assert differences(kept("studies.txt")[case.name], studies.answer(case)) == []


@pytest.mark.few(2)
@pytest.mark.parametrize("case", PRINTED)
def test_a_study_prints_as_it_did(case: Case, studies: Studies) -> None:
    assert differences(kept("printed.txt")[case.name], studies.table(case)) == []


def test_every_case_is_kept_and_no_other() -> None:
    names = {case.name for case in cases()}
    assert kept("studies.txt").keys() == names == kept("printed.txt").keys()


def test_a_difference_is_seen() -> None:
    assert differences("peak: 1.234 m", "peak: 1.2341 m") == []
    assert differences("peak: 1.234 m", "peak: 1.24 m") == ["- peak: 1.234 m", "+ peak: 1.24 m"]
    assert differences("peak: 1.234 m", "peak: 1.234 mm") != []
    assert differences("one\ntwo", "one") == ["- two"]
