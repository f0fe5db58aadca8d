"""Arrays outside of the database: what their store does. The one there is stands in the lab."""

from __future__ import annotations

from collections.abc import Collection, Iterator
from typing import Protocol

from service.jobs.stored_figures import StoredArray
from solver.lab import from_lab


class ArrayStore(Protocol):
    """Arrays in one folder of one store, whose place is as it was given."""

    place: str

    def put(self, job_id: str, array: StoredArray) -> StoredArray:
        """Write an array of a job, unless it is small; what its row is to hold."""

    def get(self, job_id: str, sha256: str) -> bytes:
        """Read an array; DatabaseError if it is not there or cannot be read."""

    def keep(self, job_id: str, digests: Collection[str]) -> None:
        """Delete all arrays of a job but these."""

    def jobs(self) -> Iterator[str]:
        """Yield the jobs that have files here."""


def array_store(place: str | None) -> ArrayStore | None:
    """Return the store at a folder or a URL of fsspec; None for none.

    Raises
    ------
    ConfigurationError
        It cannot be used.
    """
    made: ArrayStore | None = None if place is None else from_lab("stores.array_store:FsspecStore")(place)
    return made
