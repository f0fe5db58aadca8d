"""Temporary files of a service go with it, also of one that is killed."""

from __future__ import annotations

import signal
import subprocess
import sys
import tempfile
from pathlib import Path

import pytest

from service.uploads.uploads import remove_abandoned, scratch_folder

_WORK = """
import sys, tempfile
from service.uploads.uploads import scratch_folder
with scratch_folder() as folder:
    print(tempfile.mkdtemp(prefix="upload-"), flush=True)
    sys.stdin.read()
"""


@pytest.fixture(autouse=True)
def below_the_test(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("TMPDIR", str(tmp_path))
    monkeypatch.setattr(tempfile, "tempdir", str(tmp_path))


def test_temporary_files_are_inside_and_go(tmp_path: Path) -> None:
    with scratch_folder() as folder:
        inside = Path(tempfile.mkdtemp())
        assert inside.parent == folder
    assert list(tmp_path.iterdir()) == []
    assert tempfile.gettempdir() == str(tmp_path)


def test_the_folder_of_multiprocessing_stays_until_the_process_ends(tmp_path: Path) -> None:
    """It looks for it once more, and would say that it is gone."""
    work = f"import multiprocessing.util as util\n{_WORK}    util.get_temp_dir()\nprint(util.get_temp_dir())"
    done = subprocess.run(
        [sys.executable, "-c", work], input="", capture_output=True, text=True, check=True
    )  # fmt: skip
    assert done.stderr == ""
    assert Path(done.stdout.split()[-1]).parent.name.startswith("stickslip-service-")
    assert list(tmp_path.iterdir()) == []


def test_what_a_killed_service_left_is_removed(tmp_path: Path) -> None:
    command = [sys.executable, "-c", _WORK]
    with subprocess.Popen(command, stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True) as process:
        assert process.stdout is not None
        left = Path(process.stdout.readline().strip())
        assert remove_abandoned() == []
        assert left.is_dir()
        process.send_signal(signal.SIGKILL)
    assert remove_abandoned() == [left.parent]
    assert list(tmp_path.iterdir()) == []
