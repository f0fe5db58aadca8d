"""Log-in at an OpenID Connect provider: it says who a person is, and a key of this service follows.

The flow is that of the authorization code with PKCE (OpenID Connect Core 1.0, section 3.1; RFC 7636). What
has to be known again on the way back (state, nonce, code verifier) is in a signed cookie, so that any process
of the service may answer it. Authlib and joserfc, which come with the extra `oidc`, do the protocol.
"""

from __future__ import annotations

import hashlib
import logging
import secrets
import time
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from datetime import timedelta
from enum import Enum
from typing import Any, cast

import httpx2
from authlib.common.errors import AuthlibBaseError
from authlib.integrations.httpx_client import AsyncOAuth2Client
from joserfc import jwt
from joserfc.errors import JoseError
from joserfc.jwk import KeySet, OctKey
from starlette.concurrency import run_in_threadpool

from service.auth.authenticator import create
from service.auth.callers import Scope
from service.db.clock import Clock
from service.db.repositories.owned import KeyRepository
from service.errors import InvalidRequestError, ServiceError
from service.settings.settings import Settings

log = logging.getLogger("stickslip.audit")

BEGIN_SECONDS = 600
"""Time a person has to log in at the provider."""
_KNOWN_SECONDS = 3600.0
_TIMEOUT = 10.0
_ADDRESSES = frozenset({"authorization_endpoint", "token_endpoint", "jwks_uri"})
_LEEWAY = 60  # s by which clocks may differ


class Refusal(Enum):
    """Why a log-in failed; the page has words for each."""

    EXPIRED = "expired"
    REFUSED = "refused"
    NOT_ALLOWED = "not-allowed"
    UNREACHABLE = "unreachable"


class LoginError(ServiceError):
    """A log-in that did not end in a key."""

    def __init__(self, refusal: Refusal, detail: str) -> None:
        self.refusal = refusal
        super().__init__(detail)


@dataclass(frozen=True, slots=True)
class Begun:
    """Where a person is sent to log in, and what their browser keeps for the way back."""

    url: str
    cookie: str


