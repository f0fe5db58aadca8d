"""``/v1/laws``: the contact laws there are, for programs that make their forms of them."""

from __future__ import annotations

from fastapi import APIRouter

from service.schemas.law_answers import LawList, law_list

router = APIRouter(prefix="/v1/laws", tags=["scenes"])


@router.get("")
def list_laws() -> LawList:
    """The contact laws of this service, each with its parameters: unit, words, what a slider covers."""
    return law_list()
