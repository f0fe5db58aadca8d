"""Scores of codes: digits against processor seconds, case by case; what fails is shown as it is."""

from __future__ import annotations

import ast
import contextlib
import json
import math
import os
import random
import secrets
import select
import shutil
import signal
import subprocess
import sys
import tempfile
import time
import venv
import zipfile
from pathlib import Path
from typing import Any

from benchmarks.frictionbench import fence
from benchmarks.frictionbench.model import HERE, load, names
from solver.certificate import checker

ROOT = HERE.parents[1]
ADAPTERS, RESULTS, MADE = HERE / "adapters", HERE / "results", ROOT / ".frictionbench"
ONE_THREAD = {f"{name}_NUM_THREADS": "1" for name in ("OMP", "OPENBLAS", "MKL", "NUMBA")}
MOST = 15.6  # digits of a double
PATIENCE = 10.0  # times the processor time a case may take, on the wall: machines are shared
POWERS, TRIES, AGAIN_BELOW = (
    range(-4, 5),
    3,
    0.2,
)  # of 2; how often; share of that time above which it is once
LONGEST, PROCESS_CLOCK = (
    1 << 20,
    2,
)  # bytes of an answer; the kind of clock that a process number is made into
PACKAGES, CACHES = ("stickslip", "service", "optim", "solver"), ("NUMBA_CACHE_DIR", "XDG_CACHE_HOME")
Score = dict[str, Any]


class MissingError(Exception):
    """What a code needs is not here."""


def told(adapter: Path) -> dict[str, Any]:
    """Return the constants of an adapter, read without running it; MissingError if it has no RUNGS."""
    found: dict[str, Any] = {"NEEDS": ()}
    for node in ast.parse(adapter.read_text()).body:
        if not isinstance(node, ast.Assign | ast.AnnAssign) or node.value is None:
            continue
        target = node.targets[0] if isinstance(node, ast.Assign) else node.target
        if isinstance(target, ast.Name) and target.id in ("NEEDS", "RUNGS"):
            found[target.id] = ast.literal_eval(node.value)
    if "RUNGS" not in found:
        raise MissingError(f"{adapter} has no RUNGS")
    return found


def environment(code: str, needs: tuple[str, ...], source: str | None) -> tuple[str, str]:
    """Return the interpreter of a code, made if need be, and the folder of its source to be read, or "".

    `source` is a git address or a folder. What pip can install is installed, the rest is told the adapter.

    Raises
    ------
    MissingError
        pip or git did not end well.
    """
    if not needs:
        return sys.executable, ""
    folder = MADE / code
    python = folder / "bin" / "python"
    complete = folder / "complete"  # an installation that was broken off is begun anew
    if not complete.exists():
        venv.create(folder, with_pip=True, clear=True)
        _ran([str(python), "-m", "pip", "install", "--quiet", *needs])
        complete.touch()
    if source is None:
        return str(python), ""
    place = Path(source)
    if not place.exists():
        place = folder / "source"
        if not place.exists():
            _ran(["git", "clone", "--quiet", "--depth", "1", source, str(place)])
    if any((place / name).exists() for name in ("pyproject.toml", "setup.py")):
        _ran([str(python), "-m", "pip", "install", "--quiet", str(place)])
        return str(python), ""
    return str(python), str(place.resolve())


def _ran(command: list[str]) -> None:
    done = subprocess.run(command, capture_output=True, text=True, check=False)
    if done.returncode != 0:
        raise MissingError(f"`{' '.join(command)}`: {(done.stderr.strip().splitlines() or ['failed'])[-1]}")


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


def run(
    code: str, cases: list[str] | tuple[str, ...], *, source: str | None = None, seconds: float = 60.0
) -> int:
    """Let a code answer cases and keep its scores; 1 if it cannot run."""
    adapter = (ADAPTERS / f"{code}.py" if code in codes() else Path(code)).resolve()
    if not adapter.is_file():
        print(f"no adapter {code!r}: there is no file {adapter}; there are {', '.join(sorted(codes()))}")
        return 1
    try:
        wants = told(adapter)
        python, folder = environment(adapter.stem, wants["NEEDS"], source)
    except MissingError as error:
        print(f"{code} cannot run here: {error}")
        return 1
    if not fence.offered():
        print("no Landlock here: the adapter has no answers beside it, but could look for them on the disk")
    known = answered()
    process, scores = Code(adapter, seconds, python, folder), kept(adapter.stem)
    try:
        for name in (name for name in cases if name in known):
            scores[name] = one(process, name, wants["RUNGS"], seconds)
            print(f"{name:24s} {words(scores[name])}", flush=True)
            if adapter.parent == ADAPTERS:
                RESULTS.mkdir(exist_ok=True)
                (RESULTS / f"{code}.json").write_text(json.dumps(scores, indent=0) + "\n")
    finally:
        process.close()
    return 0


def answered() -> list[str]:
    """Return the cases that have an answer."""
    return [name for name in names() if (HERE / "answers" / f"{name}.json").exists()]


def codes() -> list[str]:
    """Return the codes that have an adapter."""
    return [path.stem for path in ADAPTERS.glob("*.py") if path.stem != "protocol"]


def kept(code: str) -> dict[str, list[Score]]:
    """Return the scores of earlier runs."""
    place = RESULTS / f"{code}.json"
    return dict(json.loads(place.read_text())) if place.exists() else {}


