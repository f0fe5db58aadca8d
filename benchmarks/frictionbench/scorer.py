"""Scores of codes: digits against processor seconds, case by case; what fails is shown as it is."""

from __future__ import annotations

import ast
import json
import math
import random
import subprocess
import sys
import venv
import zipfile
from pathlib import Path
from typing import Any

from benchmarks.frictionbench import fence
from benchmarks.frictionbench.asking import ADAPTERS, ROOT, Code, Score, scaled
from benchmarks.frictionbench.model import HERE, load, names
from stickslip.lab.proofs import checker

RESULTS, MADE = HERE / "results", ROOT / ".frictionbench"
MOST = 15.6  # digits of a double
POWERS, TRIES = range(-4, 5), 3  # of 2, the scales a rung is asked in; in how many of them
AGAIN_BELOW = 0.2  # of the time a case may take, above which it is asked once


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
