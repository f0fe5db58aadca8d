"""Connections that do not say what they want: the server's protocol with a limit of time.

uvicorn closes a connection that is silent after an answer. One that never says anything, or sends its
headers byte by byte, it keeps for ever, and so does one that goes on with a body after the answer. The limit
here is on the time between requests in which a client has begun to send, so it needs nothing of how headers
are parsed. Of uvicorn's protocols the one of h11 is used whatever else is installed: it limits the size of
headers, and measured under load the other one was not faster.
"""

from __future__ import annotations

import asyncio

from uvicorn.protocols.http.h11_impl import H11Protocol

_TOO_SLOW = (
    b"HTTP/1.1 408 Request Timeout\r\ncontent-type: text/plain; charset=utf-8\r\n"
    b"content-length: 34\r\nconnection: close\r\n\r\nThe headers did not come in time.\n"
)


def patient(seconds: float) -> type[asyncio.Protocol]:
    """A protocol for uvicorn whose connections have so long to send the headers of a request [s].

    The time begins with the connection, and after an answer with the first byte of what comes next; further
    bytes do not prolong it.
    """

    class Patient(H11Protocol):
        """Closes connections whose next request does not come in time."""

        _deadline: asyncio.TimerHandle | None = None
        _heard = False

        def connection_made(self, transport: asyncio.Transport) -> None:  # type: ignore[override]
            super().connection_made(transport)
            self._wait()

        def connection_lost(self, exc: Exception | None) -> None:
            self._begun()
            super().connection_lost(exc)

        def data_received(self, data: bytes) -> None:
            super().data_received(data)
            if self.cycle is not None and not self.cycle.response_complete:
                self._begun()
            else:
                self._heard = True
                self._wait()

        def _wait(self) -> None:
            if self._deadline is None:
                self._deadline = self.loop.call_later(seconds, self._too_slow)

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

    return Patient
