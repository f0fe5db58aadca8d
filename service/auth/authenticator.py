"""Keys made for owners, and who is behind a request: its key looked up, compared, kept in mind a second."""

from __future__ import annotations

import ipaddress
import logging
import math
import re
import threading
import time
from collections import OrderedDict
from collections.abc import Callable, Sequence
from datetime import datetime, timedelta
from typing import Any

from sqlalchemy.exc import SQLAlchemyError

from service.auth.allowances import Buckets
from service.auth.callers import KEYLESS, NO_LIMITS, Caller, KeyLimits, Scope, included
from service.db.clock import Clock
from service.db.models import NOBODY, ApiKey
from service.db.repositories.owned import KEYS, KeyRepository, Made, digest_of, matches
from service.db.repositories.run_repository import NO_LINK, RunRow, Shares
from service.errors import (
    ForbiddenError,
    InvalidRequestError,
    NotFoundError,
    TooManyRequestsError,
    UnauthorizedError,
)
from service.settings.settings import Settings
from solver.errors import Issue, Shown

_OWNER = re.compile(r"[A-Za-z0-9][A-Za-z0-9._@+-]{0,99}")

id_of = KEYS.id_of


def caller_of_row(row: ApiKey) -> Caller:
    """Who asks with this key."""
    return Caller(
        owner=row.owner,
        scopes=included(Scope(name) for name in row.scopes),
        key_id=row.id,
        limits=KeyLimits.model_validate(row.limits),
    )


def create(
    keys: KeyRepository,
    owner: str,
    scopes: Sequence[Scope],
    now: datetime,
    expires: datetime | None = None,
    limits: KeyLimits = NO_LIMITS,
) -> Made[ApiKey]:
    """Make a key.

    InvalidRequestError for an owner that is no name, no scope at all, or an expiry in the past.
    """
    issues = []
    if _OWNER.fullmatch(owner) is None:
        words = "must be 1 to 100 letters, digits or . _ @ + -, the first a letter or digit"
        issues.append(Issue(("owner",), words, owner[:120]))
    if not scopes:
        known = ", ".join(scope.value for scope in Scope)
        issues.append(Issue(("scopes",), f"`scope` must be given: {known}", named=False))
    if expires is not None and expires <= now:
        issues.append(Issue(("expires",), "must be in the future", Shown(expires.isoformat())))
    if issues:
        raise InvalidRequestError(issues)
    return keys.add(
        owner=owner, scopes=sorted({scope.value for scope in scopes}), created=now, expires=expires,
        limits=limits.model_dump(exclude_none=True),
    )  # fmt: skip


def described(row: ApiKey) -> dict[str, Any]:
    """A key for people and programs: everything but its digest."""
    shown = {name: getattr(row, name) for name in ("id", "owner", "scopes", "limits")}
    times = {name: getattr(row, name) for name in ("created", "expires", "revoked", "last_used")}
    return shown | {name: None if time is None else time.isoformat() for name, time in times.items()}


log = logging.getLogger("stickslip.service")

REMEMBERED_SECONDS = 1.0
"""How long a revoked key may still work in a service process."""
_MOST_REMEMBERED = 4096
_USED_EVERY = timedelta(minutes=1)
_HALF_OF_IPV6 = 64


