"""Hostile requests over raw connections: each is refused within limits, and the service lives on."""

import asyncio
import json
import socket
import threading
import time
from collections.abc import Iterator
from concurrent.futures import ThreadPoolExecutor
from functools import partial
from typing import Any

import pytest
import uvicorn
from each import each
from private_kinds import PRIVATE
from service_helpers import ServedClient, promptly, serving, until

import solver
from service.http.middleware.connections import Connections

BODY_SECONDS = 1.0
HEADER_SECONDS = 2.0
LATE = 25.0
"""How much later a machine with other work may keep a limit [s]; without the setting it is 30 s and more."""
JSON = "Content-Type: application/json\r\n"
CHUNKED = JSON + "Transfer-Encoding: chunked\r\n"
SCENE: dict[str, Any] = solver.load_scene("two-dof").to_dict()


@pytest.fixture(scope="module")
def service(tmp_path_factory: pytest.TempPathFactory) -> Iterator[ServedClient]:
    folder = tmp_path_factory.mktemp("hostile")
    limits = {"body_seconds": BODY_SECONDS, "upload_seconds": BODY_SECONDS, "header_seconds": HEADER_SECONDS}
    with serving(folder, PRIVATE, **limits) as client:
        client.post("/v1/plan", json={"scene": "two-dof"})  # loads what it needs
        yield client


@pytest.fixture(autouse=True)
def _alive(service: ServedClient) -> Iterator[None]:
    yield

    def trial() -> float:
        begin = time.monotonic()
        assert service.get("/health/ready").json()["ready"]
        assert service.post("/v1/plan", json={"scene": "two-dof"}).status_code == 200
        return time.monotonic() - begin

    promptly(trial, 5.0)


def connected(service: ServedClient) -> socket.socket:
    return socket.create_connection((service.base_url.host, service.base_url.port), timeout=60.0)


def answered(service: ServedClient, data: bytes, then: bytes = b"", pause: float = 0.0) -> tuple[int, bytes]:
    """Status and the whole of what comes back; 0 if the connection is closed without an answer."""
    with connected(service) as raw:
        try:
            raw.sendall(data)
            if then:
                end = time.monotonic() + 5.0
                while time.monotonic() < end:
                    raw.sendall(then)
                    time.sleep(pause)
        except (BrokenPipeError, ConnectionResetError):
            pass  # it had enough
        found = b""
        try:
            while piece := raw.recv(65536):
                found += piece
                head, _, body = found.partition(b"\r\n\r\n")
                if b"problem+json" in head and body.endswith(b"}"):
                    break
        except (ConnectionResetError, TimeoutError):
            pass
    return (int(found.split()[1]) if found.startswith(b"HTTP/1.1 ") else 0), found


def post(path: str, headers: str, body: bytes = b"", length: int | None = None) -> bytes:
    size = "" if length == -1 else f"Content-Length: {len(body) if length is None else length}\r\n"
    return f"POST {path} HTTP/1.1\r\nHost: localhost\r\n{headers}{size}\r\n".encode() + body


def body(text: str) -> bytes:
    return text.encode("utf-8", "surrogatepass")


def scene_with(**changes: Any) -> str:
    return json.dumps({"scene": {**SCENE, **changes}})


def contact_with(**changes: Any) -> str:
    return scene_with(contacts=[{**SCENE["contacts"][0], **changes}])


