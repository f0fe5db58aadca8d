"""The service inside a program: queue, workers and database without HTTP."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any, Self

from service.jobs.kind_registry import Registry
from service.jobs.outputs import OnProgress
from service.jobs.strict_json import validated
from service.queue.core import Service
from service.schemas.answers import (
    DesignAnswer,
    DesignDetail,
    JobAnswer,
    ResultsAnswer,
    StoredResult,
    SweepAnswer,
    SweepDetail,
)
from service.schemas.result_queries import (
    DesignQuery,
    ResultQuery,
    SweepQuery,
    design_page,
    result_page,
    sweep_page,
)
from service.settings.settings import Settings, load_settings


class EmbeddedService:
    """A service for the length of a ``with`` block.

    The worker processes import the main module of the program anew: a script that uses this must do so
    below ``if __name__ == "__main__":``.

    Parameters
    ----------
    settings : Settings, optional
        Its settings; from the environment if not given.
    registry : Registry, optional
        The kinds of job; those shipped and those of the setting `kinds` if not given.

    Raises
    ------
    DatabaseInUseError
        On entering, if another service has the database file.
    """

    def __init__(self, settings: Settings | None = None, registry: Registry | None = None) -> None:
        self._service = Service(settings or load_settings(), registry)

    def __enter__(self) -> Self:
        self._service.start()
        return self

    def __exit__(self, *_: object) -> None:
        self._service.stop()

    def submit(self, kind: str, spec: Mapping[str, Any], *, idempotency_key: str | None = None) -> str:
        """Accept a job and give back its id; `spec` has the words of the REST body without ``kind``.

        InvalidRequestError with everything that is wrong, with pointers into `spec`.
        """
        row, _ = self._service.submit({**spec, "kind": kind}, idempotency_key)
        return row.id

    def job(self, job_id: str) -> JobAnswer:
        """How a job is (NotFoundError if there is none)."""
        return JobAnswer.of(self._service.job(job_id), self._service.queue.live(job_id))

    def wait(
        self, job_id: str, on_progress: OnProgress | None = None, timeout: float | None = None
    ) -> JobAnswer:
        """Wait until a job has ended; with `timeout` [s] it may be unfinished still."""
        self._service.wait(job_id, timeout, on_progress)
        return self.job(job_id)

    def results(self, job_id: str) -> ResultsAnswer:
        """What a job computed (ConflictError, JobFailedError if there is nothing)."""
        return ResultsAnswer.of(self._service.results(job_id))

    def dismiss(self, job_id: str) -> JobAnswer:
        """Cancel a job and wait until it has stopped."""
        self._service.dismiss(job_id)
        return self.wait(job_id, timeout=self._service.settings.grace_seconds + 1.0)

    def stored(self, of: str, **filters: Any) -> list[StoredResult]:
        """Stored results of a kind, by any of their figures; the filters of ``GET /v1/results``."""
        service, asked = self._service, validated(ResultQuery, {**filters, "of": of})
        return result_page(service.stored, asked, service.registry, service.settings).items

    def sweeps(self, **filters: Any) -> list[SweepAnswer]:
        """Stored sweeps, newest first unless `sort` is given; the filters of ``GET /v1/sweeps``."""
        return sweep_page(self._service.stored, validated(SweepQuery, filters), self._service.settings).items

    def sweep(self, sweep_id: str) -> SweepDetail:
        """A stored sweep with its arrays (NotFoundError if there is none)."""
        return SweepDetail.load(self._service.sweep(sweep_id), self._service.stored)

    def designs(self, **filters: Any) -> list[DesignAnswer]:
        """Stored designs, newest first unless `sort` is given; the filters of ``GET /v1/designs``."""
        asked = validated(DesignQuery, filters)
        return design_page(self._service.stored, asked, self._service.settings).items

    def design(self, design_id: str) -> DesignDetail:
        """A stored design with the whole result (NotFoundError if there is none)."""
        return DesignDetail.whole(self._service.design(design_id))
