"""The proxies of deploy/ in front of a real service: TLS, events as they come, uploads; what is watched."""

from __future__ import annotations

import os
import re
import shutil
import ssl
import subprocess
import sys
import time
from collections.abc import Iterator
from pathlib import Path

import httpx
import pytest
from launch import free_port
from private_kinds import PRIVATE
from service_helpers import ServedClient, serving, until

from service.auth.authenticator import create
from service.auth.callers import Scope
from service.db.clock import utc_now
from service.http.app import create_app
from service.http.middleware.admission import STREAM

DEPLOY = Path(__file__).resolve().parents[2] / "deploy"
HOST = "dampers.example"
Started = tuple[list[str], ssl.SSLContext, dict[str, str]]
SLOW = {"kind": "iteration", "seconds": 60.0, "fresh": True}


@pytest.fixture(scope="module")
def behind(tmp_path_factory: pytest.TempPathFactory) -> Iterator[tuple[ServedClient, str]]:
    """A service set up as the files say, and a key."""
    with serving(
        tmp_path_factory.mktemp("behind"), PRIVATE, require_keys=True, https=True,
        allowed_hosts=(HOST, "127.0.0.1"), trusted_proxies=("127.0.0.1",), max_upload_bytes=64 * 1024 * 1024,
    ) as client:  # fmt: skip
        yield client, create(client.service.keys, "ann", [Scope.ADMIN], utc_now()).token


def certificate(folder: Path) -> tuple[Path, Path]:
    """A certificate of `HOST` that signs itself, and its key."""
    program = shutil.which("openssl")
    if program is None:
        pytest.skip("openssl is not installed")
    paths = folder / "cert.pem", folder / "key.pem"
    subprocess.run(
        [program, "req", "-x509", "-newkey", "rsa:2048", "-nodes", "-days", "2", "-subj",
         f"/CN={HOST}", "-addext", f"subjectAltName=DNS:{HOST}", "-out", paths[0], "-keyout", paths[1]],
        check=True, capture_output=True,
    )  # fmt: skip
    return paths


def by_nginx(folder: Path, port: int, plain: int, service: int) -> Started:
    program = shutil.which("nginx") or shutil.which("nginx", path="/usr/sbin")
    if program is None:
        pytest.skip("nginx is not installed (Debian's package `nginx-light`)")
    pem, key = certificate(folder)
    text = (DEPLOY / "nginx.conf").read_text(encoding="utf-8")
    text = text.replace("listen 80;", f"listen 127.0.0.1:{plain};")
    text = text.replace("listen 443 ssl", f"listen 127.0.0.1:{port} ssl").replace(":8000;", f":{service};")
    text = re.sub(r"(ssl_certificate) .*;", rf"\1 {pem};", text)
    text = re.sub(r"(ssl_certificate_key) .*;", rf"\1 {key};", text)
    text = text.replace("/var/log/nginx/", f"{folder}/")
    temporary = "".join(f"{name}_temp_path {folder}/{name};" for name in ("client_body", "proxy"))
    others = "".join(f"{name}_temp_path {folder}/{name};" for name in ("fastcgi", "uwsgi", "scgi"))
    user = "user root;" if os.geteuid() == 0 else ""
    (folder / "nginx.conf").write_text(
        f"{user} daemon off; pid {folder}/pid; error_log stderr; events {{}}\n"
        f"http {{ access_log off; {temporary} {others}\n{text}\n}}\n", encoding="utf-8",
    )  # fmt: skip
    context = ssl.create_default_context(cafile=str(pem))
    return [program, "-c", str(folder / "nginx.conf"), "-e", "stderr"], context, {}


