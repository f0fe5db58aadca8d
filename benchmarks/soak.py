"""Twenty minutes of mixed jobs on a real service: ``python -m benchmarks.soak [--minutes 20]``.

Three clients submit jobs of every kind, look at lists, follow event streams and cancel some; a fourth asks
for a small job every second and notes the time until its result. Printed is, for each tenth of the time, the
memory of the service and of its workers and the latency of the small job. Memory is flat if the last
tenths hold no more than 5 % above those after the start-up, latency if its median did not grow.
"""

from __future__ import annotations

import argparse
import contextlib
import random
import signal
import socket
import statistics
import subprocess
import sys
import tempfile
import threading
import time
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import httpx

from benchmarks.harness import expect, table

_TENTHS = 10
_SETTLED = 3  # tenths that fill caches and pools
_GROWTH = 1.05
_LOWEST_MB = 1.0


@dataclass
class Log:
    """What was seen, each with the time it was seen at [s]."""

    begin: float = field(default_factory=time.monotonic)
    over: threading.Event = field(default_factory=threading.Event)
    memory: list[tuple[float, float, float]] = field(default_factory=list)
    latency: list[tuple[float, float]] = field(default_factory=list)
    ended: dict[str, int] = field(default_factory=dict)
    wrong: list[str] = field(default_factory=list)

    def now(self) -> float:
        """Return the time since the begin [s]."""
        return time.monotonic() - self.begin


def _body(generator: random.Random) -> dict[str, Any]:
    """A job of any kind, different from all before."""
    load = round(generator.uniform(60.0, 400.0), 6)
    two, disk = {"scene": "two-dof"}, {"scene": "bladed-disk"}
    return generator.choice(
        [
            {"kind": "sweep", **two, "set": {"damper.N0": load}},
            {"kind": "sweep", **disk, "set": {"shroud.N0": load}},
            {"kind": "solve", **disk, "set": {"shroud.N0": load}, "frequency_hz": 755},
            {"kind": "march", **two, "set": {"damper.N0": load}, "frequency_hz": 1.2},
            {"kind": "design", **two, "variables": {"damper.N0": [20, 500 + load]}},
            {"kind": "map", **two, "parameter": "damper.N0", "from": 50, "to": 100 + load, "steps": 8,
             "frequencies": 60},
            {"kind": "peaks", **two, "parameter": "damper.N0", "from": 80, "to": 100 + load},
            {"kind": "accuracy", **two, "set": {"damper.N0": load}, "frequency_hz": 1.05},
            {"kind": "mistuning", **disk, "of": ["tip"], "samples": 1, "harmonics": 3,
             "seed": generator.randrange(10**9)},
        ]
    )  # fmt: skip


def _work(base: str, log: Log, seed: int) -> None:
    generator = random.Random(seed)
    with httpx.Client(base_url=base, timeout=120.0) as client:
        while not log.over.is_set():
            body = _body(generator)
            job = client.post("/v1/jobs", json=body).raise_for_status().json()
            if generator.random() < 0.05:
                client.delete(f"/v1/jobs/{job['id']}")
            if generator.random() < 0.3:
                with client.stream("GET", f"/v1/jobs/{job['id']}/events") as stream:
                    for _ in stream.iter_lines():
                        pass
            while (job := client.get(f"/v1/jobs/{job['id']}").json())["finished"] is None:
                time.sleep(0.05)
            word = f"{body['kind']} {job['status']}"
            log.ended[word] = log.ended.get(word, 0) + 1
            if job["status"] == "successful":
                client.get(f"/v1/jobs/{job['id']}/results").raise_for_status()
            elif job["status"] == "failed":
                log.wrong.append(f"{body}: {job['error']}")
            client.get("/v1/sweeps?sort=peak&limit=50").raise_for_status()


def _probe(base: str, log: Log) -> None:
    """A small job of a high priority every second: what it waits for is a worker and the service."""
    generator = random.Random(0)
    body: dict[str, Any] = {"kind": "sweep", "scene": "two-dof", "priority": 100}
    with httpx.Client(base_url=base, timeout=120.0, headers={"Prefer": "wait=60"}) as client:
        while not log.over.wait(1.0):
            begin = time.monotonic()
            body["set"] = {"damper.N0": round(generator.uniform(500.0, 900.0), 6)}
            answer = client.post("/v1/jobs", json=body)
            if answer.status_code != 200:
                log.wrong.append(f"the small job was answered {answer.status_code}")
            log.latency.append((log.now(), time.monotonic() - begin))


def _children(pid: int) -> list[int]:
    """Every process below one."""
    found: list[int] = []
    with contextlib.suppress(FileNotFoundError, ProcessLookupError):
        for task in Path(f"/proc/{pid}/task").iterdir():
            with contextlib.suppress(FileNotFoundError, ProcessLookupError):  # the thread ended meanwhile
                found += map(int, (task / "children").read_text().split())
    return found + [below for child in found for below in _children(child)]


