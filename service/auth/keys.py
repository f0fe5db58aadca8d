"""Keys: made, shown once, looked up again by what is kept of them.

A key is ``stickslip_<id>_<secret>``. The secret has 256 random bits, so a plain SHA-256 is enough to keep:
slow hashes (bcrypt, Argon2) make guessing dear where people choose words, and nobody guesses one of 2^256
numbers however fast the hash is. They would only cost every request a tenth of a second.
"""

from __future__ import annotations

import hashlib
import hmac
import re
import secrets
from collections.abc import Sequence
from dataclasses import asdict, dataclass
from datetime import datetime

from service.auth.callers import NO_LIMITS, Caller, KeyLimits, Scope, included
from service.db.repositories.keys import KeyRepository, KeyRow
from service.errors import InvalidRequestError, NotFoundError
from solver.errors import Issue

PREFIX = "stickslip"
_TOKEN = re.compile(rf"{PREFIX}_([0-9a-f]{{12}})_([0-9a-f]{{64}})")
_OWNER = re.compile(r"[A-Za-z0-9][A-Za-z0-9._@+-]{0,99}")
# Compared with when there is no such key: a refusal then costs what it costs for one there is.
_NO_DIGEST = hashlib.sha256(secrets.token_bytes(32)).hexdigest()


@dataclass(frozen=True, slots=True)
class NewKey:
    """A key that was just made; `token` is nowhere else."""

    row: KeyRow
    token: str

    def __repr__(self) -> str:
        """Without the token, which must not get into a log."""
        return f"NewKey(row.id={self.row.id!r})"


def digest_of(token: str) -> str:
    """What is kept of a key."""
    return hashlib.sha256(token.encode()).hexdigest()


def id_of(token: str) -> str | None:
    """The id in a key; None if this is no key."""
    found = _TOKEN.fullmatch(token)
    return None if found is None else found[1]


def matches(token: str, row: KeyRow | None) -> bool:
    """Whether a key is the one of a row, in a time that tells nothing; also without a row."""
    kept = _NO_DIGEST if row is None else row.digest
    same = hmac.compare_digest(digest_of(token), kept)
    return same and row is not None


def caller_of_row(row: KeyRow) -> Caller:
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
) -> NewKey:
    """Make a key.

    Raises
    ------
    InvalidRequestError
        For an owner that is no name, no scope at all, or an expiry in the past.
    """
    issues = []
    if _OWNER.fullmatch(owner) is None:
        words = "must be 1 to 100 letters, digits or . _ @ + -, the first a letter or digit"
        issues.append(Issue(pointer="/owner", message=f"`owner` {words}, got {owner[:120]!r}"))
    if not scopes:
        known = ", ".join(scope.value for scope in Scope)
        issues.append(Issue(pointer="/scopes", message=f"`scope` must be given: {known}"))
    if expires is not None and expires <= now:
        issues.append(
            Issue(pointer="/expires", message=f"`expires` must be in the future, got {expires.isoformat()}")
        )
    if issues:
        raise InvalidRequestError(issues)
    key_id = secrets.token_hex(6)
    token = _token(key_id)
    row = KeyRow(
        id=key_id,
        owner=owner,
        scopes=sorted({scope.value for scope in scopes}),
        digest=digest_of(token),
        limits=limits.model_dump(exclude_none=True),
        created=now,
        expires=expires,
    )
    keys.add(row)
    return NewKey(row, token)


def rotate(keys: KeyRepository, key_id: str) -> NewKey:
    """Give a key another secret; the old one ends.

    Raises
    ------
    NotFoundError
        If there is none of this id, or it was revoked.
    """
    token = _token(key_id)
    row = keys.get(key_id) if keys.rotate(key_id, digest_of(token)) else None
    if row is None:
        raise NotFoundError(f"there is no key {key_id!r} that works: `stickslip keys list` shows all")
    return NewKey(row, token)


def revoke(keys: KeyRepository, key_id: str, now: datetime) -> None:
    """End a key.

    Raises
    ------
    NotFoundError
        If there is none of this id, or it was revoked before.
    """
    if not keys.revoke(key_id, now):
        raise NotFoundError(f"there is no key {key_id!r} that works: `stickslip keys list` shows all")


def described(row: KeyRow) -> dict[str, object]:
    """A key for people and programs: everything but its digest."""
    shown = asdict(row)
    del shown["digest"]
    times = ("created", "expires", "revoked", "last_used")
    return shown | {name: None if shown[name] is None else shown[name].isoformat() for name in times}


def _token(key_id: str) -> str:
    return f"{PREFIX}_{key_id}_{secrets.token_hex(32)}"
