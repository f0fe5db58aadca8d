"""PostgreSQL: pooled connections that wait for nothing for ever, and the locks several services share.

Every connection of a service holds one advisory lock shared with all others; `stickslip db upgrade` takes
it for itself alone, so that tables never change under a running service, and a service that died, or a
server that restarted, leaves no lock behind. Making or changing tables takes a second lock, so that of
several services started on an empty database one makes the tables. Both locks belong to sessions: a
connection pooler between service and server has to pool sessions, not transactions.

What services on one database tell each other goes by its LISTEN and NOTIFY: nobody has to poll. A notice is
a hint and nothing depends on it: each service looks by itself now and then, as seldom as its settings say.
"""

from __future__ import annotations

import logging
import math
import multiprocessing as mp
import selectors
import threading
from collections import deque
from collections.abc import Callable, Mapping
from multiprocessing.connection import wait
from typing import Any

from sqlalchemy import Connection, Engine, create_engine, event, text
from sqlalchemy.engine import URL, make_url
from sqlalchemy.engine.interfaces import DBAPIConnection
from sqlalchemy.exc import DisconnectionError
from sqlalchemy.pool import ConnectionPoolEntry, NullPool

from service.errors import DatabaseError, DatabaseInUseError
from service.jobs import strict_json

DRIVER = "postgresql+psycopg"
OLDEST = 15

WITH_VALUES = "stickslip_with_values"
"""The execution option of a statement that the server is to plan with its values, each time.

A plan kept for any owner is wrong for who has few rows, or most of them.
"""

_WAIT_SECONDS = 30.0
_CONNECT_SECONDS = 10
_LEAST_CONNECT_SECONDS = 2  # libpq takes no less
_MARGIN_SECONDS = 1.0  # the server is the first to give up, and says why
# Numbers of our own; advisory locks know their holders' agreement by number alone.
_SERVICES = 0x5354_4943_4B01
_TABLES = 0x5354_4943_4B02
_ROOM = 0x5354_4943_4B03
_QUANTITIES = 0x5354_4943_4B04
# More rows than `work_mem` has room for: the server keeps them in a temporary file until they are counted.
_OF_PROBE = (("work_mem", "64kB"), ("temp_tablespaces", ""))
_SPILL = (
    "SELECT current_setting('transaction_read_only')::bool "
    "FROM (SELECT count(*) FROM generate_series(1, 40000)) AS spilled"
)


def _arguments(url: URL, connect_seconds: int = _CONNECT_SECONDS) -> dict[str, Any]:
    """What libpq is told besides the URL, which has the last word."""
    defaults = {"application_name": "stickslip", "connect_timeout": connect_seconds, "keepalives_idle": 30}
    return {name: value for name, value in defaults.items() if name not in url.query}


def _create(url: str, connect_seconds: int = _CONNECT_SECONDS, **pool: Any) -> Engine:
    parsed = make_url(url)
    arguments = _arguments(parsed, connect_seconds)
    try:
        return create_engine(parsed, connect_args=arguments, json_serializer=strict_json.stored, **pool)
    except ModuleNotFoundError as error:
        raise DatabaseError(
            f"PostgreSQL needs the package psycopg ({error}): install stickslip[postgresql]"
        ) from error


def _told(*statements: str) -> Callable[[DBAPIConnection, ConnectionPoolEntry], None]:
    """For SQLAlchemy's event `connect`: what every new connection is told."""

    def tell(connection: DBAPIConnection, _record: ConnectionPoolEntry) -> None:
        cursor = connection.cursor()
        for statement in statements:
            cursor.execute(statement)
        cursor.close()
        connection.commit()

    return tell


def _require_silence(connection: Any, _record: ConnectionPoolEntry, _proxy: object) -> None:
    """Have a connection replaced on which the server said something while it lay idle: that it ended it.

    To ask the server at each transaction would be one more answer to wait for.
    """
    with selectors.DefaultSelector() as heard:
        heard.register(connection.fileno(), selectors.EVENT_READ)
        if heard.select(0):
            raise DisconnectionError("the server ended the connection while it lay idle")


def _execute(cursor: Any, statement: str, parameters: Any, context: Any) -> bool:
    """For SQLAlchemy's event `do_execute`: what is not prepared is planned with its values."""
    if not context.execution_options.get(WITH_VALUES):
        return False
    cursor.execute(statement, parameters, prepare=False)
    return True


