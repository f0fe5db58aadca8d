"""The exceptions of the service: one root, and one class for each thing a caller can mend.

What each of them becomes over HTTP is decided in one place, `service.schemas.problems`.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from typing import Self

from solver.errors import UNSAID, Issue, Place, Shown


class ServiceError(Exception):
    """Root of every error the service raises on purpose."""

    def __init__(self, detail: str) -> None:
        self.detail = detail
        super().__init__(detail)


class ConfigurationError(ServiceError):
    """A setting the service cannot start with."""


class DatabaseError(ServiceError):
    """A database the service must not or cannot use: wrong revision, in use, damaged."""


class DamagedDatabaseError(DatabaseError):
    """A database that cannot be read."""


class DatabaseInUseError(DatabaseError):
    """Another service holds this SQLite file."""


class WrongRevisionError(DatabaseError):
    """The database's tables are not the ones this version works with."""


class InvalidRequestError(ServiceError):
    """A request that cannot be carried out; `issues` lists everything that is wrong with it.

    Attributes
    ----------
    issues : tuple of Issue
        Each with the RFC 6901 pointer of the bad field.
    source : str
        What the pointers point into: ``body``, ``query`` or ``header``.
    """

    def __init__(self, issues: Sequence[Issue], source: str = "body") -> None:
        self.issues = tuple(issues)
        self.source = source
        super().__init__("; ".join(issue.said() for issue in self.issues))

    @classmethod
    def of(
        cls, subject: Place, wanted: str, got: object = UNSAID, *, named: bool = True, source: str = "body"
    ) -> Self:
        """Return the error of one `Issue`."""
        return cls([Issue(subject, wanted, got, named)], source)

    @classmethod
    def from_json(cls, rows: Iterable[tuple[list[str | int], str, str, bool]]) -> Self:
        """Return the error that another process told by `issues_to_json`."""
        return cls([Issue(tuple(place), wanted, Shown(got), named) for place, wanted, got, named in rows])


def issues_to_json(issues: Iterable[Issue]) -> list[list[object]]:
    """Return issues as another process reads them, see `InvalidRequestError.from_json`."""
    return [[list(one.subject), one.words({}), repr(one.got), one.named] for one in issues]


class UnknownKindError(ServiceError):
    """A stored job of a kind that this service was started without."""

    def __init__(self, kind: str) -> None:
        super().__init__(
            f"this service has no kind {kind!r}: name its module in `kinds` (STICKSLIP_KINDS) of every "
            "service and worker of the database, and submit the job again"
        )


class MalformedBodyError(ServiceError):
    """A request body that is not JSON."""


class UnsupportedMediaError(ServiceError):
    """A request body of a media type or an encoding that is not read here."""


class NotAcceptableError(ServiceError):
    """The client takes none of the representations there are."""


class BodyTooLargeError(ServiceError):
    """A request body larger than the service accepts."""


class SlowBodyError(ServiceError):
    """A request body that does not arrive in time."""


class UnreadableUploadError(ServiceError):
    """An uploaded file that holds no usable matrix or modes."""


class HostRefusedError(ServiceError):
    """A request for a host name this service does not answer to."""


class OriginRefusedError(ServiceError):
    """A change that a web page of another origin asks for."""


class UnauthorizedError(ServiceError):
    """A request without a key that works.

    Attributes
    ----------
    presented : bool
        Whether there was a key.
    """

    def __init__(self, detail: str, *, presented: bool = False) -> None:
        self.presented = presented
        super().__init__(detail)


class ForbiddenError(ServiceError):
    """A request that its key does not allow."""


class NotFoundError(ServiceError):
    """Nothing has this id or name, as far as the caller may know.

    Attributes
    ----------
    withheld : bool
        Whether it is there and belongs to another; for the log alone.
    """

    def __init__(self, detail: str, *, withheld: bool = False) -> None:
        self.withheld = withheld
        super().__init__(detail)


class ConflictError(ServiceError):
    """The request does not fit the present state of what it is about."""


class IdempotencyError(ServiceError):
    """An `Idempotency-Key` used again for a different request."""


class ChangedMeanwhileError(ServiceError):
    """What is to be changed is not what the client had seen (`If-Match`)."""


class RetryLaterError(ServiceError):
    """Something that can be asked for again later.

    Attributes
    ----------
    retry_after : int
        Time after which asking again makes sense [s].
    """

    def __init__(self, detail: str, retry_after: int) -> None:
        self.retry_after = retry_after
        super().__init__(detail)


class QueueFullError(RetryLaterError):
    """The queue takes no more jobs at present."""


class OverloadedError(RetryLaterError):
    """The service has as much to do as it takes on at a time."""


class StorageFullError(ServiceError):
    """An owner stores as much as they may."""


class DatabaseAwayError(RetryLaterError):
    """The database did not take a write in time; nothing was written."""


class TooManyRequestsError(RetryLaterError):
    """More requests, waiting jobs or wrong keys than are allowed."""


class PreviewError(ServiceError):
    """A preview that took too long, or whose worker died; a job has more time."""


class JobFailedError(ServiceError):
    """The results of a job that failed were asked for.

    Attributes
    ----------
    error : mapping
        The error of the job: `type`, `detail` and, for a bad scene, `issues`.
    """

    def __init__(self, detail: str, error: Mapping[str, object]) -> None:
        self.error = error
        super().__init__(detail)


class ServiceProblem(ServiceError):  # noqa: N818 - named after RFC 9457's "problem"
    """A problem document (RFC 9457) that a service answered with.

    Attributes
    ----------
    status : int
        The HTTP status.
    problem : mapping
        The whole document: `type`, `title`, `status`, `detail`, `instance`, `errors`.
    """

    def __init__(self, status: int, problem: Mapping[str, object]) -> None:
        self.status = status
        self.problem = problem
        super().__init__(str(problem.get("detail") or problem.get("title") or f"HTTP status {status}"))


class InputError(Exception):
    """An argument or option of the command that cannot be used; the message names it and quotes its value."""
