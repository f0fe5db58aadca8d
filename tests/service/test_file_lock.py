"""One service an SQLite file, by whatever name it is called, and files that nobody else can read."""

import os
import stat
import subprocess
import sys
from pathlib import Path

import pytest

from service.db import revisions
from service.db.engine import backup
from service.db.lock import FileLock
from service.errors import DatabaseInUseError

_HOLD = """
import sys
from pathlib import Path
from service.db.lock import FileLock
with FileLock(Path(sys.argv[1])):
    print("held", flush=True)
    sys.stdin.read()
"""


@pytest.fixture
def held(tmp_path: Path):
    """A database that another process has locked."""
    file = tmp_path / "jobs.db"
    revisions.upgrade(f"sqlite:///{file}")
    command = [sys.executable, "-c", _HOLD, str(file)]
    with subprocess.Popen(command, stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True) as process:
        assert process.stdout is not None
        assert process.stdout.readline() == "held\n"
        yield file
        process.communicate("")


def test_a_deleted_lock_file_admits_nobody(held: Path) -> None:
    Path(f"{held}.lock").unlink()
    with pytest.raises(DatabaseInUseError):
        FileLock(held).acquire()


def test_a_hard_link_admits_nobody(held: Path, tmp_path: Path) -> None:
    (tmp_path / "elsewhere").mkdir()
    other = tmp_path / "elsewhere" / "other.db"
    os.link(held, other)
    with pytest.raises(DatabaseInUseError):
        FileLock(other).acquire()


def test_a_hard_link_admits_no_second_one_of_the_same_process(tmp_path: Path) -> None:
    file, other = tmp_path / "jobs.db", tmp_path / "other.db"
    with FileLock(file):
        os.link(file, other)
        with pytest.raises(DatabaseInUseError):
            FileLock(other).acquire()
    with FileLock(other):
        pass


def test_the_files_are_their_owners_alone(tmp_path: Path) -> None:
    file = tmp_path / "jobs.db"
    revisions.upgrade(f"sqlite:///{file}")
    backup(f"sqlite:///{file}", tmp_path / "copy.db")
    with FileLock(file):
        modes = {one.name: stat.S_IMODE(one.stat().st_mode) for one in tmp_path.iterdir()}
    assert {"jobs.db", "copy.db", "jobs.db.lock"} <= set(modes)
    assert set(modes.values()) == {0o600}
