"""Keys: made for an owner with scopes and limits, and who asks with one."""

from __future__ import annotations

import re
from collections.abc import Sequence
from datetime import datetime
from typing import Any

from service.auth.callers import NO_LIMITS, Caller, KeyLimits, Scope, included
from service.db.models import ApiKey
from service.db.repositories.keys import KEYS, KeyRepository
from service.db.tokens import Made
from service.errors import InvalidRequestError
from solver.errors import Issue

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
    return keys.add(
        owner=owner, scopes=sorted({scope.value for scope in scopes}), created=now, expires=expires,
        limits=limits.model_dump(exclude_none=True),
    )  # fmt: skip


def described(row: ApiKey) -> dict[str, Any]:
    """A key for people and programs: everything but its digest."""
    shown = {name: getattr(row, name) for name in ("id", "owner", "scopes", "limits")}
    times = {name: getattr(row, name) for name in ("created", "expires", "revoked", "last_used")}
    return shown | {name: None if time is None else time.isoformat() for name, time in times.items()}
