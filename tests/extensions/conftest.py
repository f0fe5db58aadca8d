import json
import os
import subprocess
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import pytest
from launch import COMMAND, served

from service.client.client import Client
from solver import extensions

TESTS = Path(__file__).resolve().parents[1]
NAMED = ["sliders:SlidersContact", "rms_amplitude:RMS", "banded_text:BANDED"]


FOLDERS = ("..", "cases", "extensions", "../docs")


def environment() -> dict[str, str]:
    """Names all that this folder adds."""
    return {
        **os.environ, "STICKSLIP_KINDS": json.dumps(["test_a_kind:DISTORTION"]),
        extensions.VARIABLE: json.dumps(NAMED),
        "PYTHONPATH": os.pathsep.join(str(TESTS / folder) for folder in FOLDERS),
    }  # fmt: skip


@pytest.fixture(scope="session")
def url(tmp_path_factory: pytest.TempPathFactory) -> Iterator[str]:
    """A service with all of it, as whoever runs it starts it."""
    with served(tmp_path_factory.mktemp("extended"), environment()) as url:
        yield url


@pytest.fixture
def command(tmp_path: Path) -> Callable[..., Any]:
    """Runs the command in a process that knows all of it; the JSON that it prints."""

    def run(*words: str) -> Any:
        ended = subprocess.run(
            [*COMMAND, *words], env=environment(), cwd=tmp_path, capture_output=True, text=True, check=False
        )
        assert ended.returncode in (0, 1), ended.stderr
        return json.loads(ended.stdout)

    return run


@pytest.fixture(scope="session")
def client(url: str) -> Iterator[Client]:
    with Client(url) as client:
        yield client
