"""A client of the service's REST API."""

from __future__ import annotations

import time
from collections.abc import Callable, Iterator, Mapping
from typing import Any, Self
from urllib.parse import quote

import httpx

from service.answers import (
    DesignAnswer,
    DesignDetail,
    DesignPage,
    JobAnswer,
    ResultsAnswer,
    SceneDetail,
    SweepAnswer,
    SweepDetail,
    SweepPage,
)
from service.errors import ServiceProblem

_POLL_SECONDS = (0.02, 0.05, 0.1, 0.2, 0.5)


class Client:
    """Submits jobs to a service, watches them and fetches what they computed; a context manager.

    Every method raises `ServiceProblem` with the problem document if the service refuses, and
    `ServiceProblem` with status 0 if it cannot be reached.

    Parameters
    ----------
    base_url : str
        For example ``http://127.0.0.1:8000``.
    timeout : float
        Time one request may take [s].
    """

    def __init__(self, base_url: str, timeout: float = 30.0) -> None:
        self._http = httpx.Client(base_url=base_url, timeout=timeout)

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *_: object) -> None:
        self.close()

    def close(self) -> None:
        """Close the connections."""
        self._http.close()

    def submit(self, body: Mapping[str, Any], *, idempotency_key: str | None = None) -> JobAnswer:
        """Submit a job: the body of ``POST /v1/jobs``."""
        headers = {} if idempotency_key is None else {"Idempotency-Key": idempotency_key}
        answer = self._request("POST", "/v1/jobs", json=dict(body), headers=headers)
        return JobAnswer.model_validate(answer)

    def job(self, job_id: str) -> JobAnswer:
        """How a job is."""
        return JobAnswer.model_validate(self._request("GET", f"/v1/jobs/{_segment(job_id)}"))

    def wait(
        self,
        job_id: str,
        on_progress: Callable[[float, int], None] | None = None,
        timeout: float | None = None,
    ) -> JobAnswer:
        """Look at a job until it has ended; with `timeout` [s] it may be unfinished still."""
        end = None if timeout is None else time.monotonic() + timeout
        reported: tuple[float, int] | None = None
        for pause in _pauses():
            job = self.job(job_id)
            now = (job.progress, job.points)
            if on_progress is not None and now != reported and not job.status.finished:
                on_progress(*now)
                reported = now
            if job.status.finished or (end is not None and time.monotonic() >= end):
                return job
            time.sleep(pause)
        raise RuntimeError("the pauses ended")

    def results(self, job_id: str) -> ResultsAnswer:
        """What a job computed."""
        return ResultsAnswer.model_validate(self._request("GET", f"/v1/jobs/{_segment(job_id)}/results"))

    def dismiss(self, job_id: str) -> JobAnswer:
        """Cancel a job."""
        return JobAnswer.model_validate(self._request("DELETE", f"/v1/jobs/{_segment(job_id)}"))

    def sweeps(self, **filters: Any) -> Iterator[SweepAnswer]:
        """Every stored sweep that meets the filters of ``GET /v1/sweeps``, page after page."""
        page = SweepPage.model_validate(self._request("GET", "/v1/sweeps", params=_words(filters)))
        yield from page.items
        while page.next is not None:
            page = SweepPage.model_validate(self._request("GET", page.next))
            yield from page.items

    def sweep(self, sweep_id: str) -> SweepDetail:
        """A stored sweep with its arrays."""
        return SweepDetail.model_validate(self._request("GET", f"/v1/sweeps/{_segment(sweep_id)}"))

    def designs(self, **filters: Any) -> Iterator[DesignAnswer]:
        """Every stored design that meets the filters of ``GET /v1/designs``, page after page."""
        page = DesignPage.model_validate(self._request("GET", "/v1/designs", params=_words(filters)))
        yield from page.items
        while page.next is not None:
            page = DesignPage.model_validate(self._request("GET", page.next))
            yield from page.items

    def design(self, design_id: str) -> DesignDetail:
        """A stored design with the whole result; its id is that of its job."""
        return DesignDetail.model_validate(self._request("GET", f"/v1/designs/{_segment(design_id)}"))

    def store_scene(self, scene: Mapping[str, Any]) -> SceneDetail:
        """Store a scene under its name."""
        return SceneDetail.model_validate(self._request("POST", "/v1/scenes", json=dict(scene)))

    def _request(self, method: str, path: str, **arguments: Any) -> Any:
        try:
            response = self._http.request(method, path, **arguments)
        except httpx.HTTPError as error:
            detail = f"the service at {self._http.base_url} cannot be reached: {error}"
            raise ServiceProblem(0, {"title": "No answer", "detail": detail}) from error
        if response.is_success:
            return response.json()
        try:
            problem = response.json()
        except ValueError:
            problem = {"title": response.reason_phrase, "detail": response.text[:500]}
        raise ServiceProblem(response.status_code, problem if isinstance(problem, dict) else {})


def _words(filters: Mapping[str, Any]) -> dict[str, Any]:
    """Filters as a query: without those not given, true and false in lower case."""
    given = {key: value for key, value in filters.items() if value is not None}
    return {key: str(value).lower() if isinstance(value, bool) else value for key, value in given.items()}


def _segment(name: str) -> str:
    """An id as one segment of a path."""
    return quote(name, safe="")


def _pauses() -> Iterator[float]:
    """Times between looks at a job [s], growing to the last one."""
    yield from _POLL_SECONDS
    while True:
        yield _POLL_SECONDS[-1]
