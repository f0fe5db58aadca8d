"""Arrays outside of the database: a folder, or any store that fsspec knows, such as ``s3://bucket/arrays``.

An array of a job is the file ``JOB/SHA256.npy``: named by its digest, and with the others of its job, so that
deleting a job never takes what another one refers to. Files are written before the row that refers to them
and deleted after it, so that a crash leaves a file too many and never one too few; `db check` names those.
"""

from __future__ import annotations

import contextlib
from collections.abc import Collection, Iterator
from typing import Any

from service.errors import ConfigurationError, DatabaseError
from service.db.upload_files import to_disk
from service.jobs.stored_figures import StoredArray

OUTSIDE_BYTES = 1 << 14
"""Smaller arrays stay in the database: a file of their own would cost more than they do."""


class FsspecStore:
    """Arrays in one folder of one store.

    Parameters
    ----------
    place : str
        A folder, or a URL of fsspec.

    Raises
    ------
    ConfigurationError
        If fsspec, or what it needs for such a URL, is not installed.
    """

    def __init__(self, place: str) -> None:
        self.place = place
        try:
            from fsspec.core import url_to_fs

            found: tuple[Any, str] = url_to_fs(place, use_listings_cache=False)
        except (ImportError, ValueError) as error:
            raise ConfigurationError(
                f"`arrays` (STICKSLIP_ARRAYS) must be a folder or a URL of fsspec (extra `stores`), "
                f"got {place!r}: {error}"
            ) from error
        self._files, self._root = found[0], found[1].rstrip("/")
        self._in_folder = "file" in self._files.protocol

    def put(self, job_id: str, array: StoredArray) -> StoredArray:
        """Write an array of a job, unless it is small; what its row is to hold."""
        if len(array.data) < OUTSIDE_BYTES:
            return array
        self._files.makedirs(f"{self._root}/{job_id}", exist_ok=True)
        file = self._file(job_id, array.sha256)
        self._files.pipe_file(file, array.data)
        if self._in_folder:
            # Its row is to be on disk after it, and with it what names it.
            for path in (file, f"{self._root}/{job_id}", self._root):
                to_disk(path)
        return StoredArray(sha256=array.sha256, data=b"", size=len(array.data))

    def get(self, job_id: str, sha256: str) -> bytes:
        """Read an array.

        Raises
        ------
        DatabaseError
            If it is not there or cannot be read.
        """
        try:
            found: bytes = self._files.cat_file(self._file(job_id, sha256))
        except OSError as error:
            raise DatabaseError(f"{self._file(job_id, sha256)} cannot be read: {error}") from error
        return found

    def keep(self, job_id: str, digests: Collection[str]) -> None:
        """Delete all arrays of a job but these."""
        folder = f"{self._root}/{job_id}"
        if not digests:
            with contextlib.suppress(FileNotFoundError):
                self._files.rm(folder, recursive=True)
            return
        for path in self._files.ls(folder, detail=False):
            if path.rpartition("/")[2].removesuffix(".npy") not in digests:
                self._files.rm_file(path)

    def jobs(self) -> Iterator[str]:
        """Yield the jobs that have files here."""
        with contextlib.suppress(FileNotFoundError):
            for path in self._files.ls(self._root, detail=False):
                yield str(path).rstrip("/").rpartition("/")[2]

    def _file(self, job_id: str, sha256: str) -> str:
        return f"{self._root}/{job_id}/{sha256}.npy"
