"""Which tests run when: the cheap ones by recorded cost, all but the long, a part of the long.

What a function costs is measured by `make test-all COSTS=1` and kept in `costs.json`; nothing else says which
tests are quick. A function without an entry is new, and runs.
"""

import json
import time
import zlib
from collections import Counter, defaultdict
from collections.abc import Collection, Generator
from pathlib import Path
from typing import Any

import pytest

COSTS = Path(__file__).with_name("costs.json")
DEAR_SECONDS = 0.5
"""What costs more is left to `make test-all`."""
FLOWS = (
    "tests/page/test_page_answer.py::test_the_first_screen_holds_the_answer",
    "tests/service/test_queue.py::test_a_killed_worker_costs_an_attempt_and_the_job_is_done_once",
    "tests/service/test_postgresql.py::test_a_server_that_restarts_is_found_again",
)
"""Dear ones that are quick all the same: the page, a killed worker, PostgreSQL."""


def pytest_addoption(parser: pytest.Parser) -> None:
    """All long tests take ten hours; a tenth of each function's cases, in turn, takes one."""
    parser.addoption(
        "--tier",
        choices=("quick", "rest", "all"),
        default="all",
        help="quick: the first case of each cheap function; rest: the others",
    )
    parser.addoption(
        "--costs", action="store_true", help="write what each function costs to tests/costs.json"
    )
    parser.addoption("--part", type=_part, metavar="K/N", help="of the long tests the K-th of N parts alone")


def _part(text: str) -> tuple[int, int]:
    number, _, parts = text.partition("/")
    if not (number.isdecimal() and parts.isdecimal() and 1 <= int(number) <= int(parts)):
        raise ValueError(text)  # argparse words it
    return int(number), int(parts)


def recorded() -> dict[str, float]:
    """Seconds a test function costs, by `file::name`."""
    costs: dict[str, float] = json.loads(COSTS.read_text(encoding="utf-8")) if COSTS.exists() else {}
    return costs


def is_quick(function: str, costs: dict[str, float]) -> bool:
    return costs.get(function, 0.0) <= DEAR_SECONDS or function in FLOWS


def function_of(item: pytest.Item) -> str:
    return item.nodeid.partition("[")[0]


class Tiers:
    """Chooses what is collected."""

    def __init__(self, config: pytest.Config) -> None:
        self.tier = config.getoption("--tier")
        self.number, self.parts = config.getoption("--part") or (1, 1)
        self.costs = recorded()
        self.of_file: dict[str, list[str]] = defaultdict(list)
        for function in self.costs:
            self.of_file[function.partition("::")[0]].append(function)

    def pytest_ignore_collect(self, collection_path: Path, config: pytest.Config) -> bool | None:
        """For the quick ones a file all whose functions are dear is not even imported."""
        if self.tier != "quick":
            return None
        known = self.of_file.get(collection_path.relative_to(config.rootpath).as_posix())
        return True if known and not any(is_quick(function, self.costs) for function in known) else None

    @pytest.hookimpl(tryfirst=True)
    def pytest_collection_modifyitems(self, config: pytest.Config, items: list[pytest.Item]) -> None:
        """Of the cases of a function marked `few` every n-th runs and those to keep; the others are long.

        With `--part` the long cases of a function are dealt out to the parts one after the other, beginning
        with a part that its name decides: each part has its share of every function.
        """
        seen: Counter[str] = Counter()
        dealt: Counter[str] = Counter()
        first: set[str] = set()
        left = []
        for item in items:
            function = function_of(item)
            if few := item.get_closest_marker("few"):
                kept = bool(few.args) and seen[function] % few.args[0] == 0
                seen[function] += 1
                if not kept and not _named(item, few.kwargs.get("keep", ())):
                    item.add_marker(pytest.mark.long)
            if item.get_closest_marker("long"):
                if (zlib.crc32(function.encode()) + dealt[function] - self.number) % self.parts:
                    left.append(item)
                dealt[function] += 1
            elif self.tier != "all":
                quick = function not in first and is_quick(function, self.costs)
                if quick is not (self.tier == "quick"):
                    left.append(item)
                first.add(function)
        if left:
            config.hook.pytest_deselected(items=left)
            others = set(left)
            items[:] = [item for item in items if item not in others]


