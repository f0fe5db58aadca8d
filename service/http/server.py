"""`stickslip serve` and `stickslip worker`: processes that run a service until told to stop.

The server listens before the service is loaded: what that is made of is imported where it is used.
"""

from __future__ import annotations

import asyncio
import ctypes
import gc
import logging
import os
import signal
import socket
import sys
import threading
import time
from collections.abc import Callable, Iterator
from concurrent.futures import Future
from contextlib import contextmanager
from types import SimpleNamespace
from typing import TYPE_CHECKING, Any, cast

import uvicorn
from starlette.responses import Response

from service.errors import ConfigurationError
from service.http.middleware.connections import Connections
from service.settings import logs

if TYPE_CHECKING:
    from fastapi import FastAPI
    from starlette.types import Receive, Scope, Send

    from service.jobs.kind_registry import Registry
    from service.queue.core import Service
    from service.settings.settings import Settings

log = logging.getLogger("stickslip.service")

_TICK_SECONDS = 0.2
# Files of a service besides its connections: database, workers, pipes, uploads.
_OTHER_FILES = 256
_LEAST_CONNECTIONS = 16
_HEADER_BYTES = 16 * 1024
_FORCED = 1


class _Server(uvicorn.Server):
    """A server that sends waiting requests home before it waits for them to end."""

    def __init__(self, config: uvicorn.Config, service: Service | _Opening) -> None:
        super().__init__(config)
        self._service = service

    async def shutdown(self, sockets: list[socket.socket] | None = None) -> None:
        """Stop."""
        self._service.stop_waiting()
        await super().shutdown(sockets)


class _Opening:
    """An application that is being loaded, by `load` in a thread: it lives, and what else it is asked waits.

    Where that, its beginning or its end goes wrong `ended` is called, and `trouble` says how.
    """

    def __init__(
        self, settings: Settings, load: Callable[[Connections], FastAPI], ended: Callable[[], object]
    ) -> None:
        self.state = SimpleNamespace(connections=Connections.of(settings))
        self.trouble: Exception | None = None
        self._load, self._ended = load, ended
        self._app: asyncio.Future[FastAPI]

    async def __call__(self, scope: Scope, receive: Receive, send: Send) -> None:
        """Answer a request; begin and end with the server."""
        if scope["type"] == "lifespan":
            await self._live(receive, send)
        elif not self._app.done() and scope["path"] == "/health/live":
            await Response(b'{"status":"live"}', media_type="application/json")(scope, receive, send)
        else:
            await asyncio.wait({self._app})
            answer = Response(status_code=503) if self._app.cancelled() else self._app.result()
            await answer(scope, receive, send)

    async def _live(self, receive: Receive, send: Send) -> None:
        made: Future[Any] = Future()
        self._app, loaded = asyncio.get_running_loop().create_future(), asyncio.wrap_future(made)
        # Who is told to end meanwhile does not wait for the thread, as for one of a pool.
        threading.Thread(target=self._make, args=(made,), daemon=True).start()
        await receive()
        await send({"type": "lifespan.startup.complete"})
        ended = asyncio.ensure_future(receive())
        await asyncio.wait({loaded, ended}, return_when=asyncio.FIRST_COMPLETED)
        try:
            if not (ended.done() or self._app.cancelled()):
                app = loaded.result()
                async with app.router.lifespan_context(app):
                    self._app.set_result(app)
                    await ended
        except Exception as error:  # noqa: BLE001 - raised by whoever runs the server
            self.trouble = error
            self._app.cancel()
            self._ended()
        loaded.cancel()
        await ended
        await send({"type": "lifespan.shutdown.complete"})

    def _make(self, made: Future[FastAPI]) -> None:
        made.set_running_or_notify_cancel()
        try:
            made.set_result(self._load(self.state.connections))
        except Exception as error:  # noqa: BLE001 - as above
            made.set_exception(error)

    def stop_waiting(self) -> None:
        """The server stops: end every request that waits for a job, or for the application."""
        if not self._app.done():
            self._app.cancel()
        elif not self._app.cancelled():
            self._app.result().state.service.stop_waiting()


