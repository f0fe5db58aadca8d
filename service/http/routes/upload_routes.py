"""``/v1/uploads``, ``/v1/matrices``, ``/v1/measurements/read``: files, and what is in them."""

from __future__ import annotations

from functools import partial
from typing import Annotated, Any, ClassVar

from fastapi import APIRouter, Body, Query, Response
from fastapi.responses import JSONResponse
from pydantic import BaseModel, ConfigDict, Field, GetJsonSchemaHandler
from pydantic_core import CoreSchema

from service.db.models import Upload
from service.errors import BodyTooLargeError, InvalidRequestError
from service.http.dependencies import LISTED, Context, InContext, JsonBody, TypedRoute, listing, saved
from service.http.in_lane import computed, reading, writing
from service.jobs import answering
from service.jobs.common.scene_requests import SceneRequest
from service.jobs.strict_json import validated
from service.schemas.answers import AskedModel, Cursor, Limit, ListQuery, newest
from service.schemas.matrix_answers import (
    FormatAnswer,
    FormatsAnswer,
    MatricesAnswer,
    NewUpload,
    UploadAnswer,
    UploadedArray,
    UploadPage,
)
from service.uploads.uploads import PART, file_name, format_of

router = APIRouter(prefix="/v1/uploads", tags=["uploads"])


class _Words:
    """The words of the formats in the description of the API, as the readers say them when it is made."""

    def __get_pydantic_json_schema__(
        self, schema: CoreSchema, handler: GetJsonSchemaHandler
    ) -> dict[str, Any]:
        from solver.matrices.readers import reader_registry as registry

        return {**handler(schema), "enum": [*registry.words(), PART]}


FileName = Annotated[
    str,
    Query(
        max_length=200,
        pattern=r"^[A-Za-z0-9_][A-Za-z0-9_.\- ]*$",
        description="Name to show, whose suffix may tell the format; never a path.",
    ),
]

Format = Annotated[
    Annotated[str, Field(max_length=100), _Words()] | None,
    Query(alias="format", description="In place of the suffix of `name`."),
]


class UploadQuery(ListQuery):
    """Which uploads to list."""

    path: ClassVar[str] = "/v1/uploads"

    limit: Limit = 100
    cursor: Cursor = None


_WHOLE: list[str] = []
_TOO_LARGE = (
    "send it in parts (`format=part`), raise STICKSLIP_MAX_UPLOAD_BYTES or STICKSLIP_MAX_UPLOAD_PARTS, or "
    "reduce the model first: stickslip import FILES --reduce"
)
Parts = Annotated[
    list[Annotated[str, Field(max_length=100)]],
    Query(description="Ids of uploads of the format `part`, which in this order are the file; no body then."),
]


@router.post(
    "", status_code=201, response_model=NewUpload,
    responses={200: {"model": NewUpload, "description": "The same file was uploaded before."}},
)  # fmt: skip
async def upload(
    context: InContext, name: FileName = "matrices", form: Format = None, part: Parts = _WHOLE
) -> Response:
    """Store a file of a matrix, several matrices or modes: the body is the file.

    It is read at once, within limits, and refused if it holds nothing usable. In a scene, `upload:ID` stands
    where `M`, `K`, `C` or `modes` of a structure of kind `matrices` would name a file. A larger file comes in
    parts, each an upload with `?format=part` that is not read; then a request without a body names them. They
    go as the file is stored: if it is refused they stay.
    """
    request, service, caller = context.request, context.service, context.caller
    media = request.headers.get("content-type", "").split(";")[0].strip().lower()
    known = format_of(form, name, media)
    settings = service.settings
    if part and known == PART:
        wanted = "is put together to a whole file, whose `format` is wanted"
        raise InvalidRequestError.of(("part",), wanted, source="query")
    with service.uploads.repository.files.work() as folder:
        path = folder / file_name(name, known)
        with path.open("wb") as file:
            try:
                size, sha256 = await saved(request, file, settings.max_upload_bytes, settings.upload_seconds)
            except BodyTooLargeError as error:
                raise BodyTooLargeError(f"{error.detail}: {_TOO_LARGE}") from error
        if part and size:
            raise InvalidRequestError.of(("part",), "goes without a body: its parts are the file", size)
        if len(part) > settings.max_upload_parts:
            raise BodyTooLargeError(f"a file may have {settings.max_upload_parts} parts: {_TOO_LARGE}")
        given = Upload(name=name, format=known, size=size, sha256=sha256)
        row, found, added = await service.lanes.uploads.run(
            caller.owner, service.uploads.add, path, given, part, caller
        )
    answer = NewUpload.of(row, contents=[UploadedArray(**one) for one in found])
    headers = {"Location": f"/v1/uploads/{row.id}"}
    return JSONResponse(answer.model_dump(mode="json"), 201 if added else 200, headers)


