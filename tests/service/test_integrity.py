"""`stickslip db check` and `db backup`: a sound database, and each kind of damage."""

import json
import sqlite3
from pathlib import Path

import pytest
from private_kinds import PRIVATE
from service_helpers import PATIENCE, MakeSettings, settings_of

from service.cli import main
from service.client.embedded import EmbeddedService
from service.db.models import JobState
from service.db.repositories.integrity import check
from service.errors import DatabaseError

SWEEP = {"scene": "two-dof", "parameter": "frequency", "from": 0.9, "to": 1.2, "harmonics": 3}


@pytest.fixture(scope="module")
def used(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A database with a finished sweep."""
    from service.settings.settings import load_settings

    path = tmp_path_factory.mktemp("used") / "jobs.db"
    with EmbeddedService(load_settings(database=f"sqlite:///{path}", workers=1)) as service:
        assert service.wait(service.submit("sweep", SWEEP)).status.value == "successful"
    return path


@pytest.fixture
def copy(used: Path, tmp_path: Path) -> Path:
    assert main(["db", "backup", str(tmp_path / "copy.db"), "--database", f"sqlite:///{used}"]) == 0
    return tmp_path / "copy.db"


def trouble(path: Path) -> str:
    """What a check says of a damaged file, whether it can read on or not."""
    try:
        return "; ".join(check(f"sqlite:///{path}").trouble)
    except DatabaseError as error:
        return str(error)


def change(path: Path, statement: str) -> None:
    with sqlite3.connect(path) as connection:
        assert connection.execute(statement).rowcount > 0
    connection.close()


def test_a_used_database_and_its_backup_are_sound(used: Path, copy: Path) -> None:
    for path in (used, copy):
        found = check(f"sqlite:///{path}")
        assert found.sound
        assert found.contents.jobs == {"successful": 1}
        assert found.contents.sweeps == 1
        assert found.contents.arrays > 3


@pytest.mark.parametrize(
    ("statement", "words"),
    [
        ("UPDATE sweep_array SET data = CAST(data || x'00' AS BLOB)", "checksum"),
        ("UPDATE job_result SET body = replace(body, '1', '2')", "does not match its checksum"),
        ("DELETE FROM job_result", "1 successful jobs without a result"),
        ("UPDATE job SET state = 'dismissed'", "1 results of jobs that computed none"),
        ("UPDATE job SET state = 'dismissed'", "1 sweeps of jobs that computed none"),
        ("UPDATE job SET finished = NULL", "1 ended jobs without the time"),
        ("DELETE FROM sweep_array", "1 sweeps without their arrays"),
        ("UPDATE result SET job_id = 'nobody'", "a row of `result` refers to a row of `job`"),
    ],
)
def test_damage_is_found_and_named(
    copy: Path, statement: str, words: str, capsys: pytest.CaptureFixture[str]
) -> None:
    change(copy, statement)
    capsys.readouterr()
    assert main(["db", "check", "--database", f"sqlite:///{copy}", "--json"]) == 1
    printed = capsys.readouterr()
    answer = json.loads(printed.out)
    assert not answer["sound"]
    assert any(words in line for line in answer["trouble"])
    assert "restore a backup" in printed.err


def test_a_page_overwritten_is_found(copy: Path) -> None:
    data = bytearray(copy.read_bytes())
    page = int.from_bytes(data[16:18], "big")
    data[3 * page : 3 * page + 64] = b"\xff" * 64
    copy.write_bytes(bytes(data))
    assert trouble(copy)


def test_what_is_no_database_is_refused(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    text = tmp_path / "notes.db"
    text.write_text("not a database, but long enough to be read as one" * 30)
    for path, words in ((tmp_path / "none.db", "no database"), (text, "notes.db")):
        assert main(["db", "check", "--database", f"sqlite:///{path}"]) in (1, 2)
        assert words in capsys.readouterr().err
    assert text.read_text().startswith("not a database")


def test_a_backup_does_not_overwrite(used: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    target = tmp_path / "kept.db"
    target.write_text("mine")
    assert main(["db", "backup", str(target), "--database", f"sqlite:///{used}"]) in (1, 2)
    assert "exists already" in capsys.readouterr().err
    assert target.read_text() == "mine"


def test_a_database_in_use_can_be_checked(make_settings: MakeSettings) -> None:
    settings = make_settings()
    with EmbeddedService(settings) as service:
        service.wait(service.submit("sweep", SWEEP))
        assert check(settings.database).sound


def test_what_a_job_computed_short_of_its_goal_is_no_damage(url: str) -> None:
    with EmbeddedService(settings_of(url)(), PRIVATE) as service:
        done = service.wait(service.submit("falls-short", {"sweeps": 1}), timeout=PATIENCE)
        assert done.status is JobState.FAILED
        assert service.results(done.id).sweeps
        assert check(url).trouble == ()


def test_runs_against_their_jobs_and_projects(copy: Path) -> None:
    said = "SELECT id, NULL, '', '', created, 1, created FROM job"
    change(copy, f"INSERT INTO run (job_id, project_id, name, notes, changed, revision, deleted) {said}")
    assert trouble(copy) == ""
    change(copy, "INSERT INTO project VALUES ('p', 'ben', '', '', '2026-01-01', '2026-01-01', 1, NULL)")
    change(copy, "UPDATE run SET project_id = 'p'")
    assert "1 runs in a project of another owner" in trouble(copy)
    change(copy, "UPDATE job SET state = 'accepted'")
    assert "1 runs in the bin whose job has not ended" in trouble(copy)
