"""Reports that the service makes of designs, and measured data that it reads."""

import asyncio
import re
import time
from typing import Any

import httpx
import pytest
from service_helpers import is_problem, pdf_objects, until

from service.errors import ConflictError, TooManyRequestsError
from service.http.made_once import Reports
from service.queue.lanes import Lane

DESIGN = {"kind": "design", "scene": "two-dof", "variables": {"damper.N0": [20, 500]}, "harmonics": 1}
ROWS = "# damper.N0 = 80\nfrequency [Hz],amplitude [mm]\n1.0,1930\n1.1,2120\n1.2,1770\n"


def test_a_report_is_a_page_or_a_pdf(shipped: httpx.Client) -> None:
    project = shipped.post("/v1/projects", json={"name": "Stage 3", "notes": "Loads of May."}).json()
    said = {"project": project["id"], "name": "narrow band", "notes": "for <the> review", "tags": ["may"]}
    job = shipped.post("/v1/jobs", json={**DESIGN, **said}, headers={"Prefer": "wait=60"}).json()
    where = f"/v1/jobs/{job['id']}/report"
    page = shipped.get(where)
    assert page.headers["content-type"].startswith("text/html")
    assert f"{job['result']['optimum']['damper.N0']:.4g} N" in page.text
    about = page.text.partition("<h2>")[0]
    for words in ("Stage 3", "Loads of May.", "narrow band", "for &lt;the&gt; review", "may", "not named"):
        assert words in about
    dates = re.findall(r"(?:computed|report made)</th><td>(\d{4}-\d\d-\d\d \d\d:\d\d)", about)
    assert len(dates) == 2
    sheets = shipped.get(where, headers={"Accept": "application/pdf"})
    assert sheets.headers["content-type"] == "application/pdf"
    assert sheets.headers["content-disposition"] == f'attachment; filename="report-{job["id"]}.pdf"'
    assert sheets.content.startswith(b"%PDF")
    assert 1 <= len(re.findall(rb"/Type /Page\b", pdf_objects(sheets.content))) <= 4
    is_problem(shipped.get(where, headers={"Accept": "image/png"}), 406)
    is_problem(shipped.get("/v1/jobs/none/report"), 404)


@pytest.mark.long
def test_who_does_not_wait_is_told_when_it_is_there(shipped: httpx.Client) -> None:
    """Of the job and of its report; it is made once, and kept as it was made."""
    job = shipped.post("/v1/jobs", json={**DESIGN, "fresh": True}).json()["id"]
    where = f"/v1/jobs/{job}/report"
    pending = shipped.get(where, headers={"Prefer": "respond-async"})
    assert (pending.status_code, pending.json()) == (202, {"job_id": job, "status": "computing"})
    assert pending.headers["location"] == where
    assert int(pending.headers["retry-after"]) > 0
    assert shipped.get(f"/v1/jobs/{job}", params={}).status_code == 200
    until(lambda: shipped.get(f"/v1/jobs/{job}").json()["status"] == "successful")
    told: list[str] = []
    with shipped.stream("GET", "/v1/runs/events", timeout=60.0) as events:
        lines = events.iter_lines()
        next(lines)
        making = shipped.get(where, params={"format": "html"}, headers={"Prefer": "wait=0"})
        assert (making.status_code, making.json()["status"]) == (202, "making")
        assert making.headers["location"] == f"{where}?format=html"
        while not any(job in line for line in told):
            told.append(next(lines))
    first = shipped.get(where, headers={"Prefer": "wait=0"})
    assert first.status_code == 200
    assert shipped.get(where).content == first.content, "with the minute in which it was made"
    shipped.patch(f"/v1/runs/{job}", json={"name": "of May"})
    renamed = shipped.get(where)
    assert "of May" in renamed.text
    assert renamed.content != first.content


def test_one_report_is_made_once_and_one_owner_has_few_under_way() -> None:
    calls: list[str] = []

    def make(name: str, seconds: float = 0.0) -> bytes:
        calls.append(name)
        time.sleep(seconds)
        return name.encode() * 1000

    async def ask() -> None:
        reports = Reports(Lane(1, 30.0))

        def get(name: str, owner: str, wait: float | None = None, seconds: float = 0.0) -> Any:
            return reports.get(name, owner, lambda: make(name, seconds), wait, lambda: calls.append("told"))

        both = await asyncio.gather(get("a", "one", seconds=0.2), get("a", "two"))
        assert both[0] == both[1] == b"a" * 1000
        assert await get("a", "two") == both[0]
        assert calls == ["a"]
        for name in "bcde":
            assert await get(name, "one", 0.0, 0.1) is None
        with pytest.raises(TooManyRequestsError, match="as many reports under way as one may: 4"):
            await get("f", "one")
        assert await get("e", "one") == b"e" * 1000
        assert calls.count("told") >= 3
        assert await get("f", "one") == b"f" * 1000

    asyncio.run(ask())


def test_a_report_that_cannot_be_made_says_so_to_who_comes_later() -> None:
    def broken() -> bytes:
        raise ConflictError("there is nothing to report")

    async def ask() -> None:
        reports = Reports(Lane(1, 30.0))
        told = asyncio.Event()
        assert await reports.get("a", "one", broken, 0.0, told.set) is None
        await asyncio.wait_for(told.wait(), 30.0)
        with pytest.raises(ConflictError, match="nothing to report"):
            await reports.get("a", "one", broken, 0.0, told.set)

    asyncio.run(ask())


def test_only_what_has_a_report_is_reported(shipped: httpx.Client) -> None:
    body = {"kind": "solve", "scene": "two-dof", "frequency_hz": 1.0, "harmonics": 1}
    job = shipped.post("/v1/jobs", json=body, headers={"Prefer": "wait=60"}).json()
    problem = is_problem(shipped.get(f"/v1/jobs/{job['id']}/report"), 409)
    assert "'solve', which has no report: only design, pareto" in problem["detail"]


@pytest.mark.long
def test_measured_data_become_tables_of_a_job(shipped: httpx.Client) -> None:
    files = [{"name": "rig.csv", "text": ROWS}, {"name": "torn.csv", "text": ROWS.replace("2120", "")}]
    body = {"scene": "two-dof", "files": [*files, {"name": "far.csv", "text": ROWS.replace("[Hz]", "[kHz]")}]}
    answer = shipped.post("/v1/measurements/read", json=body).json()
    [read] = answer["files"]
    [run] = read["runs"]
    assert (read["name"], run["conditions"], run["points"]) == ("rig.csv", {"damper.N0": 80.0}, 3)
    assert run["data"] == pytest.approx([1.93, 2.12, 1.77])
    torn, far = answer["issues"]
    assert (torn["file"], torn["line"], torn["column"]) == ("torn.csv", 4, "amplitude [mm]")
    assert "leave the whole row out" in torn["detail"]
    assert (far["file"], far["line"]) == ("far.csv", 3)
    job = {
        "kind": "identify", "scene": "two-dof", "data": [read["table"]], "harmonics": 1, "starts": 2,
        "unknowns": {"damper.mu": [0.1, 0.6]},
    }  # fmt: skip
    found = shipped.post("/v1/jobs", json=job, headers={"Prefer": "wait=60"}).json()["result"]
    assert found["runs"][0]["data"] == pytest.approx(run["data"])