BODIES: dict[str, bytes] = {
    "empty": b"",
    "truncated": b'{"scene": {"name": "x", "structure": {"kind',
    "only a BOM": b"\xef\xbb\xbf",
    "with a BOM": b'\xef\xbb\xbf{"scene": "two-dof"}',
    "UTF-16": '{"scene": "two-dof"}'.encode("utf-16"),
    "invalid UTF-8": b'{"scene": "\xff\xfe\xc0\xaf"}',
    "lone surrogate": b'{"scene": {"name": "\\ud800"}}',
    "surrogate as a key": b'{"\\udfff": 1}',
    "zero character": b'{"scene": "two\\u0000dof"}',
    "nested arrays": b"[" * 19_000,
    "nested arrays, closed": b'{"scene": ' + b"[" * 9_000 + b"]" * 9_000 + b"}",
    "nested objects": b'{"a":' * 3_900 + b"1" + b"}" * 3_900,
    "nested in a scene": body(scene_with(structure=json.loads("[" * 400 + "]" * 400))),
    "NaN": b'{"scene": "two-dof", "set": {"damper.N0": NaN}}',
    "minus infinity": b'{"scene": "two-dof", "set": {"damper.N0": -Infinity}}',
    "1e999": b'{"scene": "two-dof", "set": {"damper.N0": 1e999}}',
    "1e308": b'{"scene": "two-dof", "set": {"damper.N0": 1e308}}',
    "1e308 in a scene": body(contact_with(kt=1e308)),
    "-1e308 in a scene": body(contact_with(mu=-1e308)),
    "a number of 4000 digits": b'{"scene": "two-dof", "harmonics": ' + b"9" * 4_000 + b"}",
    "a number of 10000 digits": b'{"scene": "two-dof", "harmonics": ' + b"9" * 10_000 + b"}",
    "a fraction of 15000 digits": b'{"scene": "two-dof", "set": {"damper.N0": -0.' + b"1" * 15_000 + b"}}",
    "a huge array": b'{"scene": [' + b"0," * 9_000 + b"0]}",
    "a huge object": body(json.dumps({f"k{n}": n for n in range(1500)})),
    "a long string": b'{"scene": "' + b"a" * 19_000 + b'"}',
    "many settings": body(json.dumps({"scene": "two-dof", "set": {f"a.b{n}": n for n in range(1200)}})),
    "duplicate keys": b'{"scene": "two-dof", "scene": "bladed-disk"}',
    "duplicate keys below": b'{"scene": {"name": "a", "name": "b"}}',
    "an array": b"[]",
    "a number": b"1",
    "a comment": b'{"scene": "two-dof"} // x',
    "a surrogate to be stored": b'{"kind": "iteration", "pid_file": "\\ud800"}',
    "two documents": b'{"scene": "two-dof"}{"scene": "two-dof"}',
    "single quotes": b"{'scene': 'two-dof'}",
    "wrong types": b'{"scene": 1, "set": [], "harmonics": "11", "fresh": null, "priority": {}}',
    "true for a number": b'{"scene": "two-dof", "harmonics": true}',
    "a float for a count": b'{"scene": "two-dof", "harmonics": 11.5}',
    "a path": b'{"scene": "/etc/passwd"}',
    "a path up": b'{"scene": "../../two-dof"}',
    "a URL": b'{"scene": "http://169.254.169.254/latest"}',
    "a template": b'{"scene": "${jndi:ldap://x}{{7*7}}"}',
    "a prototype": b'{"__proto__": {"a": 1}, "constructor": 1}',
    "a file of matrices": body(scene_with(structure={"kind": "matrices", "M": "/etc/passwd", "K": "K.npz",
                                                     "dofs": ["a"]})),
    "a matrix that says it is large": body(scene_with(structure={
        "kind": "matrices", "dofs": ["a"], "K": [[1.0]],
        "M": {"size": 10**9, "rows": [0], "columns": [0], "values": [1.0]}})),
    "many sectors": body(scene_with(structure={**SCENE["structure"], "kind": "cyclic", "sectors": 10**9})),
}  # fmt: skip


@each("name", BODIES)
def test_a_hostile_body_is_refused(service: ServedClient, name: str) -> None:
    before = service.get("/v1/scenes").json()["items"]
    headers = {"Content-Type": "application/json"}

    def trial(path: str) -> float:
        begin = time.monotonic()
        answer = service.post(path, content=BODIES[name], headers=headers)
        assert 400 <= answer.status_code < 500, (path, answer.text)
        assert answer.headers["content-type"] == "application/problem+json"
        assert len(answer.content) < 100_000, "what came in is not sent back"
        return time.monotonic() - begin

    for path in ("/v1/jobs", "/v1/designs", "/v1/plan", "/v1/scenes"):
        promptly(partial(trial, path), 5.0)
    assert service.get("/v1/scenes").json()["items"] == before


