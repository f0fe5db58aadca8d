"""Connections: how many there are, how long they may be silent, and how much they may leave untaken.

uvicorn closes a connection that is silent after an answer. One that never says anything, or sends its
headers byte by byte, it keeps for ever, so does one that goes on with a body after the answer, and one that
does not take its answer holds that in memory. Here each of them has a limit, none of which needs anything of
how HTTP is parsed. Of uvicorn's protocols the one of h11 is used whatever else is installed: it limits the
size of headers, and measured under load the other one was not faster.
"""

from __future__ import annotations

import asyncio
import logging
from collections.abc import Iterable
from typing import TYPE_CHECKING, Any

from uvicorn.protocols.http.h11_impl import H11Protocol

from service.errors import TooManyRequestsError

if TYPE_CHECKING:
    from service.settings.settings import Settings

log = logging.getLogger("stickslip.http")

KEY = "stickslip.connection"
"""Where a request's state has its connection."""
_TOO_SLOW = (
    b"HTTP/1.1 408 Request Timeout\r\ncontent-type: text/plain; charset=utf-8\r\n"
    b"content-length: 34\r\nconnection: close\r\n\r\nThe headers did not come in time.\n"
)
_LOOKS = 4
_LONGEST_LOOK_SECONDS = 1.0
_STALLED_SECONDS = 0.5
_RETRY_SECONDS = 5


class Connections:
    """All connections of one server; used by its event loop alone.

    Parameters
    ----------
    most : how many there may be. For one more, the one that has been idle for longest is closed.
    header_seconds : time the headers of a request may take to arrive [s].
    write_seconds : time in which a client must take something of its answer [s].
    unsent_bytes : most that one owner's clients may leave untaken.
    """

    def __init__(self, most: int, header_seconds: float, write_seconds: float, unsent_bytes: int) -> None:
        self.most = most
        self.header_seconds = header_seconds
        self._write_seconds = write_seconds
        self._unsent_bytes = unsent_bytes
        self._open: set[Connection] = set()
        # Those without a request, the one that has been so for longest first.
        self._idle: dict[Connection, None] = {}
        # Those whose clients take less than they are sent.
        self._paused: set[Connection] = set()
        self._look_at: asyncio.TimerHandle | None = None

    @classmethod
    def of(cls, settings: Settings) -> Connections:
        """Those of a server with such settings."""
        return cls(
            settings.connections, settings.header_seconds, settings.write_seconds, settings.unsent_bytes
        )

    def protocol(self, **values: Any) -> Connection:
        """A protocol for a new connection, from what uvicorn gives its own."""
        return Connection(self, **values)

    def add(self, made: Connection) -> bool:
        """Count a new connection; whether it may stay."""
        if len(self._open) >= self.most and self._idle:
            oldest = next(iter(self._idle))
            self.remove(oldest)
            oldest.transport.abort()
        if len(self._open) >= self.most:
            return False
        self._open.add(made)
        self._idle[made] = None
        if self._look_at is None:
            self._look_later(made.loop)
        return True

    def remove(self, gone: Connection) -> None:
        """A connection ended."""
        self._open.discard(gone)
        self._idle.pop(gone, None)
        self._paused.discard(gone)

    def paused(self, one: Connection, *, now: bool) -> None:
        """A connection's client takes less than it is sent, or has caught up."""
        if now and one in self._open:
            self._paused.add(one)
        else:
            self._paused.discard(one)

    def busy(self, one: Connection) -> None:
        """A connection has a request."""
        self._idle.pop(one, None)

    def idle(self, one: Connection) -> None:
        """A connection has none any more."""
        if one in self._open:
            self._idle[one] = None

    def require_taken(self, owner: str) -> None:
        """Refuse an owner whose clients leave too much untaken; those of them who stall are disconnected.

        TooManyRequestsError if it is too much all the same.
        """
        held = sorted((one for one in self._paused if one.owner == owner), key=lambda one: one.since)
        unsent = _together(held)
        for one in list(held):
            if unsent <= self._unsent_bytes:
                return
            if one.stalled() >= _STALLED_SECONDS:
                held.remove(one)
                self._end(one)
                unsent = _together(held)
        if unsent > self._unsent_bytes:
            raise TooManyRequestsError(
                f"{unsent} bytes of answers were not taken yet: read them, then ask again", _RETRY_SECONDS
            )

    def _look_later(self, loop: asyncio.AbstractEventLoop) -> None:
        seconds = min(self._write_seconds / _LOOKS, _LONGEST_LOOK_SECONDS)
        self._look_at = loop.call_later(seconds, self._look, loop)

    def _look(self, loop: asyncio.AbstractEventLoop) -> None:
        """Disconnect who takes nothing."""
        for one in [one for one in self._open if one.stalled() >= self._write_seconds]:
            self._end(one)
        self._look_at = None
        if self._open:
            self._look_later(loop)

    def _end(self, one: Connection) -> None:
        log.warning(
            "a client at %s took nothing of its answer for %.1f s: %d bytes are thrown away",
            one.client[0] if one.client else "unknown", one.stalled(), one.unsent(),
        )  # fmt: skip
        self.remove(one)
        one.transport.abort()


