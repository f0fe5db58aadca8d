"""Secrets that are shown once: what is kept of them, and how they are compared.

A token is ``<prefix>_<id>_<secret>``. The secret has 256 random bits, so a plain SHA-256 is enough to keep:
slow hashes (bcrypt, Argon2) make guessing dear where people choose words, and nobody guesses one of 2^256
numbers however fast the hash is. They would only cost every request a tenth of a second.
"""

from __future__ import annotations

import hashlib
import hmac
import re
import secrets
from dataclasses import dataclass
from typing import Any, Generic, Protocol, TypeVar


class Kept(Protocol):
    """A row with what is kept of a token."""

    id: Any
    digest: Any


KeptT = TypeVar("KeptT", bound=Kept)


@dataclass(frozen=True, slots=True)
class Made(Generic[KeptT]):
    """What was just made to be opened by a token; `token` is nowhere else."""

    row: KeptT
    token: str

    def __repr__(self) -> str:
        """Without the token, which must not get into a log."""
        return f"Made(row.id={self.row.id!r})"


def digest_of(token: str) -> str:
    """What is kept of a token."""
    return hashlib.sha256(token.encode()).hexdigest()


# Compared with when there is no such row: a refusal then costs what it costs for one there is.
_NO_DIGEST = digest_of(secrets.token_hex(32))


class Tokens:
    """Tokens of one prefix, whose ids have so many bytes."""

    def __init__(self, prefix: str, id_bytes: int) -> None:
        self._prefix, self._id_bytes = prefix, id_bytes
        self._form = re.compile(rf"{prefix}_([0-9a-f]{{{2 * id_bytes}}})_([0-9a-f]{{64}})")

    def new(self, row_id: str | None = None) -> tuple[str, str]:
        """An id, that of a row or a new one, and a token of it."""
        found = secrets.token_hex(self._id_bytes) if row_id is None else row_id
        return found, f"{self._prefix}_{found}_{secrets.token_hex(32)}"

    def id_of(self, token: str) -> str | None:
        """The id in a token; None if this is none."""
        found = self._form.fullmatch(token)
        return None if found is None else found[1]


def matches(token: str, row: Kept | None) -> bool:
    """Whether a token is the one of a row, in a time that tells nothing; also without a row."""
    same = hmac.compare_digest(digest_of(token), _NO_DIGEST if row is None else row.digest)
    return same and row is not None
