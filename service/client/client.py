"""A client of the service's REST API."""

from __future__ import annotations

import io
import time
import uuid
from collections.abc import Callable, Iterator, Mapping
from pathlib import Path
from typing import TYPE_CHECKING, Any, Literal

import httpx
import numpy as np
from numpy.typing import NDArray

from service.client.transport import pauses, segment, words
from service.client.workbench import Workbench
from service.errors import ServiceProblem
from service.schemas.answers import (
    END,
    DesignAnswer,
    DesignDetail,
    DesignPage,
    EventData,
    FinishedJob,
    JobAnswer,
    JobPage,
    JobPoints,
    JobProgress,
    JobScene,
    KindAnswer,
    KindList,
    LawAnswer,
    LawList,
    ResultPage,
    ResultsAnswer,
    SceneAnswer,
    SceneDetail,
    SceneList,
    StoredResult,
    SweepAnswer,
    SweepDetail,
    SweepPage,
    told,
)
from service.schemas.matrix_answers import (
    FormatAnswer,
    FormatsAnswer,
    MatricesAnswer,
    NewUpload,
    UploadAnswer,
    UploadPage,
)

_SILENCE_SECONDS = 60.0

if TYPE_CHECKING:
    from service.queue.health import Health, Readiness
    from solver.results.told import Told


_PART_BYTES = 32 * 1024 * 1024  # of a file that is sent in parts