def bounded_connect(seconds: float) -> Callable[..., Any]:
    """What opens connections of psycopg whose server has so long for each answer [s].

    The server ends a statement that takes long by itself, if it runs. One that is frozen, or behind a network
    that swallows everything, says nothing at all, and TCP notices that late or never: the client must give
    up.
    """
    # Loaded here: only services on PostgreSQL need the driver.
    import psycopg
    from psycopg.errors import OperationalError

    class Bounded(psycopg.Connection[Any]):
        """A connection that closes itself when its server is silent for too long."""

        def wait(self, gen: Any, interval: float = 0.1, timeout: float | None = None) -> Any:
            """Wait for the server, as every method of a connection does.

            Raises
            ------
            OperationalError
                If it does not answer in time. What became of the statement is not known; the server rolls
                its transaction back as soon as it sees that the connection is gone.
            """
            longest = seconds + _MARGIN_SECONDS
            try:
                return super().wait(gen, interval, longest if timeout is None else min(timeout, longest))
            except OperationalError as error:
                if error.sqlstate is None and not self.closed:
                    self.pgconn.finish()
                    raise OperationalError(f"the server did not answer within {longest:g} s") from error
                raise

    return Bounded.connect


def service_engine(url: str, connections: int, seconds: float) -> Engine:
    """The pool of a service; a connection that broke while it lay idle is replaced before its use.

    Parameters
    ----------
    url : a PostgreSQL URL.
    connections : most connections at a time; further threads wait for one.
    seconds : longest time for a statement, and to wait for a connection [s].
    """
    patience = max(_LEAST_CONNECT_SECONDS, math.ceil(seconds))
    engine = _create(
        url, connect_seconds=patience, pool_size=connections, max_overflow=0, pool_timeout=seconds
    )
    connect = bounded_connect(seconds)
    event.listen(engine, "do_connect", lambda _dialect, _record, words, options: connect(*words, **options))
    most = int(seconds * 1000)
    told = _told(
        f"SET lock_timeout = {most}",
        f"SET statement_timeout = {most}",
        # Starting parallel workers takes longer than a page should.
        "SET max_parallel_workers_per_gather = 0",
        # Held as long as the connection lives; waits while tables change.
        f"SELECT pg_advisory_lock_shared({_SERVICES})",
    )
    event.listen(engine, "connect", told)
    event.listen(engine, "checkout", _require_silence)
    event.listen(engine, "do_execute", _execute)
    return engine


def own_connection(engine: Engine, seconds: float) -> Any:
    """A connection of psycopg outside of the pool, which commits by itself; `seconds` as of the pool."""
    words, options = engine.dialect.create_connect_args(engine.url)
    patience = max(_LEAST_CONNECT_SECONDS, math.ceil(seconds))
    arguments: dict[str, Any] = {**options, **_arguments(engine.url, patience), "autocommit": True}
    return bounded_connect(seconds)(*words, **arguments)


def trouble(engine: Engine, seconds: float) -> str | None:
    """Why the server can write nothing now, or None.

    A connection of its own, which waits so long [s] for each answer, has the server spill half a megabyte
    to a temporary file on the disk of the database and throw it away: no table, no catalogue and no log is
    written, and the server itself says when its disk, its tablespace or a quota is full.
    """
    # Loaded here: only services on PostgreSQL need the driver.
    import psycopg

    try:
        with own_connection(engine, seconds) as connection:
            for setting, value in (*_OF_PROBE, ("statement_timeout", f"{int(seconds * 1000)}")):
                connection.execute("SELECT set_config(%s, %s, false)", (setting, value))
            (read_only,) = connection.execute(_SPILL).fetchone()
    except psycopg.errors.ConfigurationLimitExceeded:
        return None  # `temp_file_limit` is below that: the disk was not asked
    except psycopg.Error as error:
        return f"PostgreSQL cannot write: {error}".strip()
    return "PostgreSQL can only be read: it is a standby, or read-only by its settings" if read_only else None


def reading(engine: Engine) -> Engine:
    """The same pool for transactions that read one snapshot and cannot write."""
    return engine.execution_options(isolation_level="REPEATABLE READ", postgresql_readonly=True)


def looking(engine: Engine) -> Engine:
    """The same pool for single statements, each of which sees what is committed."""
    return engine.execution_options(isolation_level="AUTOCOMMIT")


def migration_engine(url: str) -> Engine:
    """An engine for changes of the tables, outside of the services' lock."""
    engine = _create(url, poolclass=NullPool)
    # No statement waits longer for a lock than SQLite's would.
    event.listen(engine, "connect", _told(f"SET lock_timeout = {int(_WAIT_SECONDS * 1000)}"))
    return engine


def lock_tables(connection: Connection) -> None:
    """Be the only one, until the transaction ends, who makes or changes tables.

    DatabaseError if the server is too old.
    """
    found = connection.dialect.server_version_info
    if found is None or found < (OLDEST,):
        version = ".".join(map(str, found or ("unknown",)))
        raise DatabaseError(f"stickslip needs PostgreSQL {OLDEST} or newer, the server is {version}")
    connection.execute(text(f"SELECT pg_advisory_xact_lock({_TABLES})"))


