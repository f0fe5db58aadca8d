import gc
import os
import zlib
from collections import Counter
from collections.abc import Collection, Generator, Iterator
from pathlib import Path
from typing import Any

import pytest
from launch import served

# Before anything loads numpy. Workers compute with one thread; who computes the same with several gets other
# last bits, and two processes of pytest have no more than two cores between them.
for _library in ("OMP", "OPENBLAS", "MKL"):
    os.environ[f"{_library}_NUM_THREADS"] = "1"

# As every command sets it. Workers are forked off one process as long as no setting is changed: each that
# starts after a test of the command, in this process, would begin from nothing.
os.environ.setdefault("STICKSLIP_PROGRESS", "0")
# Tests wait for no compiler beside them: what they call is on disk, or compiled where it is called.
os.environ.setdefault("STICKSLIP_KERNELS", "compiled")

# Certificates of authorities are looked up in an empty folder: to read a list of all takes each client 30 ms,
# and every service that is asked is on loopback, or shows a certificate of the test's own.
os.environ.pop("SSL_CERT_FILE", None)
os.environ["SSL_CERT_DIR"] = str(Path(__file__).parent)

SHARED = {
    "page": ("tests/page/",), "extensions": ("tests/extensions/",), "attacks": ("tests/service/attacks/",),
    "server": ("tests/project/test_readme.py", "tests/service/rendering/test_report.py",
               "tests/service/cli/test_submit.py"),
}  # fmt: skip
"""Tests that share a service in a process of its own: one process of pytest runs all of these."""


@pytest.hookimpl(optionalhook=True)
def pytest_xdist_make_scheduler(config: pytest.Config, log: Any) -> Any:
    """With `--dist loadscope` files stay together, and these tests: what they share is made once."""
    if config.getoption("dist") != "loadscope":
        return None
    from xdist.scheduler import LoadScopeScheduling

    class Together(LoadScopeScheduling):
        def _split_scope(self, nodeid: str) -> str:
            file = nodeid.partition("::")[0]
            return next((name for name, files in SHARED.items() if file.startswith(files)), file)

    return Together(config, log)


@pytest.hookimpl(wrapper=True)
def pytest_collection() -> Generator[None, object, object]:
    """What is collected stays: the garbage collector does not look through it, then or later."""
    gc.disable()
    try:
        return (yield)
    finally:
        gc.freeze()
        gc.enable()


def pytest_addoption(parser: pytest.Parser) -> None:
    """All long tests take ten hours; a tenth of each function's cases, in turn, takes one."""
    parser.addoption("--part", type=_part, metavar="K/N", help="of the long tests the K-th of N parts alone")


def _part(text: str) -> tuple[int, int]:
    number, _, parts = text.partition("/")
    if not (number.isdecimal() and parts.isdecimal() and 1 <= int(number) <= int(parts)):
        raise ValueError(text)  # argparse words it
    return int(number), int(parts)


@pytest.hookimpl(tryfirst=True)
def pytest_collection_modifyitems(config: pytest.Config, items: list[pytest.Item]) -> None:
    """Of the cases of a function marked `few` every n-th runs and those to keep; the others are long.

    With `--part` the long cases of a function are dealt out to the parts one after the other, beginning with
    a part that its name decides: each part has its share of every function.
    """
    number, parts = config.getoption("--part") or (1, 1)
    seen: Counter[str] = Counter()
    dealt: Counter[str] = Counter()
    of_other_parts = []
    for item in items:
        function = item.nodeid.partition("[")[0]
        if few := item.get_closest_marker("few"):
            kept = bool(few.args) and seen[function] % few.args[0] == 0
            seen[function] += 1
            if not kept and not _named(item, few.kwargs.get("keep", ())):
                item.add_marker(pytest.mark.long)
        if item.get_closest_marker("long"):
            if (zlib.crc32(function.encode()) + dealt[function] - number) % parts:
                of_other_parts.append(item)
            dealt[function] += 1
    if of_other_parts:
        config.hook.pytest_deselected(items=of_other_parts)
        others = set(of_other_parts)
        items[:] = [item for item in items if item not in others]


def _named(item: pytest.Item, keep: Collection[object]) -> bool:
    """Whether a value that a case has is one of those to keep."""
    values = item.callspec.params.values() if isinstance(item, pytest.Function) else ()
    return any(value in keep for value in values if isinstance(value, str | int | float))


@pytest.fixture(scope="session")
def server(tmp_path_factory: pytest.TempPathFactory) -> Iterator[str]:
    """The address of a service in a process of its own."""
    with served(tmp_path_factory.mktemp("server")) as url:
        yield url
