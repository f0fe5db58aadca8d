"""``/v1/measurements/read``: measured data in the text of files, before they are handed in with a job."""

from __future__ import annotations

from typing import Annotated, Any

from fastapi import APIRouter, Body, Response
from pydantic import BaseModel, ConfigDict, Field

from service.http.dependencies import InContext, TypedRoute
from service.http.in_lane import computed
from service.jobs import answering
from service.jobs.common.scenes import SceneRequest

router = APIRouter(prefix="/v1/measurements", tags=["scenes"], route_class=TypedRoute)

_ROWS = "# damper.N0 = 100\nfrequency [Hz],amplitude [mm]\n1.0,1930\n1.1,2120\n1.2,1770\n"
_FILES: dict[str, Any] = {"scene": "two-dof", "files": [{"name": "rig.csv", "text": _ROWS}]}
MOST_CHARACTERS, MOST_FILES = 2_000_000, 50


class MeasuredFile(BaseModel):
    """A file of measured data in CSV."""

    model_config = ConfigDict(extra="forbid", frozen=True)

    name: str = Field(min_length=1, max_length=200)
    text: str = Field(max_length=MOST_CHARACTERS)


class MeasurementsRequest(SceneRequest):
    """The texts of files, and the scene they were measured of."""

    model_config = ConfigDict(json_schema_extra={"examples": [_FILES]})

    files: list[MeasuredFile] = Field(min_length=1, max_length=MOST_FILES)


class MeasuredRun(BaseModel):
    """Rows under the same conditions: amplitude [m] over frequency [Hz], or force [N] over motion [m]."""

    kind: str
    conditions: dict[str, float]
    of: str = Field(description="The degree of freedom, or the contact.")
    points: int
    x: list[float]
    data: list[float]


class ReadFile(BaseModel):
    """A file that can be read: its table in the words of a job of the kind `identify`, and its runs."""

    name: str
    table: dict[str, Any]
    runs: list[MeasuredRun]


class MeasurementIssue(BaseModel):
    """Something wrong with a file; line and column where it is of a cell."""

    file: str
    line: int | None
    column: str | None
    detail: str


class MeasurementsRead(BaseModel):
    """What can be read, and what is wrong."""

    files: list[ReadFile]
    issues: list[MeasurementIssue]


ReadBody = Annotated[MeasurementsRequest, Body(openapi_examples={"read": {"value": _FILES}})]


@router.post("/read", response_model=MeasurementsRead)
async def read_measurements(body: ReadBody, context: InContext) -> Response:
    """Read measured data in CSV against a scene; nothing is stored.

    The first thing that is wrong with each file is told with its line and column.
    """
    words = {
        "scene": body.model_dump(exclude={"files"}),
        "files": [file.model_dump() for file in body.files],
    }
    found = await computed(context, answering.MEASURED, words, about="/files")
    return Response(found, media_type="application/json")
