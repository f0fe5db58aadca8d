"""A Dask scheduler and workers on loopback, each a process of its own, for the tests."""

import os
import signal
import subprocess
import sys
from contextlib import suppress
from pathlib import Path
from typing import Self

import psutil
from launch import free_port

HERE = Path(__file__).parent
ENVIRONMENT = {
    "OMP_NUM_THREADS": "1",
    "OPENBLAS_NUM_THREADS": "1",
    "MKL_NUM_THREADS": "1",
    "NUMBA_NUM_THREADS": "1",
    "PYTHONPATH": os.pathsep.join([str(HERE), str(HERE.parents[1]), os.environ.get("PYTHONPATH", "")]),
}


def lives(process: psutil.Process) -> bool:
    """Whether a process is there; one that ended and that nobody asked for is not."""
    with suppress(psutil.NoSuchProcess):
        return process.is_running() and process.status() != psutil.STATUS_ZOMBIE
    return False


class DaskCluster:
    """One scheduler, and workers with one thread each, as docs/cluster.md starts them."""

    def __init__(self, folder: Path, workers: int, extra: tuple[str, ...] = (), scheme: str = "tcp") -> None:
        self._folder = folder
        self._count = workers
        self._port = free_port()
        self._extra = extra
        self.address = f"{scheme}://127.0.0.1:{self._port}"
        self.scheduler: subprocess.Popen[bytes]
        self.workers: list[subprocess.Popen[bytes]] = []

    def __enter__(self) -> Self:
        self.start_scheduler()
        for _ in range(self._count):
            self.add_worker()
        return self

    def __exit__(self, *_: object) -> None:
        for process in (*self.workers, self.scheduler):
            family = self.family(process)
            for each in family:
                with suppress(psutil.NoSuchProcess):
                    each.kill()
            process.wait(60)
            psutil.wait_procs(family, 60)

    def start_scheduler(self) -> None:
        """Start the scheduler, at the same address again if there was one."""
        self.scheduler = self._start("dask_scheduler", "--port", str(self._port), "--host", "127.0.0.1")

    def add_worker(self) -> subprocess.Popen[bytes]:
        """Start a worker, which is a nanny and the process that computes."""
        folder = self._folder / f"worker-{len(self.workers)}"
        self.workers.append(
            self._start(
                "dask_worker", self.address, "--nthreads", "1", "--nworkers", "1", "--host", "127.0.0.1",
                "--local-directory", str(folder), "--death-timeout", "60",
            )
        )  # fmt: skip
        return self.workers[-1]

    def kill_scheduler(self) -> None:
        """kill -9."""
        self.scheduler.send_signal(signal.SIGKILL)
        self.scheduler.wait(60)

    @staticmethod
    def family(process: subprocess.Popen[bytes]) -> list[psutil.Process]:
        """A process and all below it."""
        try:
            top = psutil.Process(process.pid)
            return [top, *top.children(recursive=True)]
        except psutil.NoSuchProcess:
            return []

    def _start(self, program: str, *arguments: str) -> subprocess.Popen[bytes]:
        command = [sys.executable, "-m", f"distributed.cli.{program}", "--no-dashboard"]
        with (self._folder / f"{program}.log").open("ab") as log:
            return subprocess.Popen(
                [*command, *self._extra, *arguments],
                env={**os.environ, **ENVIRONMENT}, stdin=subprocess.DEVNULL, stdout=log, stderr=log,
                cwd=self._folder,
            )  # fmt: skip
