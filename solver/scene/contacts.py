"""The contacts of a scene: one of the classes of `solver.contacts.laws`, told by `law`."""

from __future__ import annotations

from collections.abc import Mapping
from functools import reduce
from operator import or_
from typing import Annotated, Any

from pydantic import Discriminator, GetCoreSchemaHandler, Tag
from pydantic_core import CoreSchema

from solver.contacts.laws.base import AnyContact
from solver.contacts.laws.registry import DEFAULT, laws

LAW_TAG = "law "  # begins the tags of the union: no key of a contact has a space


def _law_of(data: object) -> str:
    """The tag of a contact's law: of a table or of a contact already read."""
    law = data.get("law") if isinstance(data, Mapping) else getattr(data, "law", None)
    return LAW_TAG + (DEFAULT if law is None else str(law))


class _OfAnyLaw:
    """The union of the classes of all laws there are when the schema of the scene is made."""

    @classmethod
    def __get_pydantic_core_schema__(cls, source: object, handler: GetCoreSchemaHandler) -> CoreSchema:
        members: list[Any] = [Annotated[law, Tag(LAW_TAG + word)] for word, law in laws().items()]
        union = Annotated[reduce(or_, members), Discriminator(_law_of)]  # type: ignore[valid-type]
        return handler.generate_schema(union)


ContactOfAnyLaw = Annotated[AnyContact, _OfAnyLaw]
