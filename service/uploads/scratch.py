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
from multiprocessing.util import Finalize
from pathlib import Path
from typing import TextIO

PREFIX = "stickslip-service-"
_LOCK = "lock"
_OF_MULTIPROCESSING = "pymp-"
_AFTER_MULTIPROCESSING = -200  # it removes its own folder at -100


@contextmanager
def scratch_folder() -> Iterator[Path]:
    """Inside the block every temporary file of this process is in a folder that is removed at its end.

    Where multiprocessing has made its own folder in it, which it looks for once more when the process ends,
    that one stays until then.
    """
    remove_abandoned()
    before, variable = tempfile.tempdir, os.environ.get("TMPDIR")
    folder = Path(tempfile.mkdtemp(prefix=PREFIX))
    lock = (folder / _LOCK).open("w")
    _try_lock(lock.fileno())
    # Processes that read uploads for this one find it in the environment.
    tempfile.tempdir = os.environ["TMPDIR"] = str(folder)
    try:
        yield folder
    finally:
        tempfile.tempdir = before
        if variable is None:
            del os.environ["TMPDIR"]
        else:
            os.environ["TMPDIR"] = variable
        kept = [part for part in folder.iterdir() if part.name.startswith(_OF_MULTIPROCESSING)]
        for part in set(folder.iterdir()) - {*kept, folder / _LOCK}:
            shutil.rmtree(part, ignore_errors=True) if part.is_dir() else part.unlink(missing_ok=True)
        if kept:
            Finalize(None, _remove, args=(folder, lock), exitpriority=_AFTER_MULTIPROCESSING)
        else:
            _remove(folder, lock)


def _remove(folder: Path, lock: TextIO) -> None:
    """Remove a folder whose lock this process holds."""
    shutil.rmtree(folder, ignore_errors=True)
    lock.close()


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
