"""`stickslip runs` and `stickslip projects` against a service."""

import json
from typing import Any

import httpx
import pytest

from service.cli import main


def test_a_run_is_named_found_compared_and_thrown_away(
    http: httpx.Client, capsys: pytest.CaptureFixture[str]
) -> None:
    url = ["--url", str(http.base_url)]

    def said(*words: str) -> str:
        assert main([*words, *url]) == 0
        return capsys.readouterr().out

    def told(*words: str) -> Any:
        return json.loads(said(*words, "--json"))

    project = said("projects", "create", "shroud", "--notes", "of May").strip()
    assert told("projects", "change", project, "--name", "tip")["revision"] == 2
    assert "tip" in said("projects", "list", "--text", "tip")
    body = {"kind": "iteration", "project": project}
    runs = [
        http.post("/v1/jobs", json={**body, "size": size}, headers={"Prefer": "wait=60"}).json()["id"]
        for size in (7, 8)
    ]
    assert "is changed" in said("runs", "change", runs[0], "--name", "small", "--tag", "x", "--tag", "y")
    [found] = told("runs", "list", "--project", project, "--tag", "y", "--status", "successful")["items"]
    assert (found["id"], found["tags"]) == (runs[0], ["x", "y"])
    assert "small" in said("runs", "list", "--text", "small")
    assert told("runs", "change", runs[0], "--tag", "")["tags"] == []
    compared = said("runs", "compare", *runs)
    assert [line.split() for line in compared.splitlines() if "size" in line] == [["size", "7", "8"]]
    [eigenvalue] = [line.split() for line in compared.splitlines() if "eigenvalue" in line]
    assert len(eigenvalue) == 3
    link = said("runs", "share", runs[0], "--days", "1").strip()
    assert httpx.get(link).json()["name"] == "small"
    assert "is in the bin" in said("runs", "delete", runs[0])
    assert told("runs", "list", "--deleted", "--project", project)["items"][0]["id"] == runs[0]
    assert "is out of the bin" in said("runs", "restore", runs[0])
    assert "is in the bin" in said("projects", "delete", project)
    assert told("projects", "restore", project)["deleted"] is None
    assert main(["runs", "change", runs[0], *url]) == 2
    assert "give what is to be changed: --name" in capsys.readouterr().err
    assert main(["runs", "delete", "none", *url]) != 0
    assert "there is no run 'none'" in capsys.readouterr().err


def test_what_is_compared_has_its_units(shipped: httpx.Client, capsys: pytest.CaptureFixture[str]) -> None:
    body = {"kind": "sweep", "scene": "bladed-disk", "harmonics": 3}
    runs = [
        shipped.post("/v1/jobs", json={**body, "set": {"shroud.N0": load}}, headers={"Prefer": "wait=60"})
        for load in (150.0, 250.0)
    ]
    ids = [run.json()["id"] for run in runs]
    assert main(["runs", "compare", *ids, "--url", str(shipped.base_url)]) == 0
    lines = [line.split() for line in capsys.readouterr().out.splitlines()]
    assert ["shroud.N0", "150", "N", "250", "N"] in lines
    [peak] = [line for line in lines if line[:1] == ["peak"]]
    assert peak.count("mm") == peak.count("Hz") == 2