TINY = {
    "5e-324 as a mass": scene_with(structure={**SCENE["structure"], "masses": {"m1": 5e-324, "m2": 1.0}}),
    "5e-324 as a load": contact_with(N0=5e-324),
    "5e-324 as a stiffness": contact_with(kt=5e-324),
    "1e-300 as a force": scene_with(excitation={"dof": "m1", "amplitude": 1e-300}),
    "1e15 as a stiffness": contact_with(kt=1e15),
    "1e300 as a mass": scene_with(structure={**SCENE["structure"], "masses": {"m1": 1e300, "m2": 1.0}}),
    "a band of nothing": scene_with(observe={"dof": "m1", "band": [1.0, 1.0 + 1e-15]}),
    "a band of everything": scene_with(observe={"dof": "m1", "band": [5e-324, 1e308]}),
}


@pytest.mark.parametrize("name", TINY)
def test_numbers_at_the_ends_of_their_range_never_break_it(service: ServedClient, name: str) -> None:
    """Some are scenes, if strange ones; whatever they are, no answer is an error of the program."""
    answer = service.post("/v1/plan", content=TINY[name], headers={"Content-Type": "application/json"})
    assert answer.status_code == 200 or 400 <= answer.status_code < 500, answer.text
    assert "NaN" not in answer.text
    assert "Infinity" not in answer.text


PATHS = [
    "/v1/scenes/..%2f..%2fetc%2fpasswd", "/v1/scenes/%2e%2e/%2e%2e/etc/passwd", "/../../etc/passwd",
    "/v1/scenes/%00", "/v1/jobs/%00", "/v1/sweeps/a%00b/plot.svg", "/v1/uploads/..", "/v1/jobs/%ff%fe",
    "/v1/jobs/" + "a" * 5000, "/v1/sweeps/..%5c..%5cwindows", "/v1//jobs", "/V1/jobs", "/v1/jobs;x=1",
    "/v1/sweeps?cursor=" + "A" * 490, "/v1/sweeps?cursor=%00", "/v1/sweeps?cursor=W251bGwsIG51bGxd",
    "/v1/sweeps?limit=1e9", "/v1/sweeps?limit=-1", "/v1/sweeps?limit=99999999999999999999",
    "/v1/sweeps?peak_max=nan", "/v1/sweeps?peak_max=inf", "/v1/sweeps?peak_max=1e999",
    "/v1/sweeps?sort=id;drop table job", "/v1/sweeps?scene=" + "a" * 300, "/v1/jobs?status=%27%20OR%201=1",
    "/v1/sweeps?unknown=1", "/v1/uploads?cursor=..%2f", "/docs/../../etc/passwd", "/docs/%2e%2e/style.css",
]  # fmt: skip


@each("path", PATHS)
def test_a_path_or_query_with_tricks_finds_nothing(service: ServedClient, path: str) -> None:
    request = f"GET {path.replace(' ', '%20')} HTTP/1.1\r\nHost: localhost\r\nConnection: close\r\n\r\n"
    status, found = answered(service, request.encode())
    assert 400 <= status < 500, found[:300]
    assert b"root:" not in found


@pytest.mark.parametrize("path", ["/v1/sweeps?scene=%00", "/v1/sweeps?scene=%27--", "/v1/jobs?scene=%ff"])
def test_a_filter_with_tricks_finds_nothing(service: ServedClient, path: str) -> None:
    answer = service.get(path)
    assert answer.status_code == 422 or answer.json()["items"] == []


HEADERS = {
    "a header of 100 kB": "X-Large: " + "a" * 100_000 + "\r\n",
    "3000 headers": "".join(f"X-{n}: {'a' * 30}\r\n" for n in range(3000)),
    "a bad idempotency key": "Idempotency-Key: a b\r\n",
    "a long idempotency key": "Idempotency-Key: " + "a" * 300 + "\r\n",
    "gzip": "Content-Encoding: gzip\r\n",
    "another host": "Host: evil.example\r\n",
    "two lengths": "Content-Length: 3\r\n",
    "a folded header": "X-A: b\r\n c\r\n",
    "a bare line feed": "X-A: b\n\nGET / HTTP/1.1\r\n",
    "a zero character": "X-A: \x00\r\n",
    "an unknown transfer coding": "Transfer-Encoding: xchunked\r\n",
}


