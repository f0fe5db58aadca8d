"""What `make test` runs is decided by recorded costs: of tests that there are, few minutes in sum."""

from __future__ import annotations

import ast
from pathlib import Path

from tests.tiers import FLOWS, is_quick, recorded

ROOT = Path(__file__).parents[2]
QUICK_SECONDS = 250.0


def test_what_is_recorded_is_a_test_and_the_quick_ones_take_four_minutes() -> None:
    costs = recorded()
    assert costs, "`make test-all COSTS=1` writes tests/costs.json"
    files = {function.partition("::")[0] for function in (*costs, *FLOWS)}
    there = {f"{file}::{name}" for file in files for name in functions_of(ROOT / file)}
    assert sorted({*costs, *FLOWS} - there) == [], "moved or gone: rename them in tests/costs.json"
    assert sum(seconds for name, seconds in costs.items() if is_quick(name, costs)) <= QUICK_SECONDS


def functions_of(path: Path) -> list[str]:
    if not path.exists():
        return []
    body = ast.parse(path.read_text(encoding="utf-8")).body
    return [node.name for node in body if isinstance(node, (ast.FunctionDef, ast.AsyncFunctionDef))]
