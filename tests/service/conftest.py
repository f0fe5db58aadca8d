from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path

import httpx
import pytest
from private_kinds import PRIVATE
from service_helpers import MakeSettings, serving

from service.embedded import EmbeddedService
from service.kinds import SHIPPED
from service.settings import Settings, load_settings


@pytest.fixture
def make_settings(tmp_path: Path) -> MakeSettings:
    def make(**values: object) -> Settings:
        defaults = {
            "database": f"sqlite:///{tmp_path}/jobs.db",
            "workers": 1,
            "port": 0,
            "grace_seconds": 0.3,
            "poll_seconds": 1.0,
        }
        return load_settings(**{**defaults, **values})

    return make


@pytest.fixture
def embedded(make_settings: MakeSettings) -> Iterator[EmbeddedService]:
    with EmbeddedService(make_settings(), PRIVATE) as service:
        yield service


@pytest.fixture(scope="module")
def http(tmp_path_factory: pytest.TempPathFactory) -> Iterator[httpx.Client]:
    """The private kinds, shared by the tests of a module."""
    with serving(tmp_path_factory.mktemp("http"), PRIVATE) as client:
        yield client


@pytest.fixture(scope="module")
def shipped(tmp_path_factory: pytest.TempPathFactory) -> Iterator[httpx.Client]:
    """The kinds that come with the service, shared by the tests of a module."""
    with serving(tmp_path_factory.mktemp("shipped"), SHIPPED) as client:
        yield client
