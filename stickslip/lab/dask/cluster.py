"""The connection to a Dask scheduler: made, watched, lost and made again."""

from __future__ import annotations

import logging
import pickle
import threading
from collections.abc import Callable, Mapping
from typing import Any

from distributed import Client, Future, Security

from stickslip.lab.dask.tasks import TOPIC, Order, TaskAnswer, ask_to_stop, compute

log = logging.getLogger("stickslip.executor")

_CONNECT_SECONDS = 2.0
_LOOK_SECONDS = 1.0
_ANSWER_SECONDS = 10.0
_BACKOFF_SECONDS = (0.2, 0.5, 1.0, 2.0)

OnNote = Callable[[dict[str, Any]], None]


class Cluster:
    """A thread that keeps a client of the scheduler.

    Parameters
    ----------
    address : str
        Of the scheduler.
    security : Security or None
        Certificates, for a tls:// address.
    on_note : callable
        Called with what workers say, in a thread that must not wait.
    on_look : callable
        Called about every second while there is a connection: whether the number of threads has changed.
    on_lost : callable
        Called with the reason when there is no connection, or none any more.
    """

    def __init__(
        self,
        address: str,
        security: Security | None,
        on_note: OnNote,
        on_look: Callable[[bool], None],
        on_lost: Callable[[str], None],
    ) -> None:
        self.address = address
        self.threads = 0
        self.trouble: str | None = None
        self._security = security
        self._on_note = on_note
        self._on_look = on_look
        self._on_lost = on_lost
        self._client: Client | None = None
        self._closing = False
        self._wake = threading.Event()
        self._thread = threading.Thread(target=self._keep, name="stickslip cluster", daemon=True)

    @property
    def connected(self) -> bool:
        """Whether orders can be sent."""
        client = self._client
        return client is not None and client.status == "running"

    def start(self) -> None:
        """Begin to connect; returns at once."""
        self._thread.start()

    def send(self, order: Order, priority: int) -> Future:
        """Send an order.

        Raises
        ------
        OSError
            If the connection is lost.
        """
        client = self._client
        if client is None or client.status != "running":
            raise ConnectionError(f"there is no connection to the Dask scheduler at {self.address}")
        return client.submit(
            compute, order, key=f"stickslip-{order.kind}-{order.token}", pure=False, retries=0,
            priority=priority,
        )  # fmt: skip

    def ask_to_stop(self, workers: Mapping[str, list[str]]) -> None:
        """Have orders end with what they kept: their tokens by the address of the worker."""
        client = self._client
        if client is not None and client.status == "running":
            for worker, tokens in workers.items():
                client.run(ask_to_stop, tokens, workers=[worker], wait=False, on_error="ignore")

    def restart(self, worker: str) -> None:
        """End the process of a worker by force; its nanny starts another one."""
        client = self._client
        if client is not None:
            client.restart_workers([worker], timeout=_ANSWER_SECONDS, raise_for_error=False)

    def look(self) -> None:
        """Look at the connection now: something came back that speaks of its loss."""
        self._wake.set()

    def close(self) -> None:
        """Let the client go, and with it all that is still computed for it."""
        self._closing = True
        self._wake.set()
        if self._thread.ident is not None:
            self._thread.join()

    def _keep(self) -> None:
        failures = 0
        while not self._closing:
            try:
                self._watch(self._connected())
                failures = 0
            except (OSError, ValueError, RuntimeError) as error:
                self._lost(f"the Dask scheduler at {self.address} does not answer: {error}")
            if not self._closing:
                delay = _BACKOFF_SECONDS[min(failures, len(_BACKOFF_SECONDS) - 1)]
                failures += 1
                self._wake.clear()
                self._wake.wait(delay)

    def _connected(self) -> Client:
        client = Client(
            self.address, timeout=_CONNECT_SECONDS, set_as_default=False, security=self._security,
            name="stickslip",
        )  # fmt: skip
        client.subscribe_topic(TOPIC, self._hear)
        log.info("connected to the Dask scheduler at %s", self.address)
        return client

    def _hear(self, event: tuple[float, Any]) -> None:
        if isinstance(event[1], dict):
            self._on_note(event[1])

    def _watch(self, client: Client) -> None:
        """Use one client until the connection is lost or it is time to close."""
        scheduler: str | None = None
        try:
            while not self._closing and client.status == "running":
                self._wake.clear()
                info = client.sync(client.scheduler.identity, n_workers=0, callback_timeout=_ANSWER_SECONDS)
                scheduler = scheduler or info["id"]
                if info["id"] != scheduler:
                    # The client found a new scheduler by itself, which knows nothing of what was sent.
                    break
                self._client = client
                self._seen(info["n_workers"], info["total_threads"])
                self._wake.wait(_LOOK_SECONDS)
            if not self._closing:
                self._lost(f"the connection to the Dask scheduler at {self.address} was lost")
        finally:
            self._client = None
            client.close(timeout=_LOOK_SECONDS)

    def _seen(self, workers: int, threads: int) -> None:
        self.trouble = None if workers else f"the Dask scheduler at {self.address} has no workers"
        changed, self.threads = threads != self.threads, threads
        if changed:
            log.info("the Dask scheduler at %s has %d workers, %d threads", self.address, workers, threads)
        self._on_look(changed)

    def _lost(self, trouble: str) -> None:
        if trouble != self.trouble:
            log.error("%s", trouble)
        self.trouble, self.threads = trouble, 0
        self._on_lost(trouble)


def answer_of(future: Future, seconds: float = _ANSWER_SECONDS) -> TaskAnswer:
    """What a worker answered, within so long.

    Raises
    ------
    Exception
        Whatever became of the order instead.
    """
    # From a worker, which the scheduler trusts; never from a request.
    answer = pickle.loads(future.result(timeout=seconds))
    if not isinstance(answer, TaskAnswer):
        raise TypeError(f"a worker answered {type(answer).__name__}")
    return answer