def one(process: Code, name: str, rungs: list[dict[str, Any]], seconds: float) -> list[Score]:
    """Climb the rungs of a code with one case, until one takes too long.

    Every rung is asked in several scales: the first may still have to load or compile, the least time counts,
    and the worst answer.
    """
    case, answer = load(name), json.loads((HERE / "answers" / f"{name}.json").read_text())
    known, found = float(answer["value"]), list[Score]()
    for rung in rungs:
        tries = list[Score]()
        for power in random.sample(POWERS, TRIES):
            asked, by = scaled(case, 2.0**power)
            tries.append(again := process.ask(asked, rung))
            again |= {key: again[key] / by for key in ("value", "estimate") if again.get(key) is not None}
            if "value" not in again or again["seconds"] > AGAIN_BELOW * seconds:
                break
        worst = max(tries, key=lambda one: abs(one["value"] - known) if "value" in one else math.inf)
        score = {"rung": rung, **worst, "seconds": min(one.get("seconds", math.inf) for one in tries)}
        if "value" not in score:
            del score["seconds"]
        else:
            error = abs(score["value"] - known)
            score["digits"] = digits(error, answer)
            if score["estimate"] is not None:
                score["covered"] = covers(error, score["estimate"], answer)
        found.append(score)
        if (
            "not_offered" in score
            or "no answer" in score.get("failed", "")
            or score.get("seconds", 0.0) > seconds
        ):
            break
    # What one rung does not offer another may: it says nothing if others answered.
    return [score for score in found if "not_offered" not in score] or found


def cap(answer: dict[str, Any]) -> float:
    """Return the digits in which an answer is known: all of a double if enclosed, else those agreed."""
    return MOST if answer.get("enclosure") else float(answer["agreed_digits"])


def digits(error: float, answer: dict[str, Any]) -> float:
    """Return the right digits of a value, at most those of the answer."""
    if not math.isfinite(error):
        return 0.0
    known = abs(float(answer["value"]))
    return round(max(0.0, min(cap(answer), -math.log10(max(error / known, 1e-16)))), 2)


def covers(error: float, estimate: float, answer: dict[str, Any]) -> bool:
    """Tell whether an error is within a code's own estimate, rounding and the answer's own digits apart."""
    known = abs(float(answer["value"]))  # an estimate as large as the value says nothing
    return bool(0.0 <= estimate < known and error <= estimate + (10.0 ** -cap(answer) + 4e-15) * known)


def best(scores: list[Score]) -> Score | None:
    """Return the score of most digits, of the cheapest among equals."""
    solved = [score for score in scores if "digits" in score]
    return max(solved, key=lambda one: (one["digits"], -one.get("seconds", math.inf)), default=None)


def words(scores: list[Score]) -> str:
    """Return a case's scores as one cell: digits and seconds of the best, or what went wrong."""
    top = best(scores)
    if top is None:
        if not scores:
            return "not run"
        last = scores[-1]
        return f"– {last['not_offered']}" if "not_offered" in last else f"failed: {last['failed']}"
    wrong = sum("failed" in score for score in scores)
    told_ = f"{top['digits']:.1f}" + (f" in {_time(top['seconds'])}" if "seconds" in top else ", not timed")
    return told_ + (f", {wrong} of {len(scores)} failed" if wrong else "")


def _time(seconds: float) -> str:
    return f"{1e3 * seconds:.3g} ms" if seconds < 1.0 else f"{seconds:.3g} s"


def cheapest(scores: list[Score], wanted: float) -> float | None:
    """Return the least seconds in which so many digits were reached."""
    return min(
        (one["seconds"] for one in scores if "seconds" in one and one.get("digits", -1.0) >= wanted),
        default=None,
    )


def summary() -> dict[str, Any]:
    """Return what the page says in words: cases covered, cases with 8 digits, where a peer is faster."""
    ours, rivals = kept("stickslip"), [code for code in codes() if code != "stickslip" and kept(code)]
    judged = [(name, one) for name, scores in ours.items() for one in scores if "covered" in one]
    slower = []
    for code in rivals:
        for name, scores in kept(code).items():
            top = best(scores)
            if top is not None and top["digits"] >= 2.0 and "seconds" in top:
                mine = cheapest(ours.get(name, []), top["digits"])
                if mine is None or mine > top["seconds"]:
                    slower.append((name, code, top["digits"], top["seconds"], mine))
    tops = {name: best(scores) for name, scores in ours.items()}
    return {
        "answered": sum(top is not None for top in tops.values()), "cases": len(tops),
        "covered": sum(one["covered"] for _, one in judged), "judged": len(judged),
        "missed": sorted({name for name, one in judged if not one["covered"]}),
        "eight": sum(top is not None and top["digits"] >= 8.0 for top in tops.values()), "slower": slower,
        "offered": {code: sum(best(s) is not None for s in kept(code).values()) for code in rivals},
        "failed": {
            code: sum(all("failed" in one for one in s) for s in kept(code).values()) for code in rivals
        },
    }  # fmt: skip


def page() -> str:
    """Write table and picture into the documentation; return where."""
    from benchmarks.frictionbench.page import write

    return write()


def archive(out: str) -> str:
    """Write cases, answers, schema and a citation file into an archive; return its name."""
    with zipfile.ZipFile(out, "w", zipfile.ZIP_DEFLATED) as made:
        for place in sorted(HERE.glob("*/*.*")):
            if place.parent.name in ("cases", "answers", "proofs"):
                made.write(place, f"frictionbench/{place.parent.name}/{place.name}")
        made.write(Path(checker.__file__), "frictionbench/checker.py")
        for name in ("case.schema.json", "CITATION.cff", "README.md"):
            made.write(HERE / name, f"frictionbench/{name}")
        made.write(ADAPTERS / "protocol.py", "frictionbench/protocol.py")  # as they lie beside an adapter
        made.write(HERE / "model.py", "frictionbench/benchmarks/frictionbench/model.py")
    return out