def _megabytes(pid: int) -> float:
    """The memory of a process, shared pages counted by their share."""
    with contextlib.suppress(FileNotFoundError, ProcessLookupError):
        for line in Path(f"/proc/{pid}/smaps_rollup").read_text().splitlines():
            if line.startswith("Pss:"):
                return int(line.split()[1]) / 1024.0
    return 0.0


def _weigh(process: subprocess.Popen[bytes], log: Log) -> None:
    while not log.over.wait(2.0):
        own = _megabytes(process.pid)
        log.memory.append((log.now(), own, sum(_megabytes(pid) for pid in _children(process.pid))))


def _tenths(seen: list[tuple[float, float]], length: float) -> list[float]:
    """The median of each tenth of the time."""
    return [
        statistics.median([v for t, v in seen if k <= t / length * _TENTHS < k + 1] or [float("nan")])
        for k in range(_TENTHS)
    ]


def soak(minutes: float) -> None:
    """Run it and print what was seen."""
    with socket.socket() as probe:
        probe.bind(("127.0.0.1", 0))
        port = probe.getsockname()[1]
    with tempfile.TemporaryDirectory() as folder:
        command = [
            sys.executable,
            "-c",
            "from service.cli import main; main()",
            "serve",
            "--port",
            str(port),
            "--workers",
            "2",
        ]
        command += ["--database", f"sqlite:///{folder}/jobs.db"]
        with (Path(folder) / "log").open("wb") as log_file:
            process = subprocess.Popen(command, stderr=log_file, stdout=log_file)
        try:
            _await(f"http://127.0.0.1:{port}", process)
            log = _run(f"http://127.0.0.1:{port}", process, minutes * 60.0)
        finally:
            process.send_signal(signal.SIGTERM)
            status = process.wait(30.0)
        size = (Path(folder) / "jobs.db").stat().st_size / 1e6
    _report(log, minutes * 60.0, size)
    expect("the service ended with status 0", status == 0)
    expect(f"nothing went wrong: {log.wrong[:3]}", not log.wrong)


def _await(base: str, process: subprocess.Popen[bytes]) -> None:
    for _ in range(6000):
        with contextlib.suppress(httpx.TransportError):
            if httpx.get(f"{base}/health/ready").status_code == 200:
                return
        expect("the service runs", process.poll() is None)
        time.sleep(0.1)
    expect("the service is ready within ten minutes", False)


def _run(base: str, process: subprocess.Popen[bytes], seconds: float) -> Log:
    log = Log()
    threads = [threading.Thread(target=_work, args=(base, log, seed)) for seed in range(3)]
    threads.append(threading.Thread(target=_probe, args=(base, log)))
    threads.append(threading.Thread(target=_weigh, args=(process, log)))
    for thread in threads:
        thread.start()
    while log.now() < seconds and all(thread.is_alive() for thread in threads):
        time.sleep(0.2)
    log.over.set()
    for thread in threads:
        thread.join(180.0)
    expect("every client went on to the end", log.now() >= seconds)
    return log


def _report(log: Log, seconds: float, size: float) -> None:
    service = _tenths([(t, own) for t, own, _ in log.memory], seconds)
    workers = _tenths([(t, theirs) for t, _, theirs in log.memory], seconds)
    latency = _tenths(log.latency, seconds)
    rows = [
        (f"{(k + 1) * seconds / _TENTHS / 60:.1f}", f"{service[k]:.1f}", f"{workers[k]:.1f}",
         f"{1e3 * latency[k]:.0f}")
        for k in range(_TENTHS)
    ]  # fmt: skip
    table(
        "Soak: medians of each tenth",
        ("minutes", "service [MB]", "workers [MB]", "small job [ms]"),
        rows,
    )
    total = [own + theirs for own, theirs in zip(service, workers, strict=True)]
    early, late = total[_SETTLED : _SETTLED + 2], total[-2:]
    growth = statistics.mean(late) / max(statistics.mean(early), _LOWEST_MB)
    waits = statistics.mean(latency[-2:]) / statistics.mean(latency[_SETTLED : _SETTLED + 2])
    print(f"\nmemory x {growth:.3f}, latency x {waits:.2f} from tenths 4 and 5 to tenths 9 and 10")
    print(f"database {size:.0f} MB; {sum(log.ended.values())} jobs and {len(log.latency)} small ones")
    print(", ".join(f"{word} {number}" for word, number in sorted(log.ended.items())))
    expect(f"memory is flat within 5 %: x {growth:.3f}", growth <= _GROWTH)


if __name__ == "__main__":
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--minutes", type=float, default=20.0)
    soak(parser.parse_args().minutes)
