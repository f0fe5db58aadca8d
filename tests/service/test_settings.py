"""Settings, and the sentences they are refused with."""

import socket

import pytest
from each import each

from service.db.engine import database_name
from service.errors import ConfigurationError
from service.http.server import _bind
from service.settings.settings import Settings, is_loopback, load_settings


def test_defaults_and_environment(monkeypatch: pytest.MonkeyPatch) -> None:
    for name in Settings.model_fields:
        monkeypatch.delenv(f"STICKSLIP_{name.upper()}", raising=False)
    settings = load_settings()
    assert (settings.host, settings.port) == ("127.0.0.1", 8000)
    assert settings.database == "sqlite:///./stickslip.db"
    assert settings.max_attempts == 3
    assert settings.workers >= 1
    monkeypatch.setenv("STICKSLIP_PORT", "9001")
    monkeypatch.setenv("STICKSLIP_WORKERS", "3")
    monkeypatch.setenv("STICKSLIP_ALLOWED_HOSTS", '["example.org"]')
    settings = load_settings(workers=2)
    assert (settings.port, settings.workers, settings.hosts) == (9001, 2, ("example.org",))
    monkeypatch.setenv("STICKSLIP_PORT", "high")
    with pytest.raises(ConfigurationError, match=r"`port` \(STICKSLIP_PORT\): .* got 'high'"):
        load_settings()


def test_every_setting_is_described() -> None:
    assert all(field.description for field in Settings.model_fields.values())


@each(
    ("values", "words"),
    [
        (
            {"host": "0.0.0.0", "require_keys": False},
            "can be reached from other machines and `require_keys` is off",
        ),
        ({"host": "::", "require_keys": False}, "STICKSLIP_ALLOW_REMOTE=true"),
        ({"host": "example.org", "require_keys": False}, "make keys (`stickslip keys create`)"),
        ({"database": "mysql://localhost/x"}, "must be an SQLite or PostgreSQL URL"),
        ({"database": "postgresql+psycopg2://localhost/x"}, "with the driver psycopg, postgresql+psycopg://"),
        ({"database": "postgresql://localhost"}, "must name a database"),
        ({"database": "postgresql+asyncpg://u:hidden@localhost/x"}, "got 'postgresql+asyncpg://u:***@"),
        ({"database": "sqlite://"}, "must name a file"),
        ({"database": "sqlite:///:memory:"}, "must name a file"),
        ({"database": "sqlite:///x.db?mode=ro"}, "without a driver or options"),
        ({"executor": "dask"}, "set STICKSLIP_DASK_SCHEDULER"),
        ({"executor": "threads"}, "got 'threads'"),
        (
            {"executor": "dask", "dask_scheduler": "10.0.0.5:8786"},
            "`dask_scheduler` (STICKSLIP_DASK_SCHEDULER): ",
        ),
        ({"executor": "dask", "dask_scheduler": "tls://h:1"}, "`dask_cert_file` and `dask_key_file`"),
        ({"dask_ca_file": "/nowhere/ca.pem"}, "`dask_ca_file`"),
        ({"database": "x.db"}, "must be a URL such as sqlite:///"),
        ({"workers": 0}, "`workers`"),
        ({"lease_seconds": float("nan")}, "`lease_seconds`"),
        ({"colour": "red"}, "`colour`"),
    ],
)
def test_bad_settings_are_refused_with_a_sentence(values: dict[str, object], words: str) -> None:
    with pytest.raises(ConfigurationError) as refused:
        load_settings(**values)
    assert words in str(refused.value)
    assert "hidden" not in str(refused.value)


@pytest.mark.parametrize("scheme", ["postgres", "postgresql", "postgresql+psycopg"])
def test_postgresql_is_reached_by_one_driver(scheme: str) -> None:
    url = f"{scheme}://me:a%40b@db.example:5433/jobs?sslmode=require"
    wanted = "postgresql+psycopg://me:a%40b@db.example:5433/jobs?sslmode=require"
    assert load_settings(database=url).database == wanted
    assert database_name(wanted) == "postgresql+psycopg://me:***@db.example:5433/jobs?sslmode=require"


def test_loopback() -> None:
    assert all(is_loopback(host) for host in ("127.0.0.1", "127.1.2.3", "::1", "localhost"))
    assert not any(is_loopback(host) for host in ("0.0.0.0", "::", "10.0.0.1", "example.org", ""))


def test_another_address_needs_keys_or_leave_and_answers_to_every_name() -> None:
    settings = load_settings(host="0.0.0.0")
    assert (settings.hosts, settings.keys_required) == (("*",), True)
    assert load_settings(host="0.0.0.0", allow_remote=True).keys_required, "leave alone does not do"
    assert not load_settings(host="0.0.0.0", allow_remote=True, require_keys=False).keys_required
    settings = load_settings()
    assert (settings.hosts, settings.keys_required) == (("localhost", "127.0.0.1", "[::1]"), False)
    assert load_settings(require_keys=True).keys_required


def test_a_port_in_use_is_told() -> None:
    with socket.socket() as taken:
        taken.bind(("127.0.0.1", 0))
        taken.listen()
        with pytest.raises(ConfigurationError, match="cannot listen on 127"):
            _bind(load_settings(port=taken.getsockname()[1]))
