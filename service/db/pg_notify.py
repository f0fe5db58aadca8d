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
from collections.abc import Callable
from multiprocessing.connection import wait
from typing import Any

log = logging.getLogger("stickslip.notices")

_CHANNEL = "stickslip"
_SEND = "SELECT pg_notify(%s, notice) FROM unnest(%s::text[]) AS notice"
_AGAIN_SECONDS = 2.0
_ACCEPTED, _ENDED, _CANCEL, _WATCH, _LIVE = "accepted", "ended", "cancel", "watch", "live"
_USED = "used"

OfJob = Callable[[str], None]


class Notices:
    """The notices of one service.

    Parameters
    ----------
    connect : callable
        Opens a connection of psycopg that commits by itself.
    accepted : callable
        Called when a job waits that another service accepted, and when notices may have been missed.
    ended : callable
        Called with the id of a job that ended at another service.
    cancel : callable
        Called with the id of a running job whose cancel was asked for at another service.
    watched, live : callable
        Called with what another service says of a job that it watches, and of one that it runs.
    used : callable
        Called with what another service says of what owners use there.
    """

    def __init__(
        self, connect: Callable[[], Any], *, accepted: Callable[[], None], ended: OfJob, cancel: OfJob,
        watched: OfJob, live: OfJob, used: OfJob,
    ) -> None:  # fmt: skip
        self._connect = connect
        self._accepted = accepted
        self._of_job = {_ENDED: ended, _CANCEL: cancel, _WATCH: watched, _LIVE: live, _USED: used}
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

    def tell_accepted(self) -> None:
        """A job waits."""
        self._tell(_ACCEPTED)

    def tell_ended(self, job_id: str) -> None:
        """A job ended, or went back to the queue."""
        self._tell(f"{_ENDED}:{job_id}")

    def tell_cancel(self, job_id: str) -> None:
        """The cancel of a running job was asked for."""
        self._tell(f"{_CANCEL}:{job_id}")

    def tell_watch(self, text: str) -> None:
        """A job is watched here."""
        self._tell(f"{_WATCH}:{text}")

    def tell_live(self, text: str) -> None:
        """A job that runs here got this far."""
        self._tell(f"{_LIVE}:{text}")

    def tell_used(self, text: str) -> None:
        """Owners use so much here."""
        self._tell(f"{_USED}:{text}")

    def _tell(self, notice: str) -> None:
        self._waiting.append(notice)
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
        word, _, job_id = payload.partition(":")
        if word == _ACCEPTED:
            self._accepted()
        elif word in self._of_job:
            self._of_job[word](job_id)
