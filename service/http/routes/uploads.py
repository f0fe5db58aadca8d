"""``/v1/uploads``: files of matrices and modes that scenes refer to."""

from __future__ import annotations

import tempfile
from functools import partial
from pathlib import Path
from typing import Annotated, Any, ClassVar

from fastapi import APIRouter, Query, Response
from fastapi.responses import JSONResponse
from pydantic import Field, GetJsonSchemaHandler
from pydantic_core import CoreSchema

from service.http.bodies import saved
from service.http.dependencies import LISTED, InContext, listing
from service.http.in_lane import reading, writing
from service.schemas.pages import Cursor, Limit, ListQuery, newest
from service.schemas.upload_answers import NewUpload, UploadAnswer, UploadedArray, UploadPage
from service.uploads.uploads import Arrived, file_name, format_of

router = APIRouter(prefix="/v1/uploads", tags=["uploads"])


class _Words:
    """The words of the formats in the description of the API, as the readers say them when it is made."""

    def __get_pydantic_json_schema__(
        self, schema: CoreSchema, handler: GetJsonSchemaHandler
    ) -> dict[str, Any]:
        from solver.matrices.readers import registry

        return {**handler(schema), "enum": list(registry.words())}


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


@router.post(
    "",
    status_code=201,
    response_model=NewUpload,
    responses={200: {"model": NewUpload, "description": "The same file was uploaded before."}},
)
async def upload(context: InContext, name: FileName = "matrices", form: Format = None) -> Response:
    """Store a file of a matrix, several matrices or modes: the body is the file.

    It is read at once, within limits, and refused if it holds nothing usable. In a scene, `upload:ID` stands
    where `M`, `K`, `C` or `modes` of a structure of kind `matrices` would name a file.
    """
    request, service, caller = context.request, context.service, context.caller
    media = request.headers.get("content-type", "").split(";")[0].strip().lower()
    known = format_of(form, name, media)
    settings = service.settings
    with tempfile.TemporaryDirectory(prefix="stickslip-") as folder:
        path = Path(folder) / file_name(name, known)
        with path.open("wb") as file:
            size, sha256 = await saved(request, file, settings.max_upload_bytes, settings.upload_seconds)
        arrived = Arrived(path=path, name=name, format=known, size=size, sha256=sha256)
        row, found, added = await service.lanes.uploads.run(
            caller.owner, service.uploads.add, arrived, caller
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
    from solver.matrices.readers import registry

    return (*registry.media(), "application/octet-stream")