@each("name", HEADERS)
def test_a_hostile_header_is_refused(service: ServedClient, name: str) -> None:
    sent = post("/v1/jobs", JSON + "Connection: close\r\n" + HEADERS[name], b'{"kind": "none"}')
    status, found = answered(service, sent)
    assert 400 <= status < 500, found[:300]


SMUGGLED = {
    "length and chunks": (
        post(
            "/v1/jobs",
            CHUNKED + "Connection: close\r\n",
            b"0\r\n\r\nGET / HTTP/1.1\r\n\r\n",
        )
    ),
    "a negative length": post("/v1/jobs", JSON, b"{}", length=-5),
    "a length with a sign": post("/v1/jobs", JSON + "Content-Length: +2\r\n", b"{}", length=-1),
    "a length of 30 digits": post("/v1/jobs", JSON, b"{}", length=10**30),
    "a chunk of 16 EB": post("/v1/jobs", CHUNKED, b"ffffffffffffffff\r\n{", length=-1),
    "a chunk of no size": post("/v1/jobs", CHUNKED, b"zz\r\n{}\r\n", length=-1),
    "no HTTP": b"\x16\x03\x01\x02\x00\x01\x00\x01\xfc\x03\x03" + bytes(300),
    "HTTP/0.9": b"GET /\r\n\r\n",
    "HTTP/9.9": b"GET /none HTTP/9.9\r\nHost: localhost\r\n\r\n",
    "a method of 10 kB": b"A" * 10_000 + b" / HTTP/1.1\r\nHost: localhost\r\nConnection: close\r\n\r\n",
    "a path of 100 kB": b"GET /" + b"a" * 100_000 + b" HTTP/1.1\r\nHost: localhost\r\n\r\n",
    "no host": b"GET /health/live HTTP/1.1\r\n\r\n",
}


@each("name", SMUGGLED)
def test_a_request_out_of_form_is_refused(service: ServedClient, name: str) -> None:
    status, found = answered(service, SMUGGLED[name])
    assert status == 0 or 400 <= status < 500, found[:300]


def test_bodies_that_do_not_come_are_given_up(service: ServedClient) -> None:
    """Nothing after the headers, one byte at a time, chunks without end: 408 when their time is over."""

    def meet(asked: tuple[bytes, bytes, float]) -> tuple[int, bytes, float]:
        begin = time.monotonic()
        return *answered(service, *asked), time.monotonic() - begin

    bodies = [
        (post(path, kind, begin, length=length), then, pause)
        for path in ("/v1/jobs", "/v1/uploads?name=M.npz")
        for kind, begin, length, then, pause in (
            (JSON, b"{", 1000, b"", 0.0), (JSON, b"{", 1000, b" ", 0.05),
            (CHUNKED, b"", -1, b"1\r\n \r\n", 0.05),
        )
    ]  # fmt: skip
    with ThreadPoolExecutor(len(bodies)) as pool:
        for status, found, took in pool.map(meet, bodies):
            assert status == 408, found[:300]
            assert b"onnection: close" in found
            assert took < BODY_SECONDS + LATE


def closed_after(raw: socket.socket, then: bytes) -> tuple[float, bytes]:
    """Send the rest byte by byte until the other side closes: how long that took [s], and what came back."""
    begin, found = time.monotonic(), b""
    raw.settimeout(0.05)
    while time.monotonic() - begin < 2.0 * LATE:
        try:
            raw.sendall(then)
            piece = raw.recv(65536)
        except TimeoutError:
            continue
        except (BrokenPipeError, ConnectionResetError):
            break
        if not piece:
            break
        found += piece
    return time.monotonic() - begin, found


