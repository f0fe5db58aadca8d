"""Reports that the service makes of designs, and measured data that it reads."""

import re

import httpx
import pytest
from service_helpers import is_problem, pdf_objects

DESIGN = {"kind": "design", "scene": "two-dof", "variables": {"damper.N0": [20, 500]}, "harmonics": 1}
ROWS = "# damper.N0 = 80\nfrequency [Hz],amplitude [mm]\n1.0,1930\n1.1,2120\n1.2,1770\n"


def test_a_report_is_a_page_or_a_pdf(shipped: httpx.Client) -> None:
    project = shipped.post("/v1/projects", json={"name": "Stage 3", "notes": "Loads of May."}).json()
    said = {"project": project["id"], "name": "narrow band", "notes": "for <the> review", "tags": ["may"]}
    job = shipped.post("/v1/jobs", json={**DESIGN, **said}, headers={"Prefer": "wait=60"}).json()
    where = f"/v1/jobs/{job['id']}/report"
    page = shipped.get(where)
    assert page.headers["content-type"].startswith("text/html")
    assert f"{job['result']['optimum']['damper.N0']:.6g} N" in page.text
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


def test_only_what_has_a_report_is_reported(shipped: httpx.Client) -> None:
    body = {"kind": "solve", "scene": "two-dof", "frequency_hz": 1.0, "harmonics": 1}
    job = shipped.post("/v1/jobs", json=body, headers={"Prefer": "wait=60"}).json()
    problem = is_problem(shipped.get(f"/v1/jobs/{job['id']}/report"), 409)
    assert "'solve', which has no report: only design, pareto" in problem["detail"]


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
