"""Every setting of the service, from arguments or from the environment as `STICKSLIP_…`."""

from __future__ import annotations

import ipaddress
import os
from typing import Literal, Self
from urllib.parse import urlsplit

from pydantic import Field, FilePath, SecretStr, ValidationError, field_validator, model_validator
from pydantic_settings import BaseSettings, SettingsConfigDict
from sqlalchemy.engine import URL, make_url
from sqlalchemy.exc import ArgumentError

from service.db.engine import CONNECTIONS
from service.db.postgresql import DRIVER
from service.errors import ConfigurationError
from service.jobs.outputs import Pace


class ClientLimits(BaseSettings):
    """The part of the settings that limits clients, all together and each owner by default; 0 is no limit.

    A key may have limits of its own (`service.auth.callers.KeyLimits`) in place of those that begin with
    `owner_`. Where no keys are needed, everybody is one owner.
    """

    model_config = SettingsConfigDict(
        env_prefix="STICKSLIP_", frozen=True, extra="forbid", allow_inf_nan=False
    )

    owner_waiting: int = Field(
        default=500,
        ge=0,
        le=1_000_000,
        description="Jobs of one owner that wait at a time, where there are keys; 0: any number.",
    )
    owner_storage_bytes: int = Field(
        default=10_000_000_000,
        ge=0,
        le=10**15,
        description="What one owner's uploads and results take [bytes]; 0: any amount.",
    )
    owner_requests: int = Field(
        default=100,
        ge=0,
        le=100_000,
        description="Requests of one owner that are answered at a time, those that wait for a job among "
        "them; 0: any number.",
    )
    owner_streams: int = Field(
        default=100, ge=0, le=100_000, description="Event streams of one owner at a time; 0: any number."
    )
    owner_previews: int = Field(
        default=4, ge=0, le=1000, description="Previews of one owner that wait at a time; 0: any number."
    )
    owner_uploads: int = Field(
        default=4, ge=0, le=1000, description="Uploads of one owner at a time; 0: any number."
    )
    owner_priority: int = Field(
        default=100, ge=-100, le=100, description="Highest priority one owner may give a job."
    )
    streams: int = Field(
        default=1000, ge=0, le=100_000, description="Event streams of all at a time; 0: any number."
    )
    connections: int = Field(
        default=2000,
        ge=10,
        le=1_000_000,
        description="Open connections, at most as many as the system lets a process have. For one more, the "
        "one is closed that has been idle for longest.",
    )
    write_seconds: float = Field(
        default=10.0,
        ge=0.1,
        le=3600.0,
        description="Time in which a client must take something of its answer [s].",
    )
    unsent_bytes: int = Field(
        default=100_000_000,
        ge=1_000_000,
        le=10**12,
        description="Answers that one owner's clients have not taken yet, together [bytes]: while they are "
        "more, those who take nothing are disconnected and further requests answered 429.",
    )


_LOOPBACK_NAMES = ("localhost",)


def _cpu_count() -> int:
    """Number of processors this process may use."""
    if hasattr(os, "sched_getaffinity"):
        return len(os.sched_getaffinity(0))
    return os.cpu_count() or 1


def is_loopback(host: str) -> bool:
    """Whether only this machine can reach a server bound to `host`."""
    if host in _LOOPBACK_NAMES:
        return True
    try:
        return ipaddress.ip_address(host).is_loopback
    except ValueError:
        return False


def _sqlite_url(url: str, parsed: URL) -> str:
    if parsed.drivername not in ("sqlite", "sqlite+pysqlite") or parsed.query:
        raise ValueError(
            f"`database` must be a plain sqlite:/// URL without a driver or options, got {url!r}"
        )
    if parsed.database in (None, "", ":memory:"):
        raise ValueError(f"`database` must name a file: one in memory would lose every job, got {url!r}")
    return url


