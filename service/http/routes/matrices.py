"""``/v1/matrices``: what uploaded matrices are, and the scene that begins with them."""

from __future__ import annotations

from typing import Annotated, Any

from fastapi import APIRouter
from pydantic import BaseModel, ConfigDict, Field

from service.errors import InvalidRequestError
from service.http.dependencies import InContext, JsonBody
from service.jobs.validation import validated
from service.schemas.matrix_answers import FormatAnswer, FormatsAnswer, MatricesAnswer
from solver.errors import Issue

router = APIRouter(prefix="/v1/matrices", tags=["uploads"])

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


class _Strict(BaseModel):
    """No other keys."""

    model_config = ConfigDict(extra="forbid", frozen=True)


class ContactPlace(_Strict):
    """A contact to begin with: between which DOFs, or a DOF and `ground`."""

    name: Name
    between: Annotated[list[Name], Field(min_length=2, max_length=2)]


class OfDof(_Strict):
    """A DOF by its name."""

    dof: Name


class ForceOnDof(OfDof):
    """A DOF by its name, and of a sector the wave of the force."""

    engine_order: Annotated[int, Field(strict=True, ge=0, le=10_000)] | None = None


class MatricesRequest(_Strict):
    """Uploads to be looked at, or a structure that refers to them; with its DOFs, the scene it begins.

    Attributes
    ----------
    uploads : list of str
        Ids, in place of `structure`: which is M, K, C or names the rows is found out.
    structure : dict or None
        Tables of a structure of kind `matrices`; of a sector with `sectors` and `cyclic`.
    """

    model_config = ConfigDict(extra="forbid", frozen=True, json_schema_extra={"examples": [_EXAMPLE]})

    uploads: list[UploadId] = Field(default=[], max_length=6, description="Ids, in place of `structure`.")
    structure: dict[Annotated[str, Field(max_length=100)], Any] | None = None
    name: Name = "my-model"
    contacts: list[ContactPlace] = Field(default=[], max_length=100)
    excitation: ForceOnDof | None = Field(
        default=None, description="Where the force acts; of a sector also its engine order, 1 if null."
    )
    observe: OfDof | None = Field(default=None, description="What is observed; where the force acts if null.")


@router.get("/formats")
def formats() -> FormatsAnswer:
    """The formats that can be uploaded."""
    # Loaded here: a service that only lists does not need SciPy.
    from solver.matrices.readers.registry import readers

    return FormatsAnswer(
        items=[
            FormatAnswer(
                name=reader.name, suffixes=list(reader.suffixes), word=reader.word, gives=list(reader.gives),
                help=reader.help.replace("`", ""),
            )
            for reader in readers()
        ]
    )  # fmt: skip


@router.post("")
async def look(body: JsonBody, context: InContext) -> MatricesAnswer:
    """Look at uploaded matrices: sizes, labels, mass, frequencies, what is wrong and what to do.

    With `dofs` in the structure the answer has a scene that refers to the uploads, with a band around the
    first mode and contacts whose values are of the right size to begin with. Of one sector of a disk the
    structure has `sectors` and `cyclic` (`nodes`, `low`, `high`, `axis`, `keep_modes`), as in a scene file,
    and the modes are those of the nodal diameter of the engine order. Nothing is stored.
    """
    request = validated(MatricesRequest, body)
    if bool(request.uploads) == (request.structure is not None):
        raise InvalidRequestError(
            [Issue(pointer="/uploads", message="one of `uploads` and `structure` is needed")]
        )
    asked = request.model_dump()
    if (request.structure or {}).get("dofs"):
        if request.excitation is None:
            raise InvalidRequestError(
                [Issue(pointer="/excitation/dof", message="a DOF for the force is needed")]
            )
        asked["observe"] = asked["observe"] or {"dof": request.excitation.dof}
        if (request.structure or {}).get("sectors") is not None and request.excitation.engine_order is None:
            asked["excitation"]["engine_order"] = _USUAL_ORDER
    service, caller = context.service, context.caller
    found = await service.lanes.uploads.run(caller.owner, service.uploads.looked_at, asked, caller)
    return MatricesAnswer.model_validate(found)
