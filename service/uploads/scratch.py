"""Temporary folders that do not outlive their service, even one that was killed.

A process that is killed cannot remove what it made. So everything temporary of a service is in one folder
whose lock it holds, and whoever starts next removes the folders whose lock nobody holds any more.
"""

from __future__ import annotations

import os
import shutil
import sys
import tempfile
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

PREFIX = "stickslip-service-"
_LOCK = "lock"


@contextmanager
def scratch_folder() -> Iterator[Path]:
    """Inside the block every temporary file of this process is in a folder that is removed at its end."""
    remove_abandoned()
    before, variable = tempfile.tempdir, os.environ.get("TMPDIR")
    with tempfile.TemporaryDirectory(prefix=PREFIX) as name, (Path(name) / _LOCK).open("w") as lock:
        _try_lock(lock.fileno())
        # Processes that read uploads for this one find it in the environment.
        tempfile.tempdir = os.environ["TMPDIR"] = name
        try:
            yield Path(name)
        finally:
            tempfile.tempdir = before
            if variable is None:
                del os.environ["TMPDIR"]
            else:
                os.environ["TMPDIR"] = variable


def remove_abandoned() -> list[Path]:
    """Remove the folders of services that were killed; which they were."""
    gone = []
    for folder in Path(tempfile.gettempdir()).glob(f"{PREFIX}*"):
        try:
            with (folder / _LOCK).open("r") as lock:
                if not _try_lock(lock.fileno()):
                    continue
        except OSError:
            continue  # another's, or made at this moment
        shutil.rmtree(folder, ignore_errors=True)
        gone.append(folder)
    return gone


def _try_lock(file: int) -> bool:
    """Lock an open file until it is closed; False if somebody else has it locked."""
    if sys.platform == "win32":
        return False
    import fcntl

    try:
        fcntl.flock(file, fcntl.LOCK_EX | fcntl.LOCK_NB)
    except OSError:
        return False
    return True
