"""What services on one PostgreSQL database tell each other, by its LISTEN and NOTIFY: nobody has to poll.

A notice is a hint and nothing depends on it: each service looks by itself now and then, as seldom as its
settings say. One thread and one connection of its own send and hear all of a service's notices; those that
come together are sent together.
"""

from __future__ import annotations

import logging
import multiprocessing as mp
import threading
from collections import deque
from collections.abc import Callable, Mapping
from multiprocessing.connection import wait
from typing import Any

log = logging.getLogger("stickslip.notices")

_CHANNEL = "stickslip"
_SEND = "SELECT pg_notify(%s, notice) FROM unnest(%s::text[]) AS notice"
_AGAIN_SECONDS = 2.0
ACCEPTED, ENDED, CANCEL = "accepted", "ended", "cancel"
"""A job waits; one ended, or went back to the queue; the cancel of a running one was asked for."""
WATCH, LIVE = "watch", "live"
"""A job is watched here; one that runs here got this far."""


class Notices:
    """The notices of one service.

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