@router.get("", response_model=UploadPage, responses=LISTED)
@reading
def list_uploads(context: InContext, query: Annotated[UploadQuery, Query()]) -> Response:
    """Uploads, newest first."""
    found = partial(context.service.uploads.repository.page, owner=context.sees)
    rows, following = newest(query, context.service.settings, found)
    return listing(context, UploadPage(items=[UploadAnswer.of(row) for row in rows], next=following))


@router.get("/{upload_id}")
@reading
def get_upload(upload_id: str, context: InContext) -> UploadAnswer:
    """An upload, without its bytes."""
    return UploadAnswer.of(context.service.uploads.get(upload_id, context.caller))


@router.delete("/{upload_id}", status_code=204)
@writing
def delete_upload(upload_id: str, context: InContext) -> None:
    """Forget an upload. Scenes and jobs that were made with it keep what it held."""
    context.service.uploads.delete(upload_id, context.caller)


def upload_media() -> tuple[str, ...]:
    """Content types of an upload: those of the readers, and that of any file."""
    from solver.matrices.readers import reader_registry as registry

    return (*registry.media(), "application/octet-stream")


matrices = APIRouter(prefix="/v1/matrices", tags=["uploads"])

Name = Annotated[str, Field(pattern=r"^[A-Za-z0-9_@-]{1,100}$")]
UploadId = Annotated[str, Field(max_length=100)]
_USUAL_ORDER = 1  # as `stickslip import` has it
_EXAMPLE: dict[str, Any] = {
    "name": "beam",
    "structure": {"M": "upload:1", "K": "upload:2", "dofs": {"tip": "8.UY", "middle": 3}, "keep_modes": 10},
    "contacts": [{"name": "damper", "between": ["tip", "ground"]}],
    "excitation": {"dof": "middle"},
    "observe": {"dof": "tip"},
}


class ContactPlace(AskedModel):
    """A contact to begin with: between which DOFs, or a DOF and `ground`."""

    name: Name
    between: Annotated[list[Name], Field(min_length=2, max_length=2)]


class OfDof(AskedModel):
    """A DOF by its name."""

    dof: Name


class ForceOnDof(OfDof):
    """A DOF by its name, and of a sector the wave of the force."""

    engine_order: Annotated[int, Field(strict=True, ge=0, le=10_000)] | None = None


class MatricesRequest(AskedModel):
    """Uploads to be looked at, or a structure that refers to them; with its DOFs, the scene it begins."""

    model_config = ConfigDict(json_schema_extra={"examples": [_EXAMPLE]})

    uploads: list[UploadId] = Field(
        default=[], max_length=6,
        description="Ids, in place of `structure`: which is M, K, C or names the rows is found out.",
    )  # fmt: skip
    structure: dict[Annotated[str, Field(max_length=100)], Any] | None = Field(
        default=None, description="Of kind `matrices`; of a sector with `sectors` and `cyclic`."
    )
    name: Name = "my-model"
    contacts: list[ContactPlace] = Field(default=[], max_length=100)
    excitation: ForceOnDof | None = Field(
        default=None, description="Where the force acts; of a sector also its engine order, 1 if null."
    )
    observe: OfDof | None = Field(default=None, description="What is observed; where the force acts if null.")


@matrices.get("/formats")
def formats(context: InContext) -> FormatsAnswer:
    """The formats that can be uploaded."""
    from solver.matrices.readers.reader_registry import readers

    return FormatsAnswer(
        items=[
            FormatAnswer(
                name=reader.name, suffixes=list(reader.suffixes), word=reader.word, gives=list(reader.gives),
                help=reader.help.replace("`", ""),
            )
            for reader in readers()
        ],
        most_bytes=context.service.settings.max_upload_bytes,
        most_parts=context.service.settings.max_upload_parts,
    )  # fmt: skip


