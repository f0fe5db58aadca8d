"""FrictionBench: cases of friction damping with answers to ten digits, and a score of any code."""

from __future__ import annotations

import argparse
import json
import sys

from benchmarks.frictionbench.model import HERE, names


def main(arguments: list[str] | None = None) -> int:
    """Run one of the commands; 1 if answers do not hold."""
    parser = argparse.ArgumentParser(prog="python -m benchmarks.frictionbench", description=__doc__)
    commands = parser.add_subparsers(dest="command", required=True)
    recompute = commands.add_parser("answers", help="compute answers anew by every way")
    run = commands.add_parser("run", help="score a code")
    run.add_argument("--code", required=True, help="a file of adapters/, without its ending")
    run.add_argument("--source", help="git address or folder of a code that is not installed by its name")
    run.add_argument("--seconds", type=float, default=60.0, help="processor time a case may take")
    commands.add_parser("table", help="table, picture and page of what was run")
    archive = commands.add_parser("archive", help="cases and answers as an archive with a citation file")
    archive.add_argument("--out", default="frictionbench.zip")
    for one in (recompute, run):
        one.add_argument("--case", action="append", help="names; all if left out")
    asked = parser.parse_args(arguments)
    if asked.command == "answers":
        return _answers(asked.case or names())
    from benchmarks.frictionbench import scorer

    if asked.command == "run":
        return scorer.run(asked.code, asked.case or names(), source=asked.source, seconds=asked.seconds)
    print(scorer.page() if asked.command == "table" else scorer.archive(asked.out))
    return 0


def _answers(asked: list[str] | tuple[str, ...]) -> int:
    from benchmarks.frictionbench import answers

    poor = 0
    for name in asked:
        try:
            found = answers.recompute(name)
        except Exception as error:  # noqa: BLE001 - the others are computed all the same
            print(f"{name:24s} {type(error).__name__}: {error}", flush=True)
            poor += 1
            continue
        if (proof := found.pop("proof")) is not None:
            (HERE / "proofs" / f"{name}.json").write_text(json.dumps(proof) + "\n")
        answers.path(name).write_text(json.dumps(found, indent=1) + "\n")
        poor += found["agreed_digits"] < answers.WANTED
        seconds = {way: one["seconds"] for way, one in found["by"].items()}
        print(
            f"{name:24s} {found['value']:24s} {found['ways']} ways, {found['agreed_digits']:4.1f} digits "
            f"{seconds} {found.get('not_by', '')}",
            flush=True,
        )
    return 1 if poor else 0


if __name__ == "__main__":
    sys.exit(main())