def serve(settings: Settings, registry: Registry | None = None) -> None:
    """Serve HTTP until SIGINT or SIGTERM; jobs that run then go back to the queue.

    ConfigurationError if the address cannot be used; DatabaseError if the database cannot be used (see
    `Service.start`).
    """
    logs.configure(settings.log_level, settings.log_format)
    listener = _bind(settings)
    port = listener.getsockname()[1]

    def load(connections: Connections) -> FastAPI:
        from service.http.app import create_app

        app = create_app(settings, registry, connections)
        app.state.service.open()
        log.info("listening on http://%s:%d", settings.host, port)
        spare_modules()
        give_back_memory()
        threading.Thread(target=_begin_the_rest, args=(app,), daemon=True).start()
        return app

    def end() -> None:
        server.should_exit = True

    def stop() -> None:
        end()
        _end_by_force_after(settings.exit_seconds)

    opening = _Opening(settings, load, end)
    server = _Server(_config(opening, settings), opening)
    try:
        with _signals(stop):
            server.run(sockets=[listener])
    finally:
        listener.close()
    if opening.trouble is not None:
        raise opening.trouble


def work(settings: Settings, registry: Registry | None = None, *, until_empty: bool = False) -> None:
    """Run the queue and its workers without HTTP until SIGINT or SIGTERM.

    On PostgreSQL this adds workers to the services that run, from any machine. On SQLite one process owns
    the file: this works off the jobs that wait in it while no service does.

    `Service.open` lists the errors. `until_empty`: end when no job waits or runs.
    """
    from service.queue.core import Service

    logs.configure(settings.log_level, settings.log_format)
    stop = threading.Event()
    service = Service(settings, registry)

    def told_to_stop() -> None:
        stop.set()
        _end_by_force_after(settings.exit_seconds)

    with _signals(told_to_stop):
        service.start()
        try:
            while not stop.wait(_TICK_SECONDS):
                if until_empty and _nothing_left(service):
                    return
        finally:
            service.stop()


def _config(app: FastAPI | _Opening, settings: Settings) -> uvicorn.Config:
    connections: Connections = app.state.connections
    room = max(_files_allowed() - _OTHER_FILES, _LEAST_CONNECTIONS)
    if room < connections.most:
        log.warning("the system's limit of open files leaves room for %d connections", room)
        connections.most = room
    return uvicorn.Config(
        app, http=cast(type[asyncio.Protocol], connections.protocol), log_config=None, access_log=False,
        lifespan="on", timeout_graceful_shutdown=max(1, round(settings.shutdown_seconds)),
        server_header=False, h11_max_incomplete_event_size=_HEADER_BYTES,
        proxy_headers=bool(settings.trusted_proxies), forwarded_allow_ips=list(settings.trusted_proxies),
    )  # fmt: skip


def _begin_the_rest(app: FastAPI) -> None:
    """Start the processes of answers and previews when a worker is ready; make what the page asks for first.

    Nothing is to delay readiness; who asks for either before gets it at once. Where no kernels are compiled
    yet both begin interpreted, at once, and anew when the workers have them.
    """
    from service.http.openapi import prepare

    service: Service = app.state.service
    if service.compiling:
        service.answers.begin()
        service.previews.begin()
    while not service.queue.status().ready:
        if service.stopping.wait(_TICK_SECONDS):
            return
    if service.compiling:
        service.compiling = False
        service.answers.renew()
        service.previews.renew()
    service.answers.begin()
    prepare(app)
    service.previews.begin()


def _end_by_force_after(seconds: float) -> None:
    """End this process in some time [s] if it has not ended by itself; its workers notice and end too.

    Jobs that ran are then computed again, as after a crash.
    """

    def end() -> None:
        log.error("the service did not end within %g s and is ended by force", seconds)
        logging.shutdown()
        os._exit(_FORCED)

    timer = threading.Timer(seconds, end)
    timer.daemon = True
    timer.start()


