"""What a client asks of projects, runs and links to them."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

from service.client.transport import Transport, segment
from service.schemas.answers import JobScene, ResultsAnswer, SweepDetail
from service.schemas.workbench_answers import (
    Comparison,
    NewShareAnswer,
    ProjectAnswer,
    ProjectPage,
    RunAnswer,
    RunPage,
    RunSummary,
    ShareAnswer,
    SharedRun,
    ShareList,
    SharePage,
)


class Workbench(Transport):
    """Projects, runs and links to them.

    Where a `revision` is given, a change is refused (`ServiceProblem` with status 412) if what is changed has
    another one by now.
    """

    def projects(self, **filters: Any) -> Iterator[ProjectAnswer]:
        """Every project that meets the filters of ``GET /v1/projects``, page after page."""
        return self._pages(ProjectPage, "/v1/projects", filters)

    def project(self, project_id: str) -> ProjectAnswer:
        """A project, in the bin or not."""
        return self._get(ProjectAnswer, _project(project_id))

    def make_project(self, name: str, notes: str = "") -> ProjectAnswer:
        """Make a project. Sent again because a connection failed, it may be made twice."""
        return self._sent(ProjectAnswer, "POST", "/v1/projects", json={"name": name, "notes": notes})

    def change_project(
        self, project_id: str, *, revision: int | None = None, **changes: str
    ) -> ProjectAnswer:
        """Change `name` or `notes` of a project."""
        return self._changed(ProjectAnswer, _project(project_id), revision, changes)

    def delete_project(self, project_id: str) -> ProjectAnswer:
        """Put a project in the bin; its runs stay."""
        return self._sent(ProjectAnswer, "DELETE", _project(project_id))

    def restore_project(self, project_id: str) -> ProjectAnswer:
        """Take a project out of the bin."""
        return self._sent(ProjectAnswer, "POST", f"{_project(project_id)}/restore")

    def runs(self, **filters: Any) -> Iterator[RunAnswer]:
        """Every run that meets the filters of ``GET /v1/runs``, page after page; lists for several.

        ``runs(status=["accepted", "running"])`` are those under way.
        """
        return self._pages(RunPage, "/v1/runs", filters)

    def run(self, run_id: str) -> RunAnswer:
        """A run, in the bin or not; its id is that of its job."""
        return self._get(RunAnswer, _run(run_id))

    def change_run(self, run_id: str, *, revision: int | None = None, **changes: Any) -> RunAnswer:
        """Change `project`, `name`, `notes` or `tags` of a run."""
        return self._changed(RunAnswer, _run(run_id), revision, changes)

    def delete_run(self, run_id: str) -> RunAnswer:
        """Put a run that has ended in the bin."""
        return self._sent(RunAnswer, "DELETE", _run(run_id))

    def restore_run(self, run_id: str) -> RunAnswer:
        """Take a run out of the bin."""
        return self._sent(RunAnswer, "POST", f"{_run(run_id)}/restore")

    def compare(self, a: str, b: str) -> Comparison:
        """Two runs: the inputs that differ, and the figures of their results."""
        return self._get(Comparison, "/v1/runs/compare", a=a, b=b)

    def summary(self, run_id: str, points: int = 60) -> RunSummary:
        """What was asked of a run, its figures, and its response in at most so many points."""
        return self._get(RunSummary, f"{_run(run_id)}/summary", points=points)

    def share_run(self, run_id: str, days: float | None = None) -> NewShareAnswer:
        """Make a link to a run that needs no key, for so many days or until it is ended."""
        body = {} if days is None else {"days": days}
        return self._sent(NewShareAnswer, "POST", f"{_run(run_id)}/shares", json=body)

    def shares(self, run_id: str) -> list[ShareAnswer]:
        """The links to a run, without their tokens."""
        return self._get(ShareList, f"{_run(run_id)}/shares").items

    def all_shares(self, **filters: Any) -> Iterator[ShareAnswer]:
        """The links to all runs that the key sees, newest first, page after page."""
        return self._pages(SharePage, "/v1/shares", filters)

    def end_share(self, run_id: str, share_id: str) -> None:
        """End a link to a run."""
        self._send("DELETE", f"{_run(run_id)}/shares/{segment(share_id)}")

    def shared_run(self, token: str) -> SharedRun:
        """The run of a link."""
        return self._get(SharedRun, "/v1/shared", token=token)

    def shared_scene(self, token: str) -> dict[str, Any]:
        """The scene of a link's run, as it is computed."""
        return self._get(JobScene, "/v1/shared/scene", token=token).scene

    def shared_results(self, token: str) -> ResultsAnswer:
        """What the run of a link computed."""
        return self._get(ResultsAnswer, "/v1/shared/results", token=token)

    def shared_sweep(self, token: str, sweep_id: str) -> SweepDetail:
        """A sweep stored with the run of a link, with its arrays."""
        return self._get(SweepDetail, f"/v1/shared/sweeps/{segment(sweep_id)}", token=token)


def _project(project_id: str) -> str:
    return f"/v1/projects/{segment(project_id)}"


def _run(run_id: str) -> str:
    return f"/v1/runs/{segment(run_id)}"
