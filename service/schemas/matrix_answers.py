"""What the service answers about uploads, and what `POST /v1/matrices` reads in them."""

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


class FormatAnswer(AnswerModel):
    """A format of files that can be uploaded."""

    name: str
    suffixes: list[str] = Field(description="What the names of its files end in.")
    word: str = Field(description="Of `?format=`.")
    gives: list[str] = Field(description="Any of matrix, matrices (one or several), modes, labels, nodes.")
    help: str = Field(description="What the files hold and which program writes them.")


class FormatsAnswer(AnswerModel):
    """The formats that can be uploaded."""

    items: list[FormatAnswer]
    most_bytes: int = Field(description="Largest upload accepted, the setting STICKSLIP_MAX_UPLOAD_BYTES.")
    most_parts: int = Field(description="Parts of a larger file, the setting STICKSLIP_MAX_UPLOAD_PARTS.")


class MatrixAnswer(AnswerModel):
    """A matrix that was read."""

    name: str
    rows: int
    entries: int


class LabelsAnswer(AnswerModel):
    """What the files call their rows."""

    first: list[str] = Field(description="Of the first rows, 400 at most.")
    components: list[str]
    nodes: tuple[int, int] = Field(description="The lowest and the highest.")


class MassAnswer(AnswerModel):
    """The mass that moves in one direction."""

    direction: str
    kg: float


class SetAnswer(AnswerModel):
    """A set of nodes of a deck."""

    name: str
    nodes: int = Field(description="How many.")


class KeptDiameterAnswer(AnswerModel):
    """What a reduced sector is at one nodal diameter."""

    diameter: int
    frequencies_hz: list[float] = Field(description="The lowest, without contacts.")
    good_to_hz: float = Field(description="Frequencies up to here are estimated exact to 0.1 %.")


class KeptAnswer(AnswerModel):
    """What a reduction kept, and what it is good for."""

    modes: int
    highest_hz: float
    good_to_hz: float = Field(description="Frequencies up to here are estimated exact to 0.1 %.")
    held_hz: list[float]
    static_residual: float
    mass_carried: dict[str, float] = Field(description="By DOF; empty of a sector.")
    diameters: list[KeptDiameterAnswer] | None = Field(default=None, description="Of a sector.")


class MatricesAnswer(AnswerModel):
    """What was read, what should be known of it, and the scene."""

    structure: dict[str, Any] = Field(description="Which upload is what.")
    rows: int
    modes: int | None = None
    matrices: list[MatrixAnswer]
    held: int = Field(default=0, description="Rows left out because a boundary condition holds them.")
    labels: LabelsAnswer | None = None
    mass: MassAnswer | None = None
    frequencies_hz: list[float] | None = Field(
        description="The lowest, null before a large model is reduced."
    )
    sets: list[SetAnswer] | None = Field(
        default=None, description="Of the deck, for the boundaries of a sector."
    )
    diameters: list[int] | None = Field(default=None, description="Nodal diameters of a reduced sector.")
    notes: list[str] = Field(description="What looks wrong, and what to do.")
    reduction: KeptAnswer | None = None
    scene: dict[str, Any] | None = Field(default=None, description="Null until DOFs are named.")
