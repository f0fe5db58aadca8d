"""What the service answers about uploads."""

from __future__ import annotations

from datetime import datetime
from typing import Any, Self

from pydantic import Field

from service.db.models import Upload
from service.schemas.answers import AnswerModel, Page


class UploadAnswer(AnswerModel):
    """An uploaded file."""

    id: str
    name: str
    format: str
    size: int = Field(description="Bytes.")
    sha256: str
    created: datetime
    links: dict[str, str]

    @classmethod
    def of(cls, row: Upload, **more: Any) -> Self:
        """The answer for a row."""
        return cls._from(row, links={"self": f"/v1/uploads/{row.id}"}, **more)


class UploadedArray(AnswerModel):
    """A matrix or the modes in a file."""

    name: str | None = Field(description="Its name in the file, null for a file of one matrix.")
    rows: int
    columns: int
    entries: int | None = Field(description="Entries stored of a matrix.")


class NewUpload(UploadAnswer):
    """An uploaded file with what it holds."""

    contents: list[UploadedArray]


class UploadPage(Page[UploadAnswer]):
    """A page of uploads, newest first."""
