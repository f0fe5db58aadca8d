"""An adapter in a process of its own, without the answers, which is asked and whose time is taken."""

from __future__ import annotations

import contextlib
import json
import math
import os
import secrets
import select
import shutil
import signal
import subprocess
import sys
import tempfile
import time
from pathlib import Path
from typing import Any

from benchmarks.frictionbench.model import HERE

ROOT, ADAPTERS = HERE.parents[1], HERE / "adapters"
ONE_THREAD = {f"{name}_NUM_THREADS": "1" for name in ("OMP", "OPENBLAS", "MKL", "NUMBA")}
PATIENCE = 10.0  # times the processor time a case may take, on the wall: machines are shared
LONGEST = 1 << 20  # bytes of an answer
PROCESS_CLOCK = 2  # the kind of clock that the number of a process is made into
PACKAGES, CACHES = ("stickslip", "service", "optim", "solver"), ("NUMBA_CACHE_DIR", "XDG_CACHE_HOME")
Score = dict[str, Any]


class Code:
    """A process of an adapter that answers questions; begun anew when it ends or takes too long.

    It lies in a folder of its own with a copy of the adapter and of what turns cases into matrices and
    scenes, has an environment without what is set here, and where the system offers it (`fence`) can open
    nothing of the answers. Its time is taken here: what it spends between question and answer.
    """

    def __init__(self, adapter: Path, seconds: float, python: str = sys.executable, source: str = "") -> None:
        self._adapter, self._seconds, self._python, self._source = adapter, seconds, python, source
        self._process: subprocess.Popen[bytes] | None = None

    def _begin(self) -> subprocess.Popen[bytes]:
        self._folder = tempfile.TemporaryDirectory()
        here, ours = Path(self._folder.name).resolve(), self._python == sys.executable
        package = here / "benchmarks" / "frictionbench"
        package.mkdir(parents=True)
        for name in ("__init__.py", "model.py", "scenes.py"):
            shutil.copy(HERE / name, package / name)
        shutil.copy(ADAPTERS / "protocol.py", here)
        shutil.copy(self._adapter, here / "adapter.py")
        cache = next(filter(None, map(os.environ.get, CACHES)), str(Path.home() / ".cache"))
        environ = {
            "PATH": "/usr/local/bin:/usr/bin:/bin",
            "HOME": str(here),
            "TMPDIR": str(here),
            **ONE_THREAD,
        }
        write, read = (
            [str(here), "/dev"],
            ["/usr", "/bin", "/lib", "/lib64", "/etc", "/proc", "/sys", self._source],
        )
        if ours:  # the packages of this project, and the machine code of its kernels
            for name in PACKAGES:
                (here / name).symlink_to(ROOT / name)
            write, read = (
                [*write, f"{cache}/stickslip-kernels"],
                [*read, *(str(ROOT / one) for one in PACKAGES)],
            )
            environ["NUMBA_CACHE_DIR"] = cache
        paths = subprocess.run(
            [self._python, "-c", "import sys; print(*sys.path, sys.prefix, sys.base_prefix, sep='\\n')"],
            capture_output=True, text=True, check=True, cwd=here, env=environ,
        ).stdout.splitlines()  # fmt: skip
        read += [one for one in paths if one and not HERE.is_relative_to(Path(one).resolve())]
        fenced = [
            sys.executable,
            "-I",
            str(HERE / "fence.py"),
            *map(os.pathsep.join, (write, filter(None, read))),
        ]
        more = ["--source", self._source] if self._source else []
        return subprocess.Popen(
            [*fenced, self._python, str(here / "adapter.py"), *more], cwd=here, env=environ, bufsize=0,
            stdin=subprocess.PIPE, stdout=subprocess.PIPE, stderr=subprocess.DEVNULL, start_new_session=True,
        )  # fmt: skip

    def ask(self, case: dict[str, Any], rung: dict[str, Any]) -> Score:
        """Return value and seconds, or `not_offered`, or `failed` with words."""
        if self._process is None or self._process.poll() is not None:
            self.close()
            self._process = self._begin()
        mark = secrets.token_hex(8)  # an answer that stands ready before its question does not know it
        begun = spent(self._process.pid)
        try:
            line = self._said(json.dumps({"case": case, "rung": rung, "mark": mark}).encode() + b"\n")
            seconds = spent(self._process.pid) - begun
            return read_answer(line, mark) | {"seconds": seconds}
        except (TimeoutError, ConnectionError, ValueError) as error:
            self.close()
            return {"failed": str(error)}

    def _said(self, question: bytes) -> bytes:
        """Return the line that answers a question; errors where the process ends or takes too long."""
        assert self._process is not None
        into, out = self._process.stdin, self._process.stdout
        assert into is not None
        assert out is not None
        os.set_blocking(into.fileno(), False)
        end, line = time.monotonic() + PATIENCE * self._seconds, b""
        while not line.endswith(b"\n"):
            ready, free, _ = select.select(
                [out], [into] if question else [], [], max(0.0, end - time.monotonic())
            )
            if not ready and not free:
                raise TimeoutError(f"no answer within {PATIENCE * self._seconds:g} s")
            if len(line) > LONGEST:
                raise ValueError("its answer is too long")
            if free:
                with contextlib.suppress(BrokenPipeError):
                    question = question[os.write(into.fileno(), question) :]
            if ready:
                line += (more := os.read(out.fileno(), LONGEST))
                if not more:
                    raise ConnectionError("its process ended")
        return line

    def close(self) -> None:
        """End the process and what it started."""
        if self._process is not None:
            with contextlib.suppress(ProcessLookupError):
                os.killpg(self._process.pid, signal.SIGKILL)
            self._process.communicate()
            self._process = None
            self._folder.cleanup()