class Authenticator:
    """Turns keys into callers.

    Parameters
    ----------
    keys, shares : the keys, and the links to runs.
    settings : whether keys are needed, and how often they may be used or guessed.
    now : the clock that expiry is judged by.
    steady : seconds that never jump.
    """

    def __init__(
        self, keys: KeyRepository, shares: Shares, settings: Settings, now: Clock,
        steady: Callable[[], float] = time.monotonic,
    ) -> None:  # fmt: skip
        self._keys, self._shares = keys, shares
        self._settings = settings
        self._now = now
        self._steady = steady
        self._remembered: OrderedDict[str, tuple[ApiKey | None, float]] = OrderedDict()
        self._lock = threading.Lock()
        self._requests = Buckets(steady=steady)
        self._failures = Buckets(steady=steady)

    def known(self, token: str | None) -> bool:
        """Whether `admit` can answer at once, without the database."""
        key_id = None if token is None else id_of(token)
        return key_id is None or self._recall(key_id) is not None

    def admit(self, token: str | None, address: str) -> Caller:
        """Who asks.

        UnauthorizedError if the key is none, or does not work; TooManyRequestsError if too many keys that do
        not work came from this address.
        """
        if token is None:
            return _paying(f"from {_neighbourhood(address)}") if self._settings.keys_required else KEYLESS
        key_id = id_of(token)
        row = None if key_id is None else self._look_up(key_id)
        if not matches(token, row) or row is None:
            raise self._failed("the key is not known: send it as `Authorization: Bearer …`", address)
        if row.revoked is not None:
            raise self._failed("the key was revoked", address)
        if row.expires is not None and row.expires <= self._now():
            raise self._failed(f"the key expired at {row.expires.isoformat()}", address)
        return caller_of_row(row)

    def require(self, caller: Caller, scope: Scope) -> None:
        """Refuse who may not do what needs `scope`.

        UnauthorizedError if there was no key; ForbiddenError if the key has not the scope.
        """
        if caller.may(scope):
            return
        if caller.key_id is None:
            raise UnauthorizedError("this needs a key: send it as `Authorization: Bearer …`")
        has = ", ".join(sorted(caller.scopes)) or "none"
        raise ForbiddenError(f"this needs a key with the scope {scope.value}, this one has {has}")

    def reader(self, token: str, address: str) -> tuple[Caller, RunRow]:
        """Who reads by a link, and the run that it is to; each link pays for itself.

        NotFoundError if the link is none, or has ended; TooManyRequestsError if too many of those came from
        this address.
        """
        try:
            run = self._shares.run_of(token)
            self._require_owner(run.owner)
            return _paying(f"link {digest_of(token)}"), run
        except NotFoundError as error:
            refused = self._failed(error.detail, address)
            raise error if isinstance(refused, UnauthorizedError) else refused from error

    def _require_owner(self, owner: str) -> None:
        """Refuse a link (NotFoundError) of an owner whose keys have all ended; who had none needs none.

        The keys of those who log in end every few hours: theirs must have been revoked.
        """
        if owner == NOBODY or self._settings.links_outlive_keys:
            return
        if not self._keys.usable(None if self._settings.oidc_issuer else self._now(), owner):
            raise NotFoundError(NO_LINK)

    def count(self, caller: Caller) -> None:
        """Count a request: for its key, for its link, and without either for the address it came from.

        Where no keys are needed everybody is one owner, and nobody would pay for another.
        TooManyRequestsError if there were as many as may be made.
        """
        if caller is KEYLESS:
            return
        most = caller.limits.requests_per_minute or self._settings.requests_per_minute
        wait = self._requests.take(caller.key_id or caller.owner, most)
        if wait > 0.0:
            who = "the key" if caller.key_id else "an address without a key, or a link,"
            raise TooManyRequestsError(f"{who} may make {most} requests a minute", math.ceil(wait))

    def count_login(self, address: str) -> None:
        """Count a log-in, of which an address has as many a minute as keys that do not work.

        TooManyRequestsError if there were as many as may be made.
        """
        most = self._settings.failed_keys_per_minute
        wait = self._failures.take(f"log-in from {_neighbourhood(address)}", most)
        if wait > 0.0:
            raise TooManyRequestsError(f"{most} log-ins a minute may be made", math.ceil(wait))

    def _failed(self, reason: str, address: str) -> UnauthorizedError | TooManyRequestsError:
        """The refusal of a key; a working key from the same address is admitted all the same.

        Otherwise a stranger behind the same address could shut everybody else there out.
        """
        wait = self._failures.take(_neighbourhood(address), self._settings.failed_keys_per_minute)
        if wait == 0.0:
            return UnauthorizedError(reason, presented=True)
        return TooManyRequestsError(
            "too many keys or links that do not work came from this address", math.ceil(wait)
        )

    def _recall(self, key_id: str) -> tuple[ApiKey | None, float] | None:
        with self._lock:
            found = self._remembered.get(key_id)
        fresh = found is not None and self._steady() - found[1] < REMEMBERED_SECONDS
        return found if fresh else None

    def _look_up(self, key_id: str) -> ApiKey | None:
        """The row of a key, at most a second old; that there is none is remembered as well."""
        found = self._recall(key_id)
        if found is not None:
            return found[0]
        begun = self._steady()
        row = self._keys.get(key_id)
        with self._lock:
            self._remembered[key_id] = (row, begun)
            self._remembered.move_to_end(key_id)
            while len(self._remembered) > _MOST_REMEMBERED:
                self._remembered.popitem(last=False)
        return row

    def note_use(self, token: str) -> None:
        """Write when a key was used last, once a minute at most."""
        key_id = id_of(token)
        found = None if key_id is None else self._recall(key_id)
        row = None if found is None else found[0]
        now = self._now()
        if row is None or (row.last_used is not None and now - row.last_used < _USED_EVERY):
            return
        try:
            self._keys.touch(row.id, now)
        except SQLAlchemyError as error:
            log.warning("key %s: its use could not be noted: %s", row.id, type(error).__name__)


def _paying(owner: str) -> Caller:
    """Who may do nothing and is counted, by a name that no owner can have."""
    return Caller(owner=owner, scopes=frozenset())


def _neighbourhood(address: str) -> str:
    """An IPv4 address; of an IPv6 address the half that one customer has whole."""
    try:
        parsed = ipaddress.ip_address(address)
    except ValueError:
        return address
    if isinstance(parsed, ipaddress.IPv4Address):
        return str(parsed)
    if parsed.ipv4_mapped is not None:
        return str(parsed.ipv4_mapped)
    return str(ipaddress.ip_network((parsed, _HALF_OF_IPV6), strict=False).network_address)
