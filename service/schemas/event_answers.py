"""What the events of a job say."""

from __future__ import annotations

import json
from collections.abc import Iterable, Iterator
from dataclasses import dataclass
from typing import Any

from pydantic import Field

from service.db.models import JobState
from service.schemas.answers import BEST, AnswerModel, JobAnswer

END, PARTIAL, PROGRESS = "end", "partial", "progress"


class JobProgress(AnswerModel):
    """Data of the event `progress`."""

    status: JobState
    attempt: int
    progress: float = Field(description="Fraction of the path, 0 to 1.")
    points: int = Field(description="Points computed so far.")
    best: dict[str, Any] | None = Field(default=None, description=BEST)


class JobPoints(AnswerModel):
    """Data of the event `partial`."""

    attempt: int
    start: int = Field(description="Number of the first of these points; what was there from it on is void.")
    points: list[tuple[float, float]] = Field(description="Value of what is swept, amplitude [m].")


EventData = JobProgress | JobPoints | JobAnswer
_MODELS: dict[str, type[JobProgress] | type[JobPoints] | type[JobAnswer]] = {
    PROGRESS: JobProgress,
    PARTIAL: JobPoints,
    END: JobAnswer,
}


@dataclass(frozen=True, slots=True)
class Told:
    """An event as it came through a stream; `data` is None for a comment or an unknown event."""

    data: EventData | None
    id: str | None


def told(lines: Iterable[str]) -> Iterator[Told]:
    """Read a stream of events line by line, as the HTML standard says.

    Comments are passed on as signs of life.
    """
    fields: dict[str, str] = {}
    for line in lines:
        if line.startswith(":"):
            yield Told(None, None)
        elif line:
            name, _, value = line.partition(":")
            value = value.removeprefix(" ")
            fields[name] = f"{fields[name]}\n{value}" if name == "data" and name in fields else value
        elif fields:
            yield _read(fields)
            fields = {}


def _read(fields: dict[str, str]) -> Told:
    model = _MODELS.get(fields.get("event", ""))
    if model is None or "data" not in fields:
        return Told(None, fields.get("id"))
    data: Any = json.loads(fields["data"])
    return Told(model.model_validate(data), fields.get("id"))