@matrices.post("")
async def look(body: JsonBody, context: InContext) -> MatricesAnswer:
    """Look at uploaded matrices: sizes, labels, mass, frequencies, what is wrong and what to do.

    With `dofs` in the structure the answer has a scene that refers to the uploads, with a band around the
    first mode and contacts whose values are of the right size to begin with. Of one sector of a disk the
    structure has `sectors` and `cyclic` (`nodes`, `low`, `high`, `axis`, `keep_modes`), as in a scene file,
    and the modes are those of the nodal diameter of the engine order. Nothing is stored.
    """
    request = validated(MatricesRequest, body)
    if bool(request.uploads) == (request.structure is not None):
        raise InvalidRequestError.of(("uploads",), "one of `uploads` and `structure` is needed", named=False)
    asked = request.model_dump()
    if (request.structure or {}).get("dofs"):
        if request.excitation is None:
            raise InvalidRequestError.of(("excitation", "dof"), "a DOF for the force is needed", named=False)
        asked["observe"] = asked["observe"] or {"dof": request.excitation.dof}
        if (request.structure or {}).get("sectors") is not None and request.excitation.engine_order is None:
            asked["excitation"]["engine_order"] = _USUAL_ORDER
    service, caller = context.service, context.caller
    found = await service.lanes.uploads.run(caller.owner, service.uploads.looked_at, asked, caller)
    return MatricesAnswer.model_validate(found)


measurements = APIRouter(prefix="/v1/measurements", tags=["scenes"], route_class=TypedRoute)

_ROWS = "# damper.N0 = 100\nfrequency [Hz],amplitude [mm]\n1.0,1930\n1.1,2120\n1.2,1770\n"
_FILES: dict[str, Any] = {"scene": "two-dof", "files": [{"name": "rig.csv", "text": _ROWS}]}
MOST_CHARACTERS, MOST_FILES = 2_000_000, 50


class ColumnChoice(AskedModel):
    """What a column of an export is."""

    quantity: str = Field(max_length=210, description="Such as `frequency`, or a parameter path.")
    unit: str | None = Field(default=None, max_length=20, description="That of the heading if left out.")


class MeasuredFile(AskedModel):
    """A file of measured data in CSV."""

    name: str = Field(min_length=1, max_length=200)
    text: str = Field(max_length=MOST_CHARACTERS)
    columns: dict[str, ColumnChoice] | None = Field(
        default=None, max_length=1000, description="Of an export: heading to what it is; others are left out."
    )


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


@measurements.post("/read", response_model=MeasurementsRead)
async def read_measurements(body: ReadBody, context: InContext) -> Response:
    """Read measured data in CSV against a scene; nothing is stored.

    The first thing that is wrong with each file is told with its line and column.
    """
    return await _of_files(answering.MEASURED, body, context)


async def _of_files(task: str, body: MeasurementsRequest, context: Context) -> Response:
    """What a task finds in the texts of files."""
    words = {"request": body, "files": [file.model_dump() for file in body.files]}
    return Response(await computed(context, task, words, about="files"), media_type="application/json")


class ExportColumn(BaseModel):
    """A column of an export, and what it is likely to be: nothing where it is left out."""

    heading: str
    quantity: str
    unit: str | None
    cells: list[str] = Field(description="Of the first rows, as they stand there.")


class ExportLayout(BaseModel):
    """How a file is laid out."""

    name: str
    separator: str
    decimal: str
    head_line: int
    rows: int
    known: bool = Field(description="Whether every heading is a word that files have here.")
    columns: list[ExportColumn]


class ExportQuantity(BaseModel):
    """What a column may be; `units` is empty where it is told in SI alone."""

    name: str
    words: str
    units: list[str]


class ExportLook(BaseModel):
    """What stands in files, before they are read."""

    files: list[ExportLayout]
    quantities: list[ExportQuantity]
    issues: list[MeasurementIssue]


@measurements.post("/look", response_model=ExportLook)
async def look_at_measurements(body: ReadBody, context: InContext) -> Response:
    """Say how exports are laid out and what their columns are likely to be; nothing is stored.

    Separators, decimal commas, lines above the headings and a line of units below them are told apart.
    """
    return await _of_files(answering.LOOK, body, context)