def spent(process: int) -> float:
    """Return the processor time of a process and of all that it started [s]; the time where none is told."""
    place = Path(f"/proc/{process}")
    if not (place / "stat").exists():
        return time.perf_counter()
    # Who waited for others has their time among its own; what it leaves behind comes to it (`fence`).
    gone = (place / "stat").read_text().rpartition(")")[2].split()[13:15]
    own = time.clock_gettime(~process << 3 | PROCESS_CLOCK) + sum(map(int, gone)) / os.sysconf("SC_CLK_TCK")
    children = [one for each in place.glob("task/*/children") for one in each.read_text().split()]
    return own + sum(spent(int(one)) for one in children)


def read_answer(line: bytes, mark: str) -> Score:
    """Return what a line says: value and perhaps estimate, or `not_offered`, or `failed`.

    Raises
    ------
    ValueError
        It is no answer to this question, or its value is no finite number.
    """
    try:
        told_ = json.loads(line)
    except ValueError:
        raise ValueError("its answer is no line of JSON") from None
    if not isinstance(told_, dict) or told_.get("mark") != mark:
        raise ValueError("it did not answer what it was asked")
    for key in ("not_offered", "failed"):
        if key in told_:
            return {key: str(told_[key])[:300]}
    if not _number(told_.get("value")):
        raise ValueError(f"value must be a finite number, got {json.dumps(told_.get('value'))[:40]}")
    return {
        "value": told_["value"],
        "estimate": told_["estimate"] if _number(told_.get("estimate")) else None,
    }


def _number(told_: object) -> bool:
    return isinstance(told_, int | float) and not isinstance(told_, bool) and math.isfinite(told_)


def scaled(case: dict[str, Any], factor: float) -> tuple[dict[str, Any], float]:
    """Return a case whose forces and motions are `factor` times as large, and how much its answer is.

    All laws are of degree one. By powers of 2 no digit changes, and no answer can be one that is remembered.
    """
    asked = case["asked"]
    made = {
        **case,
        "loads": [{**one, "amplitude": factor * one["amplitude"]} for one in case["loads"]],
        "contacts": [
            {**one, **{key: factor * one[key] for key in ("N0", "N1", "gap") if key in one}}
            for one in case["contacts"]
        ],
    }
    if "range" in asked:
        made["asked"] = {**asked, "range": [factor * each for each in asked["range"]]}
    return made, factor ** {"amplification": 0, "loss": 2}.get(asked["what"], 1)