def _named(item: pytest.Item, keep: Collection[object]) -> bool:
    """Whether a value that a case has is one of those to keep."""
    values = item.callspec.params.values() if isinstance(item, pytest.Function) else ()
    return any(value in keep for value in values if isinstance(value, str | int | float))


class Costs:
    """Measures what the first case of each function costs, with its share of what is set up for several."""

    def __init__(self) -> None:
        self.own: dict[str, float] = {}
        self.shared: Counter[str] = Counter()
        self.users: dict[str, set[str]] = defaultdict(set)
        self.nested = 0.0
        """Seconds of shared fixtures within what is being measured."""

    @pytest.hookimpl(wrapper=True)
    def pytest_fixture_setup(self, fixturedef: Any) -> Generator[None, object, object]:
        before, self.nested = self.nested, 0.0
        begin = _seconds()
        try:
            return (yield)
        finally:
            spent = _seconds() - begin
            name = f"{fixturedef.baseid}::{fixturedef.argname}"
            if fixturedef.scope == "function":
                self.nested += before
            else:
                self.shared[name] += spent - self.nested
                self.nested = before + spent

    @pytest.hookimpl(wrapper=True)
    def pytest_runtest_setup(self, item: pytest.Item) -> Generator[None, object, object]:
        return (yield from self._measured(item))

    @pytest.hookimpl(wrapper=True)
    def pytest_runtest_call(self, item: pytest.Item) -> Generator[None, object, object]:
        return (yield from self._measured(item))

    def _measured(self, item: pytest.Item) -> Generator[None, object, object]:
        self.nested, begin = 0.0, _seconds()
        try:
            return (yield)
        finally:
            item.stash[_SPENT] = item.stash.get(_SPENT, 0.0) + _seconds() - begin - self.nested

    def pytest_runtest_teardown(self, item: pytest.Function) -> None:
        function = function_of(item)
        self.own.setdefault(function, item.stash.get(_SPENT, 0.0))
        for name, definitions in item._fixtureinfo.name2fixturedefs.items():
            self.users[f"{definitions[-1].baseid}::{name}"].add(function)

    @pytest.hookimpl(optionalhook=True)
    def pytest_testnodedown(self, node: Any, error: object | None) -> None:
        """What a worker measured."""
        if error is None:
            self.own.update(node.workeroutput["own"])
            self.shared.update(node.workeroutput["shared"])
            for name, functions in node.workeroutput["users"].items():
                self.users[name] |= set(functions)

    def pytest_sessionfinish(self, session: pytest.Session) -> None:
        if hasattr(session.config, "workeroutput"):
            users = {name: sorted(functions) for name, functions in self.users.items()}
            session.config.workeroutput.update(own=self.own, shared=dict(self.shared), users=users)
            return
        costs = dict(self.own)
        for name, seconds in self.shared.items():
            for function in self.users[name]:
                costs[function] += seconds / len(self.users[name])
        text = json.dumps({name: round(costs[name], 2) for name in sorted(costs)}, indent=0)
        COSTS.write_text(text + "\n", encoding="utf-8")


_SPENT = pytest.StashKey[float]()


def _seconds() -> float:
    """A clock that stands while this thread waits for a core, where Linux tells: load is no cost."""
    try:
        waited = int(Path("/proc/thread-self/schedstat").read_text(encoding="ascii").split()[1])
    except OSError:
        waited = 0
    return time.perf_counter() - 1e-9 * waited


def pytest_configure(config: pytest.Config) -> None:
    config.pluginmanager.register(Tiers(config))
    if config.getoption("--costs"):
        config.pluginmanager.register(Costs())