def lock_room(connection: Connection) -> None:
    """Be the only one, until the transaction ends, who adds jobs to a queue that may be full."""
    connection.execute(text(f"SELECT pg_advisory_xact_lock({_ROOM})"))


def lock_quantities(connection: Connection) -> None:
    """Be the only one, until the transaction ends, who says what new figures are."""
    connection.execute(text(f"SELECT pg_advisory_xact_lock({_QUANTITIES})"))


def refuse_running(connection: Connection, name: str) -> None:
    """Keep services out until the transaction ends (DatabaseInUseError if one is running)."""
    if not connection.execute(text(f"SELECT pg_try_advisory_xact_lock({_SERVICES})")).scalar_one():
        raise DatabaseInUseError(f"{name} is in use by running stickslip services: stop them first")


log = logging.getLogger("stickslip.notices")

_CHANNEL = "stickslip"
_SEND = "SELECT pg_notify(%s, notice) FROM unnest(%s::text[]) AS notice"
_AGAIN_SECONDS = 2.0
ACCEPTED, ENDED, CANCEL = "accepted", "ended", "cancel"
"""A job waits; one ended, or went back to the queue; the cancel of a running one was asked for."""
WATCH, LIVE = "watch", "live"
"""A job is watched here; one that runs here got this far."""


class Notices:
    """The notices of one service: one thread and connection of its own send and hear them, together.

    Parameters
    ----------
    connect : opens a connection of psycopg that commits by itself.
    accepted : called when a job waits that another service accepted, and when notices may have been missed.
    hear : what is called with the text of a notice of another service, by its word.
    """

    def __init__(
        self, connect: Callable[[], Any], accepted: Callable[[], None],
        hear: Mapping[str, Callable[[str], None]],
    ) -> None:  # fmt: skip
        self._connect, self._accepted, self._hears = connect, accepted, hear
        self._waiting: deque[str] = deque()
        self._wake_reader, self._wake_writer = mp.get_context("spawn").Pipe(duplex=False)
        self._awake = threading.Lock()
        self._woken = False
        self._own = 0
        self._closing = threading.Event()
        self._thread = threading.Thread(target=self._run, name="stickslip notices", daemon=True)

    def start(self) -> None:
        """Begin to send and to hear."""
        self._thread.start()

    def stop(self) -> None:
        """Send what waits and end."""
        self._closing.set()
        self._wake()
        if self._thread.ident is not None:
            self._thread.join(5.0)

    def tell(self, word: str, text: str = "") -> None:
        """Tell the other services."""
        self._waiting.append(f"{word}:{text}" if text else word)
        self._wake()

    def _wake(self) -> None:
        with self._awake:
            if not self._woken:
                self._woken = True
                self._wake_writer.send_bytes(b"!")

    def _run(self) -> None:
        # Loaded here: only services on PostgreSQL need the driver.
        import psycopg

        while not self._closing.is_set():
            try:
                with self._connect() as connection:
                    connection.add_notify_handler(self._hear)
                    # A notice need not outlive the server: nobody waits for its disk.
                    connection.execute("SET synchronous_commit = off")
                    connection.execute(f"LISTEN {_CHANNEL}")
                    self._accepted()
                    self._converse(connection)
            except psycopg.Error as error:
                log.warning("notices of other services are not heard at present: %s", error)
                self._closing.wait(_AGAIN_SECONDS)

    def _converse(self, connection: Any) -> None:
        self._own = connection.info.backend_pid
        while not self._closing.is_set():
            ready = wait([connection.fileno(), self._wake_reader])
            if self._wake_reader in ready:
                with self._awake:
                    self._wake_reader.recv_bytes()
                    self._woken = False
            # Each once: of many jobs accepted together the others need to hear one time.
            notices = list(dict.fromkeys(self._waiting.popleft() for _ in range(len(self._waiting))))
            if notices:
                connection.execute(_SEND, (_CHANNEL, notices))
            if connection.fileno() in ready:
                connection.pgconn.consume_input()
                while (notice := connection.pgconn.notifies()) is not None:
                    self._take(notice.extra.decode(), notice.be_pid)

    def _hear(self, notice: Any) -> None:
        """From the driver, of notices that arrive while this service sends its own."""
        self._take(notice.payload, notice.pid)

    def _take(self, payload: str, sender: int) -> None:
        if sender == self._own:
            return
        word, _, text = payload.partition(":")
        if word == ACCEPTED:
            self._accepted()
        elif word in self._hears:
            self._hears[word](text)