def by_caddy(folder: Path, port: int, plain: int, service: int) -> Started:
    program = shutil.which("caddy")
    if program is None:
        pytest.skip("caddy is not installed (Debian's package `caddy`)")
    pem, key = certificate(folder)
    text = (DEPLOY / "Caddyfile").read_text(encoding="utf-8")
    text = text.replace(f"\n{HOST} {{", f"\nhttps://{HOST}:{port} {{\n\tbind 127.0.0.1\n\ttls {pem} {key}")
    text = text.replace("127.0.0.1:8000", f"127.0.0.1:{service}")
    options = f"{{\n\tadmin off\n\thttp_port {plain}\n\thttps_port {port}\n\tauto_https disable_redirects\n"
    assert text.count("\n{\n") == 1, "one block of global options"
    (folder / "Caddyfile").write_text(text.replace("\n{\n", f"\n{options}", 1), encoding="utf-8")
    home = {"XDG_DATA_HOME": str(folder), "XDG_CONFIG_HOME": str(folder), "HOME": str(folder)}
    command = [program, "run", "--config", str(folder / "Caddyfile"), "--adapter", "caddyfile"]
    return command, ssl.create_default_context(cafile=str(pem)), home


@pytest.fixture(scope="module", params=[by_nginx, by_caddy], ids=["nginx", "caddy"])
def proxied(
    request: pytest.FixtureRequest, tmp_path_factory: pytest.TempPathFactory, behind: tuple[ServedClient, str]
) -> Iterator[httpx.Client]:
    """A client of a proxy in front of the service."""
    folder = tmp_path_factory.mktemp("proxy")
    port, plain = free_port(), free_port()
    service = behind[0].base_url.port
    assert service is not None
    command, context, environment = request.param(folder, port, plain, service)
    process = subprocess.Popen(command, env={**os.environ, **environment}, stderr=subprocess.PIPE, text=True)
    base = f"https://127.0.0.1:{port}"
    headers = {"Host": HOST, "Authorization": f"Bearer {behind[1]}"}
    try:
        with httpx.Client(base_url=base, verify=context, headers=headers, timeout=60.0) as client:
            client.event_hooks["request"] = [_named]
            until(lambda: _answers(client, process), seconds=60.0)
            yield client
    finally:
        process.terminate()
        process.communicate()


def _named(request: httpx.Request) -> None:
    request.extensions["sni_hostname"] = HOST


def _answers(client: httpx.Client, process: subprocess.Popen[str]) -> bool:
    if process.poll() is not None:
        assert process.stderr is not None
        pytest.fail(process.stderr.read())
    try:
        return client.get("/health/live").status_code == 200
    except httpx.TransportError:
        return False


def test_requests_go_through(proxied: httpx.Client) -> None:
    answer = proxied.get("/v1/jobs")
    assert answer.status_code == 200
    assert "max-age=" in answer.headers["strict-transport-security"]
    other = proxied.get("/v1/jobs", headers={"Authorization": "Bearer nothing"})
    assert other.status_code == 401


def test_events_come_as_they_happen(proxied: httpx.Client) -> None:
    job = proxied.post("/v1/jobs", json=SLOW).json()["id"]
    with proxied.stream("GET", f"/v1/jobs/{job}/events") as answer:
        assert answer.status_code == 200
        lines = answer.iter_lines()
        begun = time.monotonic()
        assert next(lines)
        assert time.monotonic() - begun < 10.0, "the first event of a job that goes on for a minute"
        assert proxied.delete(f"/v1/jobs/{job}").status_code in (200, 202)
        assert any("dismissed" in line for line in lines)


def test_large_uploads_go_through(proxied: httpx.Client) -> None:
    """A file as large as the service takes, and one that is larger."""
    size = 20_000
    matrix = "%%MatrixMarket matrix coordinate real symmetric\n" + f"{size} {size} {size}\n"
    matrix += "".join(f"{i} {i} {1.0 + i:.400f}\n" for i in range(1, size + 1))
    kind = {"Content-Type": "application/octet-stream"}
    answer = proxied.post("/v1/uploads?name=M.mtx", content=matrix.encode(), headers=kind)
    assert answer.status_code in (200, 201), answer.text[:300]
    too_large = proxied.post("/v1/uploads?name=M.mtx", content=b"x" * (64 * 1024 * 1024 + 1), headers=kind)
    assert too_large.status_code == 413