class Login:
    """The log-in of one service.

    Parameters
    ----------
    settings : provider, client, and who may come in.
    keys : where keys are made.
    now : the clock of their expiry.
    steady : seconds that never jump.
    """

    def __init__(
        self, settings: Settings, keys: KeyRepository, now: Clock,
        steady: Callable[[], float] = time.monotonic,
    ) -> None:  # fmt: skip
        self._settings, self._keys, self._now, self._steady = settings, keys, now, steady
        self._issuer, self._name = str(settings.oidc_issuer), str(settings.oidc_client_id)
        secret = settings.oidc_client_secret
        self._secret = "" if secret is None else secret.get_secret_value()
        # Cookies are signed with what every process of the service derives alike.
        signed_with = hashlib.sha256(b"stickslip log-in " + self._secret.encode()).digest()
        self._signing = OctKey.import_key(signed_with)
        self._provider: tuple[dict[str, Any], float] | None = None

    async def begin(self) -> Begun:
        """Send somebody to the provider.

        Raises
        ------
        LoginError
            The provider does not answer.
        """
        async with self._client() as client:
            provider = await self._metadata(client)
            kept = {name: secrets.token_urlsafe(48) for name in ("state", "nonce", "code_verifier")}
            url, _ = client.create_authorization_url(provider["authorization_endpoint"], **kept)
        claims = {**kept, "exp": int(self._now().timestamp()) + BEGIN_SECONDS}
        return Begun(url, jwt.encode({"alg": "HS256"}, claims, self._signing))

    async def finish(self, cookie: str, answer: Mapping[str, str]) -> str:
        """Return a new key for the person whom the provider sends back.

        Parameters
        ----------
        cookie : that of `begin`.
        answer : the query of the way back.

        Raises
        ------
        LoginError
            The person, the provider or the settings refuse; it took too long; or the provider is away.
        """
        kept = self._kept(cookie)
        if "code" not in answer:
            raise LoginError(Refusal.REFUSED, f"the provider answered {answer.get('error', 'nothing')!r:.80}")
        if not secrets.compare_digest(answer.get("state", "").encode(), kept["state"].encode()):
            raise LoginError(Refusal.EXPIRED, "the answer is to another log-in")
        async with self._client() as client:
            provider = await self._metadata(client)
            claims = await self._claims(client, provider, answer["code"], kept)
        return await run_in_threadpool(self._key_for, self._owner(claims))

    def _client(self) -> Any:
        return AsyncOAuth2Client(
            self._name, self._secret, scope="openid email profile",
            redirect_uri=f"{self._settings.public_url}/v1/login/callback",
            code_challenge_method="S256", timeout=_TIMEOUT, follow_redirects=False,
        )  # fmt: skip

    async def _metadata(self, client: Any) -> dict[str, Any]:
        """What the provider says of itself, at most an hour old."""
        known = self._provider
        if known is None or self._steady() - known[1] > _KNOWN_SECONDS:
            found = await _fetched(client, f"{self._issuer.rstrip('/')}/.well-known/openid-configuration")
            if found.get("issuer") != self._issuer or not found.keys() >= _ADDRESSES:
                told = f"what {self._issuer} says of itself lacks that issuer or one of {sorted(_ADDRESSES)}"
                raise LoginError(Refusal.UNREACHABLE, told)
            self._provider = known = (found, self._steady())
        return known[0]

    async def _claims(
        self, client: Any, provider: Mapping[str, Any], code: str, kept: Mapping[str, str]
    ) -> dict[str, Any]:
        """What the provider's signed token says of a person (OpenID Connect Core 1.0, section 3.1.3.7)."""
        try:
            answer = await client.fetch_token(
                provider["token_endpoint"], code=code, code_verifier=kept["code_verifier"]
            )
            keys = KeySet.import_key_set(cast("Any", await _fetched(client, provider["jwks_uri"])))
            token = jwt.decode(answer["id_token"], keys, algorithms=["RS256", "ES256", "PS256", "EdDSA"])
            jwt.JWTClaimsRegistry(
                now=int(self._now().timestamp()), leeway=_LEEWAY,
                iss={"essential": True, "value": self._issuer},
                aud={"essential": True, "value": self._name},
                exp={"essential": True}, sub={"essential": True},
                nonce={"essential": True, "value": kept["nonce"]},
            ).validate(token.claims)  # fmt: skip
        except (AuthlibBaseError, JoseError, KeyError, ValueError) as error:
            raise LoginError(Refusal.REFUSED, f"the provider's answer is refused: {error!r:.200}") from error
        except httpx2.HTTPError as error:
            raise _away(error) from error
        return token.claims

    def _owner(self, claims: Mapping[str, Any]) -> str:
        """Who a person is here: the claim the settings name, if they may come in."""
        settings, name = self._settings, self._settings.oidc_owner_claim
        owner = claims.get(name)
        if not isinstance(owner, str) or (name == "email" and claims.get("email_verified") is not True):
            lacks = f"the provider gives no claim {name}" if owner is None else f"{name} is not verified"
            raise LoginError(Refusal.NOT_ALLOWED, lacks)
        allowed = settings.oidc_allowed
        if allowed and not any(
            owner == one or (one.startswith("@") and owner.endswith(one)) for one in allowed
        ):
            raise LoginError(Refusal.NOT_ALLOWED, f"{owner:.100} is not in `oidc_allowed`")
        return owner

    def _key_for(self, owner: str) -> str:
        settings, now = self._settings, self._now()
        scope = Scope.ADMIN if owner in settings.oidc_admins else Scope.SUBMIT
        try:
            made = create(self._keys, owner, [scope], now, now + timedelta(hours=settings.oidc_hours))
        except InvalidRequestError as error:
            raise LoginError(Refusal.NOT_ALLOWED, error.detail) from error
        log.info("%s logged in: key %s, scope %s", owner, made.row.id, scope.value)
        return made.token

    def _kept(self, cookie: str) -> dict[str, str]:
        """What `begin` put into a cookie, in time and as it was."""
        try:
            token = jwt.decode(cookie, self._signing, algorithms=["HS256"])
            now = int(self._now().timestamp())
            jwt.JWTClaimsRegistry(now=now, exp={"essential": True}).validate(token.claims)
        except (JoseError, ValueError) as error:
            raise LoginError(Refusal.EXPIRED, f"the log-in took too long: {error!r:.100}") from error
        return token.claims


async def _fetched(client: Any, url: str) -> dict[str, Any]:
    """A JSON object of the provider."""
    try:
        answer = await client.request("GET", url, withhold_token=True)
        answer.raise_for_status()
        found = answer.json()
    except (httpx2.HTTPError, ValueError) as error:
        raise _away(error) from error
    if not isinstance(found, dict):
        raise LoginError(Refusal.UNREACHABLE, f"{url} is no JSON object")
    return found


def _away(error: Exception) -> LoginError:
    return LoginError(Refusal.UNREACHABLE, f"the provider does not answer: {error!r:.200}")
