"""The page of FrictionBench: one table, one picture."""

from __future__ import annotations

import json
from typing import Any

from benchmarks.frictionbench import scorer
from benchmarks.frictionbench.model import HERE, load, names

DOCS = HERE.parents[1] / "docs"
COLOURS = {"stickslip": "#0b6e99", "tmdsimpy": "#c2571a", "pyharm": "#7a8f2a", "nlvib": "#7b4fa3"}
HEAD = """# FrictionBench

{cases} answered cases of friction damping in one neutral schema, and what codes make
of them. Cases, answers, schema and [how to add a code](README.md#add-a-code)
are in `benchmarks/frictionbench`; `python -m benchmarks.frictionbench archive` packs them.

Answers come by two ways: a closed form, or exact events in balls of 128 and more bits
with an enclosure (`proofs.py`), and harmonic balance at H, 2H, 4H … harmonics, extrapolated; where these
agree in fewer than ten digits, time marching too. {proved} answers have a proof in `proofs/`:
`python stickslip/lab/proofs/checker.py FILE` shows anew that the orbit exists, that it obeys every law of its
contacts and how high it is, and needs nothing but python-flint. Losses are read off orbits that are
enclosed alike. Rigid friction has no balance: a closed form or exact events in floats stand beside its
proof. Of {cases} answers {ten} agree to ten digits or more; the column *known*
says to how many, *1 way* where there is but one. A limit in the form of a circle is not piecewise linear:
there time marching stands for the events. The balance is this project's. A disk is solved and proved as
the part of its annulus that the wave repeats after.

The column *largest multiplier* is the modulus of the largest Floquet multiplier of the orbit, of a peak's
at the peak: below 1 motions beside it come back. With a proof it lies between two bounds that are proved
like the orbit (`multipliers.py`, monodromy of the exact events in balls; both are in `answers/`, and agree
in the digits shown or in all but the last); *≈* is an estimate in floats, and the single multipliers in
`answers/` are estimates. *+ n* counts contacts that stick all the time: each keeps a residual force, a
multiplier of 1 exactly, along which nothing grows or dies out. Of a disk it is that of the part the wave
repeats after; a march, of the whole annulus, ends in the answer too. {repel} are asked for as what they
are, amplitudes up to which free motions stay; every other answer of an orbit attracts. Answers of one
harmonic by definition have no orbit (—).

An adapter runs in a process of its own, in an empty folder with copies of itself and of what turns a case
into matrices, and without the environment of who runs it. Questions and answers go through pipes; answers,
proofs, scores and this page are in no folder it is given, and where Linux has Landlock it can open nothing
outside its folder, the system, its interpreter and packages, and has no TCP. Elsewhere the run says that it
could search the disk. Nothing keeps an adapter from having answers written into itself: it can be read. It
takes its own time no more: a cell is the processor time of its process and of all it started, read from
outside, and what a rung costs is the least of some tries, each in another scale of forces and motions (a
power of 2, which changes no digit), of which the worst answer counts. An adapter's `estimate` is its claim
and gives no digits; one as large as the answer covers nothing.

Each code climbs its own rungs (harmonics, samples) from cheap to dear, with one thread, warm; a cell is the
most right digits and the time of that rung, in which reading the question is. Other codes' adapters ask for
single responses alone: a dash says what an adapter or its code does not offer, which is not a failure. *Not
timed* are runs before times were taken from outside. Runs that a busy machine did not let end are left out:
of NLvib under Octave the dear rungs, of pyHarm, which compiles for long, all.

{words}

{without}

![Right digits over processor time of every rung of every case.](../../docs/img/frictionbench.png)

"""


def write() -> str:
    """Write table.md and its picture; return the page's name."""
    codes = [code for code in COLOURS if scorer.kept(code)]
    scores = {code: scorer.kept(code) for code in codes}
    answers = {
        name: json.loads((HERE / "answers" / f"{name}.json").read_text()) for name in scorer.answered()
    }
    ten = sum(one["ways"] > 1 and one["agreed_digits"] >= 10.0 for one in answers.values())
    proved = len(list((HERE / "proofs").glob("*.json")))
    lines = [
        HEAD.format(
            cases=len(answers),
            ten=ten,
            proved=proved,
            without=_without(),
            repel=_repelling(answers),
            words=_words(scorer.summary()),
        )
    ]
    ladder = ""
    for name, answer in answers.items():
        case = load(name)
        if case["ladder"] != ladder:
            ladder = case["ladder"]
            lines.append(
                f"\n## {ladder[0].upper()}{ladder[1:]}\n\n"
                f"| case | what | answer | known | largest multiplier | {' | '.join(codes)} |\n"
                f"|---|---|---|---|---|{'---|' * len(codes)}\n"
            )
        cells = [scorer.words(scores[code].get(name, [])).replace("|", "/") for code in codes]
        known = f"{answer['agreed_digits']:.1f}" if answer["ways"] > 1 else "1 way"
        lines.append(
            f"| `{name}` | {case['words']} | {float(answer['value']):.10g} | {known} | {_multiplier(answer)} "
            f"| {' | '.join(cells)} |\n"
        )
    (HERE / "table.md").write_text("".join(lines))
    _picture(scores)
    return str(HERE / "table.md")


def _multiplier(answer: dict[str, Any]) -> str:
    """Return the modulus of the largest multiplier, and how many contacts stick all the time."""
    found = answer["multipliers"]
    if isinstance(found, str):
        return "—"
    neutral = f" + {count}" if (count := len(found["neutral"])) else ""
    if "largest" not in found:
        return f"≈ {abs(complex(*found['estimates'][0])):.4g}{neutral}"
    low, high = map(float, found["largest"])
    return f"{(low + high) / 2:.5g}{neutral}"


def _without() -> str:
    missing = [f"`{name}`" for name in names() if name not in scorer.answered()]
    return f"Cases that have no answer yet: {', '.join(missing)}." if missing else ""


def _repelling(answers: dict[str, Any]) -> str:
    return " and ".join(f"`{name}`" for name, one in answers.items() if one["attracts"] is False)


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
        lines.append(
            "No other code that was timed reaches its digits sooner than stickslip does, in any case."
        )
    return " ".join(lines)


def _picture(scores: dict[str, Any]) -> None:
    from matplotlib.figure import Figure

    figure = Figure(figsize=(8.0, 4.5), layout="constrained")
    axes = figure.subplots()
    for code, cases in scores.items():
        points = [
            (one["seconds"], one["digits"])
            for rungs in cases.values()
            for one in rungs
            if "digits" in one and "seconds" in one
        ]
        if points:
            x, y = zip(*points, strict=True)
            axes.plot(x, y, "o", ms=4, alpha=0.6, color=COLOURS[code], label=f"{code}, {len(points)}")
    axes.set(xscale="log", xlabel="processor time [s]", ylabel="right digits", ylim=(0, 16.5))
    axes.grid(alpha=0.3)
    axes.legend(loc="lower right")
    figure.savefig(DOCS / "img" / "frictionbench.png", dpi=110)
