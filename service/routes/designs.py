"""``/v1/designs``: what was designed, to be queried."""

from __future__ import annotations

from typing import Annotated, Any

from fastapi import APIRouter, Query, Request, Response

from service.answers import DesignDetail, DesignPage
from service.design_queries import DesignQuery, design_detail, design_page
from service.http import ServiceDependency, tagged

router = APIRouter(prefix="/v1/designs", tags=["designs"])

_UNCHANGED: dict[int | str, dict[str, Any]] = {304: {"description": "`If-None-Match` has its ETag."}}


@router.get("")
def list_designs(service: ServiceDependency, query: Annotated[DesignQuery, Query()]) -> DesignPage:
    """Stored designs that meet every filter, newest first unless `sort` says otherwise."""
    return design_page(service.designs, query, service.settings)


@router.get("/{design_id}", response_model=DesignDetail, responses=_UNCHANGED)
def get_design(design_id: str, request: Request, service: ServiceDependency) -> Response:
    """A stored design with the whole result of its job; its id is that of the job. Has a strong ETag."""
    answer = design_detail(service.design(design_id), service.designs)
    return tagged(request, answer.model_dump_json().encode())
