"""What users see of the product, as text that is the same on every machine."""

from __future__ import annotations

import contextlib
import io
import json
import math
import os
import re
from collections.abc import Iterable, Iterator, Mapping
from difflib import SequenceMatcher
from itertools import groupby
from pathlib import Path
from typing import Any
from unittest.mock import patch

from service.cli import main
from service.cli.study_command import Outputs
from service.cli.table import command
from tests.golden.golden_cases import MEASURED, SHIPPED, Case, own_scenes

DATA = Path(__file__).parent / "data"
DIGITS = 4
NOISE = 1e-15  # what is rounding alone differs from run to run
_FEW = 6
_LINE = 110
# What another step control, processor or clock would change: it is looked at elsewhere.
_COUNTED = re.compile(
    r"seconds|time|error|residual|iterations|rejected|points|evaluations|responses|work|effort|pareto|"
    r"closed form|[0-9#] samples|exact(?=  )"
)
_WAY = re.compile(r"closed form|# samples|exact(?=  )")  # which of them pays, the clock decides
_DURATION = re.compile(r"# (?:µs|ms|s|min)\b")
_NUMBER = re.compile(r"[-+]?(?:\d+\.?\d*|\.\d+)(?:e[-+]?\d+)?")
# Its unit is that of its size, which rounding decides.
_ERROR = re.compile(rf"(± |estimated error  ){_NUMBER.pattern}(?: [nµm]?m\b)?")


def asked(*words: str) -> tuple[int, str, str]:
    """Run the command in this process: its status, and what it printed and said."""
    out, said = io.StringIO(), io.StringIO()
    with (
        contextlib.redirect_stdout(out), contextlib.redirect_stderr(said),
        patch.dict(os.environ, {"COLUMNS": str(_LINE), "NO_COLOR": "1"}),
    ):  # fmt: skip
        status = main(words)
    return status, out.getvalue(), said.getvalue()


def rounded(value: Any, key: str = "") -> Any:
    """JSON without what clocks and step control decide: of long lists their kind and their range alone."""
    if isinstance(value, Mapping):
        return {name: rounded(one, name) for name, one in value.items()}
    if isinstance(value, list):
        if len(value) > _FEW and all(isinstance(one, int | float | None) for one in value):
            return _range([one for one in value if one is not None], key)
        return [rounded(one, key) for one in value[:_FEW]]
    if not isinstance(value, int | float):
        return value
    if _COUNTED.search(key) or (isinstance(value, float) and abs(value) < 1e-12):
        return "a number"
    return value if isinstance(value, bool | int) else float(f"{value:.{DIGITS}g}")


def _range(numbers: list[float], key: str) -> Any:
    if _COUNTED.search(key) or not numbers:
        return ["numbers"]
    return ["numbers", *(rounded(float(one)) for one in (min(numbers), max(numbers)))]


def plain(text: str) -> str:
    """What is printed, with single gaps, and a # for every number that clocks and step control decide."""
    lines = []
    for line in text.splitlines():
        line = re.sub(r" {2,}", "  ", line.rstrip())
        line = _ERROR.sub(r"\1#", line)
        told = _DURATION.sub("# s", _NUMBER.sub("#", line)) if _COUNTED.search(line) else line
        lines.append(_WAY.sub("way", told).lstrip("* ") if _WAY.search(told) else told)
    return "\n".join(line for line, _ in groupby(lines))


def differences(wanted: str, got: str) -> list[str]:
    """Lines that differ: words exactly, numbers by more than they were rounded."""
    old, new = wanted.splitlines(), got.splitlines()
    found: list[str] = []
    for how, a, b, c, d in SequenceMatcher(None, old, new, autojunk=False).get_opcodes():
        if how == "replace" and b - a == d - c and all(map(_same, old[a:b], new[c:d])):
            continue
        if how != "equal":
            found += [*(f"- {line}" for line in old[a:b]), *(f"+ {line}" for line in new[c:d])]
    return found


def _same(wanted: str, got: str) -> bool:
    if wanted == got:
        return True
    if _NUMBER.sub("#", wanted) != _NUMBER.sub("#", got):
        return False
    pairs = zip(_NUMBER.findall(wanted), _NUMBER.findall(got), strict=True)
    return all(
        math.isclose(float(a), float(b), rel_tol=2 * 10 ** (1 - DIGITS), abs_tol=NOISE) for a, b in pairs
    )


class Studies:
    """Runs the commands of the studies in a folder of scenes."""

    def __init__(self, folder: Path) -> None:
        self._folder = folder
        for name, scene in own_scenes().items():
            (folder / f"{name}.json").write_text(json.dumps(scene.to_dict()))
        (folder / "data.csv").write_text(MEASURED)

    def _words(self, case: Case) -> list[str]:
        scene = case.scene if case.scene in SHIPPED else str(self._folder / f"{case.scene}.json")
        return case.words.replace("SCENE", scene).replace("DATA", str(self._folder / "data.csv")).split()

    def answer(self, case: Case) -> str:
        """Status, JSON, summary and columns of the data set of a study, a line for each key."""
        results: list[Any] = []

        def written(_self: Outputs, result: Any, *_: object, **__: object) -> None:
            results.append(result)

        with patch.object(Outputs, "write", written):
            status, out, said = asked(*self._words(case), "--json")
        lines = [f"exit {status}", *plain(said).splitlines()]
        if out:
            told = rounded(json.loads(out))
            lines += [f"  {key}: {json.dumps(value, ensure_ascii=False)}" for key, value in told.items()]
        for result in results:
            pairs = ((name, value) for name, value in result.summary().pairs)
            told_pairs = plain("\n".join(f"{name}: {value}" for name, value in pairs))
            lines += [f"  summary {line}" for line in told_pairs.splitlines()]
            data = result.to_dataset()
            lines += [
                f"  column {name} ({', '.join(one.dims)}) [{one.unit}] {one.about}"
                for name, one in data.variables.items()
            ]
            lines.append(f"  attributes {', '.join(data.attributes)}")
        return "\n".join(lines)

    def table(self, case: Case) -> str:
        """Status and the table that a terminal shows."""
        status, out, said = asked(*self._words(case))
        return f"exit {status}\n{plain(out + said)}"


def paths() -> Iterator[tuple[str, ...]]:
    """The words that lead to every command."""
    yield from _below(command())


def _below(group: Any, *before: str) -> Iterator[tuple[str, ...]]:
    yield before
    if hasattr(group, "list_commands"):
        context = group.make_context("", [], resilient_parsing=True)
        for name in group.list_commands(context):
            yield from _below(group.resolve_command(context, [name])[1], *before, name)


def helped(words: Iterable[str]) -> str:
    """What `--help` prints of a command."""
    return asked(*words, "--help")[1].rstrip()


def sections(text: str) -> dict[str, str]:
    """The parts of a golden file by their headings."""
    found = re.split(r"^== (.*)\n", text, flags=re.MULTILINE)
    return {name: part.rstrip("\n") for name, part in zip(found[1::2], found[2::2], strict=True)}


def joined(parts: Mapping[str, str]) -> str:
    """A golden file of its parts."""
    return "".join(f"== {name}\n{part}\n\n" for name, part in parts.items())
