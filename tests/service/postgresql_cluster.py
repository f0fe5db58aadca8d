"""A PostgreSQL server of the tests' own: on loopback, in a temporary folder, gone afterwards."""

import os
import pwd
import secrets
import shutil
import subprocess
import tempfile
import time
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any, Self

import psycopg
import pytest
from launch import free_port
from psycopg import sql

from service.db import revisions

_START_SECONDS = 60.0
_MIGRATED = "migrated"
# Nothing here outlives the session, so nothing needs to reach the disk. The time zone is one that nobody
# who runs the tests is likely to be in: a time read without its zone would show.
_SETTINGS = ("fsync=off", "synchronous_commit=off", "full_page_writes=off", "shared_buffers=32MB",
             "max_connections=60", "autovacuum=off", "timezone=Asia/Kathmandu")  # fmt: skip


def binaries() -> Path | None:
    """The folder of the server's programs: of Debian's newest version, else what is on the path."""
    debian = sorted(Path("/usr/lib/postgresql").glob("*/bin/initdb"), key=lambda p: int(p.parts[-3]))
    found = shutil.which("initdb") if not debian else str(debian[-1])
    return None if found is None else Path(found).resolve().parent


def _unprivileged() -> dict[str, Any]:
    """Arguments of `subprocess` that give up root's rights, which PostgreSQL refuses to run with."""
    if os.geteuid() != 0:
        return {}
    nobody = pwd.getpwnam("nobody")
    return {"user": nobody.pw_uid, "group": nobody.pw_gid, "extra_groups": []}


class Cluster:
    """A running server; a context manager that ends it and removes its files."""

    def __init__(self, programs: Path) -> None:
        self._programs = programs
        # Not below pytest's own folder: only its owner may enter that, and socket paths must be short.
        self.folder = Path(tempfile.mkdtemp(prefix="stickslip-postgresql-"))
        self._data = self.folder / "data"
        self._password = secrets.token_hex(8)
        self._process: subprocess.Popen[bytes] | None = None
        self._port = free_port()
        self._how: dict[str, Any] = {
            "cwd": self.folder,
            "env": {"HOME": str(self.folder), "LC_ALL": "C.UTF-8", "PATH": os.defpath},
            **_unprivileged(),
        }

    def __enter__(self) -> Self:
        try:
            self._initialise()
            self.start()
            revisions.upgrade(self._create(_MIGRATED))
        except BaseException:
            self.__exit__()
            raise
        return self

    def __exit__(self, *_: object) -> None:
        self.stop()
        shutil.rmtree(self.folder)

    def _initialise(self) -> None:
        password = self.folder / "password"
        password.write_text(self._password)
        if "user" in self._how:
            for path in (self.folder, password):
                os.chown(path, self._how["user"], self._how["group"])
        subprocess.run(
            [self._programs / "initdb", "--no-sync", "--auth=scram-sha-256", f"--pwfile={password}",
             "--username=stickslip", "--encoding=UTF8", "--locale=C.UTF-8", "--pgdata", self._data],
            check=True, capture_output=True, **self._how,
        )  # fmt: skip

    def start(self) -> None:
        """Start the server and wait until it answers."""
        settings = [word for setting in _SETTINGS for word in ("-c", setting)]
        with (self.folder / "log").open("ab") as log:
            self._process = subprocess.Popen(
                [self._programs / "postgres", "-D", self._data, "-h", "127.0.0.1", "-p", str(self._port),
                 "-k", self.folder, *settings],
                stdout=log, stderr=log, **self._how,
            )  # fmt: skip
        end = time.monotonic() + _START_SECONDS
        while True:
            try:
                psycopg.connect(self.conninfo("postgres")).close()
            except psycopg.OperationalError:
                if self._process.poll() is not None or time.monotonic() > end:
                    raise
                time.sleep(0.02)
            else:
                return

    def stop(self) -> None:
        """Stop the server; open connections are cut."""
        if self._process is None:
            return
        self._process.send_signal(2)  # SIGINT: a "fast" shutdown
        try:
            self._process.wait(60.0)
        finally:
            self._process.kill()
            self._process.wait()
            self._process = None

    def conninfo(self, name: str) -> str:
        """A database of the server as libpq wants it."""
        return f"host=127.0.0.1 port={self._port} user=stickslip password={self._password} dbname={name}"

    def url(self, name: str) -> str:
        """A database of the server as the service wants it."""
        return f"postgresql+psycopg://stickslip:{self._password}@127.0.0.1:{self._port}/{name}"

    @contextmanager
    def database(self, *, empty: bool = True) -> Iterator[str]:
        """A new database, without tables or with those of the head revision."""
        name = f"t{secrets.token_hex(6)}"
        yield self._create(name, "template0" if empty else _MIGRATED)
        with psycopg.connect(self.conninfo("postgres"), autocommit=True) as connection:
            connection.execute(sql.SQL("DROP DATABASE {} WITH (FORCE)").format(sql.Identifier(name)))

    @contextmanager
    def small_disk(self, size: str) -> Iterator[tuple[str, Path]]:
        """A new database with its tables on a disk of its own, and the folder of that; root can mount one."""
        name, folder = f"d{secrets.token_hex(6)}", self.folder / f"disk-{secrets.token_hex(4)}"
        folder.mkdir()
        owner = "".join(f",{key[0]}id={self._how[key]}" for key in ("user", "group") if key in self._how)
        command = ["mount", "-t", "tmpfs", "-o", f"size={size},mode=700{owner}", "tmpfs", str(folder)]
        if subprocess.run(command, capture_output=True, check=False).returncode != 0:
            pytest.skip("a small disk can be mounted by root only")
        try:
            with psycopg.connect(self.conninfo("postgres"), autocommit=True) as connection:
                of = {"name": sql.Identifier(name), "folder": sql.Literal(str(folder)),
                      "template": sql.Identifier(_MIGRATED)}  # fmt: skip
                connection.execute(sql.SQL("CREATE TABLESPACE {name} LOCATION {folder}").format(**of))
                query = "CREATE DATABASE {name} TEMPLATE {template} TABLESPACE {name}"
                connection.execute(sql.SQL(query).format(**of))
                yield self.url(name), folder
                connection.execute(sql.SQL("DROP DATABASE {name} WITH (FORCE)").format(**of))
                connection.execute(sql.SQL("DROP TABLESPACE {name}").format(**of))
        finally:
            subprocess.run(["umount", "--lazy", str(folder)], check=True)

    def _create(self, name: str, template: str = "template0") -> str:
        with psycopg.connect(self.conninfo("postgres"), autocommit=True) as connection:
            query = sql.SQL("CREATE DATABASE {} TEMPLATE {}")
            connection.execute(query.format(sql.Identifier(name), sql.Identifier(template)))
        return self.url(name)
