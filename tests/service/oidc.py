"""OpenID Connect providers for tests: a whole one in a process of its own, one that signs what it is told."""

from __future__ import annotations

import base64
import hmac
import json
import subprocess
import sys
import threading
import time
from collections.abc import Iterator
from contextlib import contextmanager
from http.server import BaseHTTPRequestHandler, ThreadingHTTPServer
from typing import Any
from urllib.parse import parse_qs, urlsplit

from launch import answers, free_port

PEOPLE = (
    {"sub": "ann", "email": "ann@example.org", "email_verified": True},
    {"sub": "bob", "email": "bob@example.com", "email_verified": False},
    {"sub": "eve", "email": "eve@elsewhere.net", "email_verified": True},
)


@contextmanager
def provider() -> Iterator[str]:
    """The address of a provider that knows `PEOPLE`."""
    port = free_port()
    claims = [word for person in PEOPLE for word in ("--user-claims", json.dumps(person))]
    command = [sys.executable, "-W", "ignore", "-m", "oidc_provider_mock", "--port", str(port), *claims]
    process = subprocess.Popen(command, stderr=subprocess.DEVNULL, stdout=subprocess.DEVNULL)
    try:
        end = time.monotonic() + 60.0
        while not answers(port, "/.well-known/openid-configuration"):
            assert time.monotonic() < end
            assert process.poll() is None
            time.sleep(0.05)
        yield f"http://127.0.0.1:{port}"
    finally:
        process.terminate()
        process.wait()


def _base64(data: bytes) -> str:
    return base64.urlsafe_b64encode(data).rstrip(b"=").decode()


class Forger:
    """A provider that answers every code with the token that `claims` and `signed_by` make.

    Attributes
    ----------
    claims : what the next token says beside what is right; None for a claim takes it away.
    signed_by : whether its own key signs the token, a stranger's, or nobody's.
    """

    def __init__(self) -> None:
        from joserfc.jwk import RSAKey

        self.claims: dict[str, Any] = {}
        self.signed_by = "own"
        self._own, self._strange = (RSAKey.generate_key(2048, {"kid": "one"}) for _ in range(2))
        self._server = ThreadingHTTPServer(("127.0.0.1", 0), self._handler())
        self.url = f"http://127.0.0.1:{self._server.server_port}"
        self.nonce = ""

    def _handler(self) -> type[BaseHTTPRequestHandler]:
        forger = self

        class Handler(BaseHTTPRequestHandler):
            def do_GET(self) -> None:
                url = forger.url
                found: dict[str, Any] = {"keys": [forger._own.as_dict(private=False)]}
                if "openid-configuration" in self.path:
                    found = {
                        "issuer": url, "authorization_endpoint": f"{url}/go",
                        "token_endpoint": f"{url}/token", "jwks_uri": f"{url}/keys",
                    }  # fmt: skip
                self._send(found)

            def do_POST(self) -> None:
                self.rfile.read(int(self.headers["Content-Length"]))
                self._send({"access_token": "a", "token_type": "Bearer", "id_token": forger._token()})

            def _send(self, found: dict[str, Any]) -> None:
                data = json.dumps(found).encode()
                self.send_response(200)
                self.send_header("Content-Type", "application/json")
                self.send_header("Content-Length", str(len(data)))
                self.end_headers()
                self.wfile.write(data)

            def log_message(self, *words: object) -> None:
                """Nothing is logged."""

        return Handler

    def _token(self) -> str:
        from joserfc import jwt

        now = int(time.time())
        right = {
            "iss": self.url, "aud": "stickslip", "sub": "ann", "iat": now, "exp": now + 600,
            "nonce": self.nonce, "email": "ann@example.org", "email_verified": True,
        }  # fmt: skip
        claims = {name: value for name, value in {**right, **self.claims}.items() if value is not None}
        if self.signed_by == "secret":
            # The public key as the secret of a symmetric signature, an attack as old as the format.
            parts = [_base64(json.dumps(part).encode()) for part in ({"alg": "HS256", "kid": "one"}, claims)]
            digest = hmac.digest(self._own.as_pem(private=False), ".".join(parts).encode(), "sha256")
            return ".".join([*parts, _base64(digest)])
        key = self._own if self.signed_by == "own" else self._strange
        return jwt.encode({"alg": "RS256", "kid": "one"}, claims, key)

    def sends_back(self, url: str) -> dict[str, str]:
        """The query with which a person comes back whom the service sent to `url`."""
        asked = parse_qs(urlsplit(url).query)
        self.nonce = asked["nonce"][0]
        return {"code": "c", "state": asked["state"][0]}

    @contextmanager
    def serving(self) -> Iterator[Forger]:
        """Answer inside the block."""
        thread = threading.Thread(target=self._server.serve_forever)
        thread.start()
        try:
            yield self
        finally:
            self._server.shutdown()
            thread.join()
            self._server.server_close()
