"""The page of FrictionBench in the documentation: one table, one picture."""

from __future__ import annotations

import json
from typing import Any

from benchmarks.frictionbench import scorer
from benchmarks.frictionbench.model import HERE, load, names

DOCS = HERE.parents[1] / "docs"
COLOURS = {"stickslip": "#0b6e99", "tmdsimpy": "#c2571a", "pyharm": "#7a8f2a", "nlvib": "#7b4fa3"}
HEAD = """# FrictionBench

{cases} answered cases of friction damping in one neutral schema, and what codes make
of them. Cases, answers, schema and [how to add a code](../benchmarks/frictionbench/README.md#add-a-code)
are in `benchmarks/frictionbench`; `python -m benchmarks.frictionbench archive` packs them.

Answers come by two ways: a closed form, or exact events in balls of 128 and more bits
with an enclosure (`proofs.py`), and harmonic balance at H, 2H, 4H … harmonics, extrapolated; where these
agree in fewer than ten digits, time marching too. {proved} answers have a proof in `proofs/`:
`python solver/certificate/checker.py FILE` shows anew that the orbit exists, that it obeys every law of its
contacts and how high it is, and needs nothing but python-flint. Losses are read off orbits that are
enclosed alike. Rigid friction has no balance: a closed form or exact events in floats stand beside its
proof. Of {cases} answers {ten} agree to ten digits or more; the column *known*
says to how many, *1 way* where there is but one. A limit in the form of a circle is not piecewise linear:
there time marching stands for the events. The balance is this project's. A disk is solved and proved as
the part of its annulus that the wave repeats after.

Each code climbs its own rungs (harmonics, samples) from cheap to dear, in a process with one thread,
warm; a cell is the most right digits and the processor time of that rung. Other codes' adapters ask for
single responses alone: a dash says what an adapter or its code does not offer, which is not a failure.
Runs that a busy machine did not let end are left out: of NLvib under Octave the dear rungs, of pyHarm, which
compiles for long, all.

{words}

{without}

![Right digits over processor time of every rung of every case.](img/frictionbench.png)

"""


def write() -> str:
    """Write docs/frictionbench.md and its picture; return the page's name."""
    codes = [code for code in COLOURS if scorer.kept(code)]
    scores = {code: scorer.kept(code) for code in codes}
    answers = {
        name: json.loads((HERE / "answers" / f"{name}.json").read_text()) for name in scorer.answered()
    }
    ten = sum(one["ways"] > 1 and one["agreed_digits"] >= 10.0 for one in answers.values())
    proved = len(list((HERE / "proofs").glob("*.json")))
    lines = [
        HEAD.format(
            cases=len(answers), ten=ten, proved=proved, without=_without(), words=_words(scorer.summary())
        )
    ]
    ladder = ""
    for name, answer in answers.items():
        case = load(name)
        if case["ladder"] != ladder:
            ladder = case["ladder"]
            lines.append(
                f"\n## {ladder[0].upper()}{ladder[1:]}\n\n"
                f"| case | what | answer | known | {' | '.join(codes)} |\n"
                f"|---|---|---|---|{'---|' * len(codes)}\n"
            )
        cells = [scorer.words(scores[code].get(name, [])).replace("|", "/") for code in codes]
        known = f"{answer['agreed_digits']:.1f}" if answer["ways"] > 1 else "1 way"
        lines.append(
            f"| `{name}` | {case['words']} | {float(answer['value']):.10g} | {known} "
            f"| {' | '.join(cells)} |\n"
        )
    (DOCS / "frictionbench.md").write_text("".join(lines))
    _picture(scores)
    return str(DOCS / "frictionbench.md")


def _without() -> str:
    missing = [f"`{name}`" for name in names() if name not in scorer.answered()]
    return f"Cases that have no answer yet: {', '.join(missing)}." if missing else ""


def _words(told: dict[str, Any]) -> str:
    lines = [
        f"stickslip answers {told['answered']} of {told['cases']} cases it was run on, "
        f"{told['eight']} of them to eight "
        f"digits or more; {told['covered']} of {told['judged']} answers of all rungs are within its own "
        "error estimate"
        + (
            f" (the others are rungs of {', '.join(f'`{name}`' for name in told['missed'])})."
            if told["missed"]
            else "."
        )
    ]
    for code, offered in told["offered"].items():
        lines.append(f"{code} answers {offered} cases and fails in all rungs of {told['failed'][code]}.")
    for name, code, right, theirs, mine in told["slower"]:
        ours = "stickslip does not reach that" if mine is None else f"stickslip takes {1e3 * mine:.3g} ms"
        lines.append(f"In `{name}` {code} has {right:.1f} digits after {1e3 * theirs:.3g} ms, {ours}.")
    if told["offered"] and not told["slower"]:
        lines.append("No other code reaches its digits sooner than stickslip does, in any case.")
    return " ".join(lines)


def _picture(scores: dict[str, Any]) -> None:
    from matplotlib.figure import Figure

    figure = Figure(figsize=(8.0, 4.5), layout="constrained")
    axes = figure.subplots()
    for code, cases in scores.items():
        points = [
            (one["seconds"], one["digits"]) for rungs in cases.values() for one in rungs if "digits" in one
        ]
        if points:
            x, y = zip(*points, strict=True)
            axes.plot(x, y, "o", ms=4, alpha=0.6, color=COLOURS[code], label=f"{code}, {len(points)}")
    axes.set(xscale="log", xlabel="processor time [s]", ylabel="right digits", ylim=(0, 16.5))
    axes.grid(alpha=0.3)
    axes.legend(loc="lower right")
    figure.savefig(DOCS / "img" / "frictionbench.png", dpi=110)
