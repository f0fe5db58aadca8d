"""``/v1/designs``: what was designed, to be queried."""

from __future__ import annotations

from typing import Annotated

from fastapi import APIRouter, Query, Response

from service.http.dependencies import InContext, listing, tagged
from service.http.in_lane import reading
from service.http.routes.described import LISTED, UNCHANGED
from service.schemas.answers import DesignDetail, DesignPage
from service.schemas.design_queries import DesignQuery, design_detail, design_page

router = APIRouter(prefix="/v1/designs", tags=["designs"])


@router.get("", response_model=DesignPage, responses=LISTED)
@reading
def list_designs(context: InContext, query: Annotated[DesignQuery, Query()]) -> Response:
    """Stored designs that meet every filter, newest first unless `sort` says otherwise."""
    service = context.service
    return listing(context, design_page(service.designs, query, service.settings, context.sees))


@router.get("/{design_id}", response_model=DesignDetail, responses=UNCHANGED)
@reading
def get_design(design_id: str, context: InContext) -> Response:
    """A stored design with the whole result of its job; its id is that of the job. Has a strong ETag."""
    answer = design_detail(context.service.design(design_id, context.caller), context.service.designs)
    return tagged(context.request, answer.model_dump_json().encode())