def _files_allowed() -> int:
    """How many files, connections among them, this process may open; as many as it can be given."""
    if sys.platform == "win32":
        return 1 << 20
    import resource

    soft, hard = resource.getrlimit(resource.RLIMIT_NOFILE)
    if soft != hard:
        resource.setrlimit(resource.RLIMIT_NOFILE, (hard, hard))
        log.info("may open %d files, %d before", hard, soft)
    return 1 << 20 if hard == resource.RLIM_INFINITY else hard


@contextmanager
def _signals(stop: Callable[[], object]) -> Iterator[None]:
    """Call `stop` on SIGINT and SIGTERM; the process then ends by itself, with status 0."""
    if threading.current_thread() is not threading.main_thread():
        yield
        return
    numbers = (signal.SIGINT, signal.SIGTERM)
    handlers = {number: signal.signal(number, lambda *_: stop()) for number in numbers}
    try:
        yield
    finally:
        for number, handler in handlers.items():
            signal.signal(number, handler)


def _nothing_left(service: Service) -> bool:
    from service.db.models import JobState

    counts = service.jobs.count()
    return counts[JobState.ACCEPTED] + counts[JobState.RUNNING] == 0


def _bind(settings: Settings) -> socket.socket:
    """A listening socket; said before workers start if the port is taken."""
    family = socket.AF_INET6 if ":" in settings.host else socket.AF_INET
    # With the protocol named, asyncio switches Nagle's algorithm off, which would hold answers for 40 ms.
    listener = socket.socket(family, socket.SOCK_STREAM, socket.IPPROTO_TCP)
    listener.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)
    try:
        listener.bind((settings.host, settings.port))
    except OSError as error:
        listener.close()
        raise ConfigurationError(
            f"cannot listen on {settings.host} port {settings.port}: {error.strerror or error}. "
            "Choose another `--port`, or stop what uses this one"
        ) from error
    return listener


class Sparing:
    """A callback of the collector that takes loaded modules out of its work.

    A service has a quarter of a million objects of modules, many loaded by the first request that needs
    them. A full collection walks through them all, and every request waits for it: 0.1 s on an idle machine.
    Here the first one after modules were loaded is the last that sees them.
    """

    def __init__(self) -> None:
        self._modules = 0

    def __call__(self, phase: str, info: dict[str, Any]) -> None:
        """After a full collection, spare what it left, if modules were loaded since the last time."""
        if phase == "stop" and info["generation"] == 2 and len(sys.modules) != self._modules:
            self._modules = len(sys.modules)
            gc.freeze()


def spare_modules() -> None:
    """Begin, with what is loaded now, nearly all of which stays."""
    gc.callbacks.append(Sparing())
    gc.freeze()


_M_MMAP_THRESHOLD, _M_ARENA_MAX = -3, -8
_LARGE_BYTES = 256 * 1024
_ARENAS = 2
_TRIM_SECONDS = 60.0


def give_back_memory() -> None:
    """Have glibc keep little of what is freed, from now on.

    By default each thread has an arena of its own, in which what it freed stays, and the size from which
    blocks are mapped by themselves rises to that of the largest one freed, up to 32 MB. A service with many
    threads then grows for hours although it holds nothing more: here there are two arenas, large blocks are
    always mapped, and once a minute the pages that nobody uses go back to the system.
    """
    if sys.platform != "linux":
        return
    libc = ctypes.CDLL(None)
    if not hasattr(libc, "mallopt") or not hasattr(libc, "malloc_trim"):
        return  # musl has none
    libc.mallopt(_M_MMAP_THRESHOLD, _LARGE_BYTES)
    libc.mallopt(_M_ARENA_MAX, _ARENAS)

    def trim() -> None:
        while True:
            time.sleep(_TRIM_SECONDS)
            libc.malloc_trim(0)

    threading.Thread(target=trim, name="stickslip memory", daemon=True).start()