def _together(connections: Iterable[Connection]) -> int:
    """Bytes that these clients have not taken; a body that several of them read is held once."""
    found = list(connections)
    bodies = {id(one.held): len(one.held) for one in found}
    return sum(one.unsent() for one in found) + sum(bodies.values())


class Connection(H11Protocol):
    """One connection, closed when its next request does not come in time.

    That time begins with the connection, and after an answer with the first byte of what comes next; further
    bytes do not prolong it.
    """

    def __init__(self, all_of_them: Connections, **values: Any) -> None:
        super().__init__(**values)
        self.app_state = {**self.app_state, KEY: self}
        self.owner = ""
        self.since = 0.0
        self.all_of_them = all_of_them
        self.held = b""
        """The body that is being sent."""
        self.sent = 0
        """Bytes of bodies handed to the transport since the connection began."""
        self._taken = 0
        self._deadline: asyncio.TimerHandle | None = None
        self._heard = False

    def connection_made(self, transport: asyncio.Transport) -> None:  # type: ignore[override]
        """Keep it, if there is room for it."""
        super().connection_made(transport)
        if self.all_of_them.add(self):
            self._wait()
        else:
            transport.abort()

    def connection_lost(self, exc: Exception | None) -> None:
        """It ended."""
        self.all_of_them.remove(self)
        self._begun()
        super().connection_lost(exc)

    def data_received(self, data: bytes) -> None:
        """Bytes of a request, or of what follows it."""
        super().data_received(data)
        if self.cycle is not None and not self.cycle.response_complete:
            self._begun()
            self.all_of_them.busy(self)
        else:
            self._heard = True
            self._wait()

    def on_response_complete(self) -> None:
        """An answer is written; the next request may have come already."""
        super().on_response_complete()
        if self.cycle is None or self.cycle.response_complete:
            self.all_of_them.idle(self)

    def pause_writing(self) -> None:
        """The client takes less than it is sent."""
        super().pause_writing()
        self.all_of_them.paused(self, now=True)

    def resume_writing(self) -> None:
        """It has taken most of it."""
        super().resume_writing()
        self.all_of_them.paused(self, now=False)

    def unsent(self) -> int:
        """Bytes handed to the transport that the client has not taken."""
        return self.transport.get_write_buffer_size()

    def stalled(self) -> float:
        """For how long the client has taken nothing of what there is for it [s]; looked at now and then."""
        now, unsent = self.loop.time(), self.unsent()
        taken = self.sent - unsent
        if unsent == 0 or taken != self._taken:
            self.since = now
        self._taken = taken
        return now - self.since

    def _wait(self) -> None:
        if self._deadline is None:
            self._deadline = self.loop.call_later(self.all_of_them.header_seconds, self._too_slow)

    def _begun(self) -> None:
        if self._deadline is not None:
            self._deadline.cancel()
            self._deadline = None

    def _too_slow(self) -> None:
        if self.transport.is_closing():
            return
        if self._heard:
            self.transport.write(_TOO_SLOW)
        self.transport.close()