def _postgresql_url(parsed: URL) -> str:
    """The URL with the driver that is used; messages never show the password."""
    shown = parsed.render_as_string()
    if parsed.get_backend_name() not in ("postgresql", "postgres"):
        raise ValueError(f"`database` must be an SQLite or PostgreSQL URL, got {shown!r}")
    if parsed.drivername not in ("postgresql", "postgres", DRIVER):
        raise ValueError(f"`database` must be a URL with the driver psycopg, {DRIVER}://…, got {shown!r}")
    if not parsed.database:
        raise ValueError(f"`database` must name a database: {DRIVER}://user@host/name, got {shown!r}")
    return parsed.set(drivername=DRIVER).render_as_string(hide_password=False)


class Settings(ClientLimits):
    """The settings of one service; frozen. `STICKSLIP_PORT` in the environment sets `port`, and so on."""

    database: str = Field(
        default="sqlite:///./stickslip.db",
        description="Where jobs and results are kept: sqlite:///relative/path, sqlite:////absolute/path or "
        "postgresql://user:password@host/name.",
    )
    arrays: str | None = Field(
        default=None,
        description="Where large arrays of sweeps are kept: a folder, or a URL of fsspec such as "
        "s3://bucket/arrays (extra `stores`); unset: in the database.",
    )
    database_connections: int = Field(
        default=CONNECTIONS, ge=2, le=1000, description="Connections to PostgreSQL at most."
    )
    database_seconds: float = Field(
        default=10.0,
        ge=0.1,
        le=3600.0,
        description="Longest time for a statement of the database, for its lock, for a connection to it [s]: "
        "what takes longer is answered 503.",
    )
    least_free_bytes: int = Field(
        default=64_000_000,
        ge=0,
        le=10**15,
        description="Room on the disk of an SQLite database below which the service is not ready [bytes].",
    )
    host: str = Field(default="127.0.0.1", description="Address to listen on.")
    port: int = Field(default=8000, ge=0, le=65535, description="Port to listen on; 0 takes any free one.")
    allow_remote: bool = Field(
        default=False,
        description="Allow `require_keys=false` on a `host` that other machines can reach: "
        "everyone who reaches the port may then submit, read and cancel.",
    )
    require_keys: bool | None = Field(
        default=None,
        description="Whether requests need a key (`stickslip keys create`). Unset: not on loopback, "
        "on every other `host`. Behind a proxy on the same machine, set it.",
    )
    requests_per_minute: int = Field(
        default=1200,
        ge=1,
        le=1_000_000,
        description="Requests a minute with one key, unless the key has a limit of its own.",
    )
    failed_keys_per_minute: int = Field(
        default=30, ge=1, le=1_000_000, description="Keys that do not work, a minute and client address."
    )
    links_outlive_keys: bool = Field(
        default=False,
        description="Links to runs go on when every key of their owner was revoked or has expired.",
    )
    trusted_proxies: tuple[str, ...] = Field(
        default=(),
        description="Addresses or networks of the proxies whose `X-Forwarded-For` and `X-Forwarded-Proto` "
        "are believed.",
    )
    https: bool = Field(
        default=False,
        description="Clients reach the service over HTTPS, through a proxy: "
        "answers tell browsers to keep to it.",
    )
    allowed_hosts: tuple[str, ...] | None = Field(
        default=None,
        description="Host names answered to (the `Host` header without its port), `*` for all. Unset: "
        "the names of loopback when bound to loopback, so that a web page elsewhere cannot reach the service "
        "by a name of its own; all when bound to another address.",
    )

    public_url: str | None = Field(
        default=None,
        pattern=r"^https?://[^/?#@\s]+$",
        description="Address at which people reach the service, https://dampers.example; for `oidc_issuer`.",
    )
    oidc_issuer: str | None = Field(
        default=None,
        pattern=r"^https?://[^?#@\s]+$",
        description="Address of the OpenID Connect provider where people log in; unset: keys alone.",
    )
    oidc_client_id: str | None = Field(default=None, description="Name of this service at the provider.")
    oidc_client_secret: SecretStr | None = Field(default=None, description="Its secret there.")
    oidc_owner_claim: str = Field(
        default="email",
        description="What the provider says that becomes the owner: a verified `email`, `sub`, …",
    )
    oidc_allowed: tuple[str, ...] = Field(
        default=(),
        description='Owners that may come in, `["ann@example.org", "@example.com"]`; none: whom the '
        "provider lets in.",
    )
    oidc_admins: tuple[str, ...] = Field(
        default=(), description="Owners whose log-in has the scope `admin`; the others have `submit`."
    )
    oidc_hours: float = Field(default=12.0, ge=0.01, le=8760.0, description="How long a log-in lasts [h].")

    kinds: tuple[str, ...] = Field(
        default=(),
        description='Further kinds of job, `["module:NAME", …]`: modules that are imported, by the service '
        "and by its workers (CONTRIBUTING.md).",
    )
    executor: Literal["local", "dask"] = Field(
        default="local", description="Where jobs are computed: local processes, or workers of a Dask cluster."
    )
    dask_scheduler: str | None = Field(
        default=None,
        pattern=r"^(tcp|tls)://.+:[0-9]+$",
        description="Address of the Dask scheduler, tcp://host:8786 or tls://host:8786; needed by `dask`.",
    )
    dask_ca_file: FilePath | None = Field(
        default=None, description="Certificates that the Dask scheduler is checked against (PEM), for tls://."
    )
    dask_cert_file: FilePath | None = Field(
        default=None,
        description="Certificate that the service shows to the Dask scheduler (PEM), for tls://.",
    )
    dask_key_file: FilePath | None = Field(
        default=None, description="Private key of that certificate (PEM), for tls://."
    )
    workers: int = Field(
        default_factory=_cpu_count, ge=1, le=256, description="Worker processes; one for each processor."
    )
    max_attempts: int = Field(
        default=3, ge=1, le=100, description="Attempts at a job before it fails because its worker died."
    )
    lease_seconds: float = Field(
        default=60.0,
        ge=1.0,
        le=86400.0,
        description="How long a running job stays its owner's without a sign of life [s].",
    )
    grace_seconds: float = Field(
        default=0.5, ge=0.0, le=60.0, description="Time between asking a worker to stop and killing it [s]."
    )
    poll_seconds: float = Field(
        default=5.0,
        ge=0.05,
        le=3600.0,
        description="Safety poll of the queue [s]; new jobs wake it at once, this finds what was missed.",
    )
    progress_seconds: float = Field(
        default=0.1, ge=0.01, le=60.0, description="Least time between two reports of a job's progress [s]."
    )
    checkpoint_seconds: float = Field(
        default=10.0,
        ge=0.05,
        le=86400.0,
        description="Time after which a long job keeps what it has for a later attempt [s].",
    )
    checkpoint_bytes: int = Field(
        default=256_000_000,
        ge=0,
        le=1_000_000_000,
        description="Most that a job keeps for a later attempt [bytes]; 0 keeps nothing.",
    )
    job_seconds: float = Field(
        default=3600.0, ge=0.1, le=1e7, description="Longest time one attempt at a job may take [s]."
    )

    retention_days: float | None = Field(
        default=None,
        ge=0.01,
        le=100_000.0,
        description="Days after which ended jobs are deleted with their results and sweeps; unset: never.",
    )
    retention_keep_designs: bool = Field(
        default=True, description="Keep designs with their results for ever, and delete their sweeps alone."
    )
    retention_upload_days: float | None = Field(
        default=None,
        ge=0.01,
        le=100_000.0,
        description="Days after which uploads are deleted that no unfinished job and none that came since "
        "names; unset: never.",
    )
    bin_days: float = Field(
        default=7.0,
        ge=0.01,
        le=100_000.0,
        description="Days after which runs and projects that were put in the bin are deleted for good, with "
        "results and sweeps; they can be restored until then.",
    )
    preview_seconds: float = Field(
        default=3.0, ge=0.05, le=60.0, description="Longest time a preview may be computed [s]."
    )

    answer_workers: int = Field(
        default=2,
        ge=1,
        le=64,
        description="Processes that compute what is answered at once: plans, scenes from text, checks of "
        "what is handed in. One of them is left for others whatever one owner asks for.",
    )
    answer_seconds: float = Field(
        default=1.5,
        ge=0.1,
        le=600.0,
        description="Processor time that one such computation may take [s]; more is answered 422.",
    )
    answer_memory_bytes: int = Field(
        default=192 * 1024**2,
        ge=16 * 1024**2,
        le=1024**4,
        description="Memory that one such computation, or a preview, may take [bytes]; more is answered 422.",
    )
    answer_budget_seconds: int = Field(
        default=60,
        ge=1,
        le=1_000_000,
        description="Processor time of such computations for one owner a minute [s]; more is answered 429.",
    )
    worker_memory_bytes: int = Field(
        default=4 * 1024**3,
        ge=0,
        le=1024**5,
        description="Memory that a job may take [bytes]; 0 for no limit. A job whose dense matrices need "
        "more is refused with 422, one that meets the limit fails with `memory-limit`.",
    )

    log_format: Literal["text", "json"] = Field(
        default="text", description="The log on standard error: lines for people, or JSON objects."
    )
    traces: bool = Field(
        default=False,
        description="Send OpenTelemetry traces of requests, jobs and their computation where "
        "OTEL_EXPORTER_OTLP_ENDPOINT says; needs the extra `traces`.",
    )
    log_level: Literal["DEBUG", "INFO", "WARNING", "ERROR"] = Field(
        default="INFO", description="Least level that is logged."
    )

    queue_limit: int = Field(
        default=1000, ge=1, le=1_000_000, description="Jobs waiting at most; further ones are answered 503."
    )
    max_body_bytes: int = Field(
        default=4 * 1024 * 1024, ge=1024, le=1024**3, description="Largest request body accepted [bytes]."
    )
    max_upload_bytes: int = Field(
        default=64 * 1024 * 1024, ge=1024, le=1024**3, description="Largest upload accepted [bytes]."
    )
    max_upload_parts: int = Field(
        default=8, ge=1, le=64, description="Parts of that size a larger file may be sent in."
    )
    header_seconds: float = Field(
        default=10.0,
        ge=0.1,
        le=3600.0,
        description="Time the headers of a request may take to arrive, from the first byte or the connection "
        "[s].",
    )
    body_seconds: float = Field(
        default=30.0, ge=0.1, le=3600.0, description="Time a request body may take to arrive [s]."
    )
    upload_seconds: float = Field(
        default=300.0, ge=0.1, le=86400.0, description="Time an upload may take to arrive [s]."
    )
    inspection_seconds: float = Field(
        default=30.0, ge=1.0, le=3600.0, description="Time of each 16 MiB that reading uploads may take [s]."
    )
    report_seconds: float = Field(
        default=60.0, ge=1.0, le=3600.0, description="Time making a report of a design may take [s]."
    )
    max_wait_seconds: float = Field(
        default=60.0, ge=0.0, le=3600.0, description="Longest `Prefer: wait=N` honoured [s]."
    )
    heartbeat_seconds: float = Field(
        default=10.0, ge=0.1, le=600.0, description="Longest silence of an event stream [s]."
    )
    page_limit: int = Field(default=1000, ge=1, le=10_000, description="Most rows one page of a list has.")
    shutdown_seconds: float = Field(
        default=2.0, ge=0.1, le=60.0, description="Time open requests have to end when the service stops [s]."
    )
    exit_seconds: float = Field(
        default=8.0,
        ge=1.0,
        le=600.0,
        description="Time from SIGINT or SIGTERM after which the process ends by force [s], if a database or "
        "a disk that does not answer holds it up.",
    )

    @property
    def keys_required(self) -> bool:
        """Whether requests need a key."""
        return not is_loopback(self.host) if self.require_keys is None else self.require_keys

    @property
    def hosts(self) -> tuple[str, ...]:
        """Host names answered to, `*` for all."""
        if self.allowed_hosts is not None:
            return self.allowed_hosts
        return ("localhost", "127.0.0.1", "[::1]") if is_loopback(self.host) else ("*",)

    @property
    def pace(self) -> Pace:
        """How often workers tell what."""
        return Pace(
            progress_seconds=self.progress_seconds, checkpoint_seconds=self.checkpoint_seconds,
            checkpoint_bytes=self.checkpoint_bytes, log_level=self.log_level, log_format=self.log_format,
            traces=self.traces,
        )  # fmt: skip

    @field_validator("database")
    @classmethod
    def _known_database(cls, url: str) -> str:
        try:
            parsed = make_url(url)
        except ArgumentError as error:
            raise ValueError(
                f"`database` must be a URL such as sqlite:///./stickslip.db, got {url!r}"
            ) from error
        if parsed.get_backend_name() == "sqlite":
            return _sqlite_url(url, parsed)
        return _postgresql_url(parsed)

    @model_validator(mode="after")
    def _keys_unless_allowed(self) -> Self:
        if not (self.keys_required or self.allow_remote or is_loopback(self.host)):
            raise ValueError(
                f"`host` {self.host!r} can be reached from other machines and `require_keys` is off: "
                "leave it out and make keys (`stickslip keys create`), use 127.0.0.1, or set "
                "STICKSLIP_ALLOW_REMOTE=true (`allow_remote`) if everyone who can reach it may use it"
            )
        return self

    @model_validator(mode="after")
    def _login_is_whole(self) -> Self:
        if self.oidc_issuer is None:
            return self
        for name in ("oidc_client_id", "oidc_client_secret", "public_url"):
            if getattr(self, name) is None:
                raise ValueError(f"`oidc_issuer` needs `{name}` (STICKSLIP_{name.upper()})")
        if not self.keys_required:
            raise ValueError(
                "`oidc_issuer` needs `require_keys` (STICKSLIP_REQUIRE_KEYS=true): who logs in gets a key"
            )
        for name in ("oidc_issuer", "public_url"):
            url = urlsplit(getattr(self, name))
            if url.scheme == "http" and not is_loopback(url.hostname or ""):
                raise ValueError(
                    f"`{name}` must begin with https:// unless it is on loopback, got {url.geturl()!r}"
                )
        return self

    @model_validator(mode="after")
    def _cluster_is_known(self) -> Self:
        if self.executor == "dask" and self.dask_scheduler is None:
            raise ValueError(
                "`executor` 'dask' needs the address of a scheduler: set STICKSLIP_DASK_SCHEDULER "
                "(`dask_scheduler`), for example tcp://10.0.0.5:8786"
            )
        files = (self.dask_ca_file, self.dask_cert_file, self.dask_key_file)
        if (self.dask_scheduler or "").startswith("tls://") and None in files:
            raise ValueError(
                f"`dask_scheduler` {self.dask_scheduler!r} needs `dask_ca_file`, `dask_cert_file` and "
                "`dask_key_file`"
            )
        return self


def load_settings(**values: object) -> Settings:
    """Settings from `values`, then the environment, then the defaults.

    ConfigurationError naming each bad setting, its value and what would be right.
    """
    try:
        return Settings(**values)  # type: ignore[arg-type]
    except ValidationError as error:
        raise ConfigurationError("; ".join(_sentence(dict(item)) for item in error.errors())) from error


def _sentence(item: dict[str, object]) -> str:
    """One of pydantic's errors as a sentence that names the setting."""
    context = item.get("ctx")
    raised = context.get("error") if isinstance(context, dict) else None
    message = str(item["msg"] if raised is None else raised)
    location = item["loc"]
    if not isinstance(location, tuple) or not location or message.startswith("`"):
        return message
    name = ".".join(str(part) for part in location)
    return f"`{name}` (STICKSLIP_{name.upper()}): {message}, got {item.get('input')!r}"