WHOLE = b"GET /health/live HTTP/1.1\r\nHost: localhost\r\n\r\n"
SLOW: dict[str, tuple[bytes, bytes, bool]] = {
    "says nothing": (b"", b"", False),
    "a byte at a time": (b"GET /health/live HTTP/1.1\r\nX-Slow: ", b"a", True),
    "the second request a byte at a time": (WHOLE + b"GET", b" ", True),
    "a body without end for who did not want it": (post("/none", JSON, b"{", length=10**6), b" ", True),
}


def test_headers_that_do_not_come_are_given_up(service: ServedClient) -> None:
    """All at once, each with a connection of its own."""

    def meet(name: str) -> tuple[float, bytes]:
        begin, then, _ = SLOW[name]
        with connected(service) as raw:
            raw.sendall(begin)
            return closed_after(raw, then)

    with ThreadPoolExecutor(len(SLOW)) as pool:
        for name, (took, found) in zip(SLOW, pool.map(meet, SLOW), strict=True):
            assert took < 9.0, f"{name}: without the setting it would be 10 s"
            assert (b"HTTP/1.1 4" in found) == SLOW[name][2], (name, found)


async def answer(_scope: Any, _receive: Any, send: Any) -> None:
    """An application of a few bytes, which takes longer than headers may."""
    await asyncio.sleep(1.2)
    await send({"type": "http.response.start", "status": 200, "headers": [(b"content-length", b"2")]})
    await send({"type": "http.response.body", "body": b"ok"})


@pytest.mark.parametrize("loop", ["asyncio", "uvloop"])
def test_the_limit_holds_for_every_loop(loop: Any) -> None:
    """Also behind an answer; and it is a limit of the headers, not of the answer."""
    pytest.importorskip(loop)
    connections = Connections(most=100, header_seconds=0.8, write_seconds=60.0, unsent_bytes=1_000_000)
    config = uvicorn.Config(
        answer,
        http=connections.protocol,
        loop=loop,
        port=0,
        log_config=None,
        lifespan="off",
        timeout_keep_alive=60,
    )
    server = uvicorn.Server(config)
    thread = threading.Thread(target=server.run)
    thread.start()
    try:
        until(lambda: server.started)
        address = server.servers[0].sockets[0].getsockname()
        with socket.create_connection(address, timeout=60.0) as raw:
            raw.sendall(WHOLE)
            assert raw.recv(1000).startswith(b"HTTP/1.1 200"), "later than that"
            raw.sendall(WHOLE[:9])
            took, found = closed_after(raw, b"a")
        assert took < LATE
        assert b"408 Request Timeout" in found
    finally:
        server.should_exit = True
        thread.join()


def test_bodies_without_end_are_cut_off(service: ServedClient) -> None:
    limit = service.service.settings.max_body_bytes
    declared, _ = answered(service, post("/v1/jobs", JSON, b"{", length=10**9))
    assert declared == 413
    chunked = post("/v1/jobs", CHUNKED, length=-1)
    endless, found = answered(service, chunked, b"1000\r\n" + b" " * 0x1000 + b"\r\n")
    assert endless == 413, found[:300]
    assert len(found) < limit


def test_clients_that_leave_are_forgotten(service: ServedClient, caplog: pytest.LogCaptureFixture) -> None:
    for data in (
        post("/v1/jobs", JSON, b'{"kind": ', length=1000),
        post("/v1/uploads?name=M.npz", "", b"PK", length=1000),
        b"GET /v1/jobs HTTP/1.1\r\nHost: loc",
        b"",
    ):
        with connected(service) as raw:
            raw.sendall(data)
    time.sleep(0.3)
    assert not [record for record in caplog.records if record.levelname == "ERROR"]


def test_many_idle_connections_leave_room_for_others(service: ServedClient) -> None:
    idle = [connected(service) for _ in range(200)]
    for raw in idle[::2]:
        raw.sendall(b"GET /v1/jobs HTTP/1.1\r\nX-Slow: ")
    assert service.get("/health/live").status_code == 200
    for raw in idle:
        raw.close()