def test_what_a_stranger_says_of_their_address_is_not_believed(
    proxied: httpx.Client, caplog: pytest.LogCaptureFixture
) -> None:
    caplog.set_level("WARNING", logger="stickslip.audit")
    proxied.get("/v1/jobs", headers={"Authorization": "Bearer no", "X-Forwarded-For": "203.0.113.9"})
    refused = [record for record in caplog.records if record.name == "stickslip.audit"]
    assert refused
    assert all("203.0.113.9" not in str(vars(record)) for record in refused)


@pytest.mark.skipif(sys.platform != "linux", reason="promtool is looked for where Debian has it")
def test_the_alerts_are_rules_of_prometheus() -> None:
    program = shutil.which("promtool")
    if program is None:
        pytest.skip("promtool is not installed (Debian's package `prometheus`)")
    checked = subprocess.run(
        [program, "check", "rules", DEPLOY / "alerts.yaml"], capture_output=True, text=True, check=False
    )
    assert checked.returncode == 0, checked.stderr


@pytest.mark.parametrize("name", ["alerts.yaml", "grafana.json"])
def test_every_metric_that_is_watched_is_there(behind: tuple[ServedClient, str], name: str) -> None:
    client, key = behind
    bearer = {"Authorization": f"Bearer {key}"}
    job = client.post("/v1/jobs", headers=bearer, json={"kind": "iteration"}).json()["id"]
    # The times of an attempt are there once one has ended.
    for path in (f"/v1/jobs/{job}/events", "/metrics"):
        text = client.get(path, headers=bearer).text
    # What has labels has no line of its own until it has been counted once.
    there = set(re.findall(r"(?m)^(?:# TYPE )?(stickslip_\w+)[{ ]", text))
    watched = set(re.findall(r"\bstickslip_\w+", (DEPLOY / name).read_text(encoding="utf-8")))
    assert watched
    assert watched <= there
    states = set(re.findall(r'stickslip_jobs\{state="(\w+)"\}', text))
    named = set(re.findall(r'stickslip_jobs\{state="(\w+)"', (DEPLOY / name).read_text(encoding="utf-8")))
    assert named <= states


def test_every_stream_has_its_place_in_nginx() -> None:
    text = (DEPLOY / "nginx.conf").read_text(encoding="utf-8")
    [place] = re.findall(r"location ~ (\S+) {\s+proxy_pass \S+;\s+proxy_buffering off;", text)
    paths = create_app().openapi()["paths"]
    streams = [path for path, one in paths.items() if "text/event-stream" in str(one.get("get", ""))]
    assert len(streams) == 2
    for path in paths:
        assert bool(re.search(place, path)) == (path in streams) == bool(STREAM.fullmatch(path))


def test_nginx_logs_what_is_plain() -> None:
    text = (DEPLOY / "nginx.conf").read_text(encoding="utf-8")
    [pattern] = re.findall(r'"~(\^\(\?<stickslip_plain>.*)" ', text)
    plain = re.compile(pattern.replace("?<stickslip_plain>", "?P<plain>"))
    assert plain.match("/v1/jobs/01a2-b?limit=3")["plain"] == "/v1/jobs/01a2-b"
    assert plain.match("/v1/shared?token=share_1_2")["plain"] == "/v1/shared"
    for uri in ("/v1/jobs/share_1_2", "/v1/jobs/SHARE%5F1%5F2", "/v1/%73hared/a_b?x", "/" + 300 * "a"):
        assert plain.match(uri) is None
    assert "$request " not in text
    assert text.count("access_log /var/log/nginx/stickslip.log stickslip;") == text.count("server {")