class Client(Workbench):
    """Submits jobs to a service, watches them and fetches what they computed; a context manager.

    Every method raises `ServiceProblem` with the problem document if the service refuses, and
    `ServiceProblem` with status 0 if it cannot be reached. A connection that fails is tried again; a job
    carries an idempotency key, so that it is accepted once however often it was sent.

    Parameters
    ----------
    base_url : str
        For example ``http://127.0.0.1:8000``.
    timeout : float
        Time one request may take [s].
    key : str, optional
        A key to the service, where it needs one.
    """

    def submit(
        self, body: Mapping[str, Any], *, idempotency_key: str | None = None, wait: float | None = None
    ) -> JobAnswer:
        """Submit a job: the body of ``POST /v1/jobs``.

        Parameters
        ----------
        idempotency_key : str, optional
            One of its own if not given.
        wait : float, optional
            Wait so many seconds for its end; a job that has ended comes as a `FinishedJob` with its result.
        """
        return self._submit("/v1/jobs", body, idempotency_key, wait)

    def submit_design(
        self, body: Mapping[str, Any], *, idempotency_key: str | None = None, wait: float | None = None
    ) -> JobAnswer:
        """Submit a design: the body of ``POST /v1/designs``; as `submit`."""
        return self._submit("/v1/designs", body, idempotency_key, wait)

    def kinds(self) -> list[KindAnswer]:
        """The kinds of job of the service, with the schemas of their bodies and results."""
        return self._get(KindList, "/v1/kinds").items

    def laws(self) -> list[LawAnswer]:
        """The contact laws of the service, with their parameters."""
        return self._get(LawList, "/v1/laws").items

    def job(self, job_id: str) -> JobAnswer:
        """How a job is."""
        return self._get(JobAnswer, f"/v1/jobs/{segment(job_id)}")

    def jobs(self, **filters: Any) -> Iterator[JobAnswer]:
        """Every job that meets the filters of ``GET /v1/jobs``, page after page."""
        return self._pages(JobPage, "/v1/jobs", filters)

    def events(self, job_id: str, silence: float = _SILENCE_SECONDS) -> Iterator[EventData]:
        """What happens to a job: `JobProgress`, `JobPoints`, at last the `JobAnswer` of its end.

        A broken connection is made again, and goes on behind the last event.

        Parameters
        ----------
        silence : float
            Time without any sign of life after which the connection counts as broken [s].
        """
        path, last = f"/v1/jobs/{segment(job_id)}/events", None
        tries = pauses()
        while True:
            headers: dict[str, str] = {} if last is None else {"Last-Event-ID": last}
            broken: Exception = ConnectionError("the stream ended before the job")
            try:
                with self._stream(path, headers, silence) as answer:
                    for event in told(answer.iter_lines()):
                        tries = pauses()
                        last = event.id or last
                        if event.data is not None:
                            yield event.data
                        if last == END:
                            return
            except httpx.TransportError as error:
                broken = error
            pause = next(tries)
            if pause is None:
                raise self._away(broken) from broken
            time.sleep(pause)

    def wait(
        self, job_id: str, on_progress: Callable[[float, int], None] | None = None,
        timeout: float | None = None, on_points: Callable[[JobPoints], None] | None = None,
        on_best: Callable[[dict[str, Any]], None] | None = None,
    ) -> JobAnswer:  # fmt: skip
        """Follow a job until it has ended; with `timeout` [s] it may be unfinished still.

        Parameters
        ----------
        on_progress : callable, optional
            Called with the fraction and the points so far.
        timeout : float, optional
            Longest time to wait [s].
        on_points : callable, optional
            Called with the new points of a sweep.
        on_best : callable, optional
            Called with the best design so far of a design job, before the progress it came with.
        """
        end = None if timeout is None else time.monotonic() + timeout
        silence = _SILENCE_SECONDS if timeout is None else min(max(timeout, 0.001), _SILENCE_SECONDS)
        try:
            for event in self.events(job_id, silence) if timeout is None or timeout > 0.0 else ():
                if isinstance(event, JobAnswer):
                    return event
                if isinstance(event, JobProgress) and on_best is not None and event.best is not None:
                    on_best(event.best)
                if isinstance(event, JobProgress) and on_progress is not None:
                    on_progress(event.progress, event.points)
                if isinstance(event, JobPoints) and on_points is not None:
                    on_points(event)
                if end is not None and time.monotonic() >= end:
                    break
        except ServiceProblem as problem:
            if problem.status != 0 or end is None or time.monotonic() < end:
                raise
        return self.job(job_id)

    def results(self, job_id: str) -> ResultsAnswer:
        """What a job computed."""
        return self._get(ResultsAnswer, f"/v1/jobs/{segment(job_id)}/results")

    def result(self, job_id: str) -> Told:
        """What a job computed as the class that the function gives, `Branch`, `DesignResult`, …

        It has what the JSON has (`Told.from_json`); `results` has the JSON itself.

        Raises
        ------
        ServiceProblem
            If there is no such job, or it has no result.
        LookupError
            If its kind is none that this program knows.
        """
        from service.jobs.kinds import studies

        kind, written = self.job(job_id).kind, self.results(job_id).result
        study = studies().get(kind)
        if study is None:
            raise LookupError(f"{kind!r} is no study of this version: `results` has its JSON")
        return study.result_class(written).from_json(written)

    def job_report(self, job_id: str, form: Literal["html", "pdf"] = "pdf") -> bytes:
        """The design report of a job, made by the service: a page or a PDF."""
        path = f"/v1/jobs/{segment(job_id)}/report"
        return self._send("GET", path, params={"format": form}).content

    def job_scene(self, job_id: str) -> dict[str, Any]:
        """The scene of a job as it is computed, with its values set and what its uploads held."""
        return self._get(JobScene, f"/v1/jobs/{segment(job_id)}/scene").scene

    def dismiss(self, job_id: str) -> JobAnswer:
        """Cancel a job."""
        return self._sent(JobAnswer, "DELETE", f"/v1/jobs/{segment(job_id)}")

    def sweeps(self, **filters: Any) -> Iterator[SweepAnswer]:
        """Every stored sweep that meets the filters of ``GET /v1/sweeps``, page after page."""
        return self._pages(SweepPage, "/v1/sweeps", filters)

    def sweep(self, sweep_id: str) -> SweepDetail:
        """A stored sweep with its arrays."""
        return self._get(SweepDetail, f"/v1/sweeps/{segment(sweep_id)}")

    def sweep_arrays(self, sweep_id: str) -> dict[str, NDArray[Any]]:
        """The arrays of a stored sweep, under the names that `Branch.to_dataset` gives them."""
        with np.load(io.BytesIO(self._sweep_as(sweep_id, "application/x-npz")), allow_pickle=False) as arrays:
            return {name: arrays[name] for name in arrays.files if name != "stickslip"}

    def sweep_csv(self, sweep_id: str) -> str:
        """A stored sweep as a table, a row for each point."""
        return self._sweep_as(sweep_id, "text/csv").decode()

    def sweep_parquet(self, sweep_id: str) -> bytes:
        """A stored sweep as a Parquet file."""
        return self._sweep_as(sweep_id, "application/vnd.apache.parquet")

    def sweep_plot(self, sweep_id: str, form: Literal["svg", "png"] = "svg") -> bytes:
        """A picture of a stored sweep."""
        return self._send("GET", f"/v1/sweeps/{segment(sweep_id)}/plot.{form}").content

    def stored(self, of: str, **filters: Any) -> Iterator[StoredResult]:
        """Every stored result of a kind that meets the filters of ``GET /v1/results``, page after page."""
        return self._pages(ResultPage, "/v1/results", {**filters, "of": of})

    def designs(self, **filters: Any) -> Iterator[DesignAnswer]:
        """Every stored design that meets the filters of ``GET /v1/designs``, page after page."""
        return self._pages(DesignPage, "/v1/designs", filters)

    def design(self, design_id: str) -> DesignDetail:
        """A stored design with the whole result; its id is that of its job."""
        return self._get(DesignDetail, f"/v1/designs/{segment(design_id)}")

    def scenes(self) -> list[SceneAnswer]:
        """Shipped and stored scenes."""
        return list(self._pages(SceneList, "/v1/scenes", {}))

    def scene(self, name: str) -> SceneDetail:
        """A scene with its tables."""
        return self._get(SceneDetail, f"/v1/scenes/{segment(name)}")

    def store_scene(self, scene: Mapping[str, Any]) -> SceneDetail:
        """Store a scene under its name."""
        return self._sent(SceneDetail, "POST", "/v1/scenes", json=dict(scene))

    def plan(self, body: Mapping[str, Any]) -> dict[str, Any]:
        """Which effects a scene calls for: the body of ``POST /v1/plan``."""
        return self._posted("/v1/plan", body)

    def preview(self, body: Mapping[str, Any]) -> dict[str, Any]:
        """A small response at once, nothing stored: the body of ``POST /v1/previews``."""
        return self._posted("/v1/previews", body)

    def read_scene(self, text: str, form: Literal["toml", "json"] = "toml") -> dict[str, Any]:
        """The tables in the text of a scene file (`scene`), and everything wrong with them (`issues`)."""
        return self._posted("/v1/scenes/read", {"text": text, "form": form})

    def read_measurements(self, body: Mapping[str, Any]) -> dict[str, Any]:
        """Measured data in CSV as tables of a job: the body of ``POST /v1/measurements/read``."""
        return self._posted("/v1/measurements/read", body)

    def edit_scene(self, body: Mapping[str, Any]) -> dict[str, Any]:
        """The text of a scene with its tables changed, comments kept: ``POST /v1/scenes/edit``."""
        return self._posted("/v1/scenes/edit", body)

    def scenes_schema(self) -> dict[str, Any]:
        """The JSON Schema of scenes, ``GET /v1/scenes-schema``."""
        answer: dict[str, Any] = self._send("GET", "/v1/scenes-schema").json()
        return answer

    def templates(self) -> list[dict[str, Any]]:
        """The common cases that scenes begin with, each with its questions: ``GET /v1/templates``."""
        items: list[dict[str, Any]] = self._send("GET", "/v1/templates").json()["items"]
        return items

    def scene_from(self, template: str, answers: Mapping[str, Any]) -> dict[str, Any]:
        """The scene of a common case: ``POST /v1/templates``, nothing is stored."""
        asked = {"template": template, "answers": dict(answers)}
        scene: dict[str, Any] = self._posted("/v1/templates", asked)["scene"]
        return scene

    def scene_parameters(self, body: Mapping[str, Any]) -> dict[str, Any]:
        """The parameters of a scene with unit, value and range: ``POST /v1/scenes/parameters``."""
        return self._posted("/v1/scenes/parameters", body)

    def scene_text(self, body: Mapping[str, Any]) -> str:
        """A scene with its values set, as TOML: the body of ``POST /v1/scenes/text``."""
        return self._send("POST", "/v1/scenes/text", json=dict(body)).text

    def upload(self, file: Path | bytes, name: str | None = None, format: str | None = None) -> NewUpload:
        """Upload a file of matrices or modes, given by its path or its bytes; a large one in parts.

        Parameters
        ----------
        name : str, optional
            To be shown; its suffix tells the format unless `format` does. That of the path if not given.
        """
        path = None if isinstance(file, bytes) else file
        query = words({"name": name or (path.name if path else None), "format": format})
        content = file if isinstance(file, bytes) else file.read_bytes()
        # Sending and looking at a large file takes its time.
        timeout = max(self._timeout, 120.0 * max(1.0, len(content) / _PART_BYTES))

        def sent(asked: Mapping[str, Any], data: bytes) -> NewUpload:
            return self._sent(NewUpload, "POST", "/v1/uploads", params=asked, content=data, timeout=timeout)

        if len(content) <= _PART_BYTES:
            return sent(query, content)
        starts = range(0, len(content), _PART_BYTES)
        parts = [sent({**query, "format": "part"}, content[at : at + _PART_BYTES]).id for at in starts]
        return sent({**query, "part": parts}, b"")

    def uploads(self, **filters: Any) -> Iterator[UploadAnswer]:
        """Every upload, newest first, page after page."""
        return self._pages(UploadPage, "/v1/uploads", filters)

    def uploaded(self, upload_id: str) -> UploadAnswer:
        """An upload, without its bytes."""
        return self._get(UploadAnswer, f"/v1/uploads/{segment(upload_id)}")

    def delete_upload(self, upload_id: str) -> None:
        """Forget an upload."""
        self._send("DELETE", f"/v1/uploads/{segment(upload_id)}")

    def formats(self) -> list[FormatAnswer]:
        """The formats of files that can be uploaded."""
        return self._get(FormatsAnswer, "/v1/matrices/formats").items

    def matrices(self, body: Mapping[str, Any]) -> MatricesAnswer:
        """What uploaded matrices are; with DOFs named, the scene that begins with them."""
        return self._sent(MatricesAnswer, "POST", "/v1/matrices", json=dict(body))

    def health(self) -> Health | Readiness:
        """Whether the service can work, also if it cannot; the details if the key may see them."""
        from service.queue.health import Health, Readiness

        try:
            answer = self._send("GET", "/health/ready").json()
        except ServiceProblem as problem:
            if problem.status != 503 or "ready" not in problem.problem:
                raise
            answer = problem.problem
        return (Health if "version" in answer else Readiness).model_validate(answer)

    def metrics(self) -> str:
        """What a monitor reads, in Prometheus' text format."""
        return self._send("GET", "/metrics").text

    def _submit(self, path: str, body: Mapping[str, Any], key: str | None, wait: float | None) -> JobAnswer:
        headers = {"Idempotency-Key": key or str(uuid.uuid4())}
        timeout = self._timeout
        if wait is not None:
            headers["Prefer"] = f"wait={max(round(wait), 0)}"
            timeout += wait
        answer = self._send("POST", path, json=dict(body), headers=headers, timeout=timeout)
        model = FinishedJob if answer.status_code == httpx.codes.OK else JobAnswer
        return model.model_validate(answer.json())

    def _sweep_as(self, sweep_id: str, media: str) -> bytes:
        headers = {"Accept": media}
        return self._send("GET", f"/v1/sweeps/{segment(sweep_id)}", headers=headers).content
