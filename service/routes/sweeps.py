"""``/v1/sweeps``: what was computed, to be queried."""

from __future__ import annotations

from typing import Annotated

from fastapi import APIRouter, Query

from service.answers import SweepDetail, SweepPage
from service.http import ServiceDependency
from service.sweep_queries import SweepQuery, sweep_page

router = APIRouter(prefix="/v1/sweeps", tags=["sweeps"])


@router.get("")
def list_sweeps(service: ServiceDependency, query: Annotated[SweepQuery, Query()]) -> SweepPage:
    """Stored sweeps that meet every filter, newest first unless `sort` says otherwise."""
    return sweep_page(service.sweeps, query, service.settings)


@router.get("/{sweep_id}")
def get_sweep(sweep_id: str, service: ServiceDependency) -> SweepDetail:
    """A stored sweep with its arrays."""
    return SweepDetail.load(sweep_id, service.sweeps)
