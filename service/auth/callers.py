"""Who asks: what they own, what they see, what they may do."""

from __future__ import annotations

import enum
from collections.abc import Iterable
from dataclasses import dataclass, field
from typing import Annotated

from pydantic import BaseModel, ConfigDict, Field

from service.db.models import NOBODY


class Scope(enum.StrEnum):
    """What a key may do; `submit` includes `read`, `admin` everything."""

    READ = "read"
    SUBMIT = "submit"
    MONITOR = "monitor"
    ADMIN = "admin"


_INCLUDED = {
    Scope.READ: frozenset({Scope.READ}),
    Scope.SUBMIT: frozenset({Scope.READ, Scope.SUBMIT}),
    Scope.MONITOR: frozenset({Scope.MONITOR}),
    Scope.ADMIN: frozenset(Scope),
}


class KeyLimits(BaseModel):
    """Limits of one key; what is not given here, the settings of the service say (`owner_…`).

    Those that count things at a time count all of the key's owner; 0 is no limit.

    Attributes
    ----------
    requests_per_minute : requests in a minute.
    waiting : jobs that may wait at a time.
    storage_bytes : what uploads and results may take [bytes].
    requests, streams, previews, uploads : requests answered, event streams, waiting previews and uploads at a
        time.
    priority : the highest priority of a job.
    seconds : longest time one attempt at a job may take [s].
    work : largest job: points × harmonics × DOFs.
    """

    model_config = ConfigDict(extra="forbid", allow_inf_nan=False, frozen=True)

    requests_per_minute: int | None = Field(default=None, ge=1, le=1_000_000)
    waiting: int | None = Field(default=None, ge=0, le=1_000_000)
    storage_bytes: int | None = Field(default=None, ge=0, le=10**15)
    requests: int | None = Field(default=None, ge=0, le=100_000)
    streams: int | None = Field(default=None, ge=0, le=100_000)
    previews: int | None = Field(default=None, ge=0, le=1000)
    uploads: int | None = Field(default=None, ge=0, le=1000)
    priority: int | None = Field(default=None, ge=-100, le=100)
    seconds: float | None = Field(default=None, ge=0.1, le=1e7)
    work: int | None = Field(default=None, ge=1, le=10**15)


NO_LIMITS = KeyLimits()


@dataclass(frozen=True, slots=True, kw_only=True)
class Caller:
    """Who asks."""

    owner: Annotated[str, "Whom what they make belongs to."] = NOBODY
    scopes: Annotated[frozenset[Scope], "What they may do, with what is included."] = frozenset(
        {Scope.READ, Scope.SUBMIT, Scope.MONITOR}
    )
    key_id: Annotated[str | None, "Of their key; None without one."] = None
    limits: Annotated[KeyLimits, "Of their key."] = field(default=NO_LIMITS)

    @property
    def sees(self) -> str | None:
        """The owner whose things they see; None for everybody's."""
        return None if Scope.ADMIN in self.scopes else self.owner

    def may(self, scope: Scope) -> bool:
        """Whether they may do what needs `scope`."""
        return scope in self.scopes


KEYLESS = Caller()
"""Somebody without a key where none is needed, and a program that embeds the service."""


LINK_READERS = Caller(owner="links to runs", scopes=frozenset())
"""Whoever reads a run by its link: all of them together, under a name that no owner can have."""


def included(scopes: Iterable[Scope]) -> frozenset[Scope]:
    """Scopes with those that they include."""
    return frozenset().union(*(_INCLUDED[scope] for scope in scopes))
