"""The typed body of each kind of job: its request with the key `kind`, which tells them apart."""

from __future__ import annotations

from functools import cache, reduce
from operator import or_
from typing import Annotated, Any, Literal

from pydantic import BaseModel, BeforeValidator, Field, create_model

from service.jobs.kind_registry import KIND, JobRequest, Registry

DESIGN = "design"
_WORD = "Request"


@cache
def _examples_in(request: type[JobRequest]) -> tuple[dict[str, Any], ...]:
    """The examples that a request's schema tells; a schema takes long to make."""
    return tuple(request.model_json_schema().get("examples", ()))


@cache
def body_model(name: str, request: type[JobRequest]) -> type[BaseModel]:
    """The body of a kind: `kind` first, and the keys of its request with their examples.

    Parameters
    ----------
    name : of the kind.
    request : its model.
    """

    def described(schema: dict[str, Any]) -> None:
        listed = schema["properties"]
        schema["properties"] = {KIND: listed.pop(KIND), **listed}
        schema["required"] = [KIND, *(key for key in schema.get("required", ()) if key != KIND)]
        if found := _examples_in(request):
            schema["examples"] = [{KIND: name, **example} for example in found]

    title = "".join(part.capitalize() for part in name.split("-")) + "Body"
    kind: Any = (Literal[name], Field(description="Kind of the job."))
    return create_model(
        title,
        __base__=request, __doc__=request.__doc__, __module__=request.__module__,
        __cls_kwargs__={
            "json_schema_extra": described,
            "title": f"{request.__name__.removesuffix(_WORD)}{_WORD}",
            "defer_build": False,
        },
        kind=kind,
    )  # fmt: skip


def any_body(registry: Registry) -> Any:
    """The type of a body of any of the kinds; with more than one, `kind` is to be its discriminator."""
    return reduce(or_, (body_model(kind.name, kind.request) for kind in registry))


def design_body(registry: Registry) -> type[BaseModel]:
    """The body of a design where nothing else is taken: `kind` may be left out."""
    known = DESIGN in registry
    base = registry[DESIGN].request if known else JobRequest
    only: Any = Annotated[Literal["design"], BeforeValidator(_only_design)]
    kind: Any = (only, Field(default=DESIGN, description="Kind of the job."))
    return create_model(
        "OnlyDesignBody" if known else "NoDesignBody",
        __base__=base, __doc__=base.__doc__, __module__=base.__module__,
        __cls_kwargs__={
            "title": base.__name__,
            "extra": "forbid" if known else "allow",
            "defer_build": False,
        },
        kind=kind,
    )  # fmt: skip


def _only_design(value: object) -> object:
    if value != DESIGN:
        raise ValueError(f"`kind` must be design here or be left out, got {value!r}")
    return value


def examples(registry: Registry) -> dict[str, Any]:
    """The examples of every kind by name, as OpenAPI has them."""
    return {
        name: {"value": {KIND: kind.name, **example["value"]}}
        for kind in registry
        for name, example in examples_of(registry, kind.name).items()
    }


def examples_of(registry: Registry, name: str, called: str | None = None) -> dict[str, Any]:
    """The examples of one kind, without the key `kind`; none of a kind that is not there."""
    if name not in registry:
        return {}
    title, found = called or name, _examples_in(registry[name].request)
    return {f"{title} {k}" if k > 1 else title: {"value": example} for k, example in enumerate(found, 1)}
