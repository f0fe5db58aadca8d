"""What all tests share: threads, settings, one service in a process of its own."""

import gc
import os
from collections.abc import Generator, Iterator
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


@pytest.fixture(scope="session")
def server(tmp_path_factory: pytest.TempPathFactory) -> Iterator[str]:
    """The address of a service in a process of its own."""
    with served(tmp_path_factory.mktemp("server")) as url:
        yield url
