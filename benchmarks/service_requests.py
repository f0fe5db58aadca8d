"""What one request costs: a look at a job beside a route of FastAPI that does nothing, in turns."""

from __future__ import annotations

import os
import socket
import statistics
import subprocess
import sys
import tempfile
import time
from pathlib import Path

from benchmarks.harness import expect, table
from benchmarks.service_load import small_job
from benchmarks.service_process import LightClient, serving

_BARE = """
import sys, uvicorn
from fastapi import FastAPI
app = FastAPI()
@app.get("/v1/jobs/{job_id}")
def bare(job_id: str) -> dict[str, str]:
    return {"id": job_id}
uvicorn.run(app, port=int(sys.argv[1]), http="h11", loop="auto", log_level="warning", access_log=False)
"""
_ROUNDS, _REQUESTS = 30, 50
_START_SECONDS = 60.0


def _bare_route(port: int) -> subprocess.Popen[bytes]:
    process = subprocess.Popen([sys.executable, "-c", _BARE, str(port)])
    end = time.monotonic() + _START_SECONDS
    while True:
        try:
            LightClient(port).__exit__()
        except OSError:
            expect("the bare route does not answer", time.monotonic() < end and process.poll() is None)
            time.sleep(0.05)
        else:
            return process


def _seconds(client: LightClient, path: str) -> float:
    begun = time.perf_counter()
    for _ in range(_REQUESTS):
        expect("not answered 200", client.get(path).status == 200)
    return (time.perf_counter() - begun) / _REQUESTS


def requests() -> None:
    """`GET /v1/jobs/{id}` beside a bare synchronous route of FastAPI, in turns on the same machine."""
    with socket.socket() as probe:
        probe.bind(("127.0.0.1", 0))
        port = int(probe.getsockname()[1])
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        database = f"sqlite:///{folder}/jobs.db"
        with serving(database, workers=1, log=folder / "log", log_level="WARNING") as service:
            process = _bare_route(port)
            try:
                with service.client() as ours, LightClient(port) as bare:
                    done = ours.post("/v1/jobs", small_job(0), "Prefer: wait=60\r\n").json()
                    path = f"/v1/jobs/{done['id']}"
                    pairs = [(_seconds(ours, path), _seconds(bare, path)) for _ in range(_ROUNDS)]
            finally:
                process.terminate()
                process.wait()
    ms = [statistics.median(one) * 1e3 for one in zip(*pairs, strict=True)]
    ratio = statistics.median(a / b for a, b in pairs)
    table(
        f"One request, {_ROUNDS} times {_REQUESTS} of each in turns, {os.cpu_count()} cores",
        ("GET /v1/jobs/{id}", "a bare route", "ratio", "wanted"),
        [(f"{ms[0]:.2f} ms", f"{ms[1]:.2f} ms", f"{ratio:.2f}", "3")],
    )
