"""The keys of a model as keyword arguments of a function: in its signature and in its docstring."""

from __future__ import annotations

import inspect
from collections.abc import Callable, Container
from textwrap import fill
from typing import Any, TypeVar, get_type_hints

from pydantic import BaseModel

Function = TypeVar("Function", bound=Callable[..., Any])
MARK = "    **problem : the keys of a problem.\n"
_WIDTH = 110


def keywords(model: type[BaseModel], without: Container[str] = ()) -> Callable[[Function], Function]:
    """Give a function that takes ``**problem`` the keys of a model as its arguments.

    `inspect.signature`, `help` and completion show them, each with what its description says in place of
    the line `MARK` of the docstring. What the function names itself stays as it is.

    Parameters
    ----------
    model : the keys, with their types, defaults and descriptions.
    without : those that the function does not take.
    """
    types = get_type_hints(model)

    def with_keys(function: Function) -> Function:
        signature = inspect.signature(function)
        own = [one for one in signature.parameters.values() if one.kind is not inspect.Parameter.VAR_KEYWORD]
        named = {one.name for one in own}
        keys = [
            inspect.Parameter(
                name, inspect.Parameter.KEYWORD_ONLY, default=field.default, annotation=types[name]
            )
            for name, field in model.model_fields.items()
            if name not in named and name not in without
        ]
        told = [_told(key.name, str(model.model_fields[key.name].description)) for key in keys]
        function.__doc__ = (function.__doc__ or "").replace(MARK, "".join(told))
        function.__signature__ = signature.replace(parameters=[*own, *keys])  # type: ignore[attr-defined]
        return function

    return with_keys


def _told(name: str, description: str) -> str:
    """The lines of a key in a docstring."""
    # The first letter is small there, but for symbols.
    text = description if description[1:2].isupper() else description[0].lower() + description[1:]
    return fill(f"{name} : {text}", _WIDTH, initial_indent="    ", subsequent_indent=" " * 8) + "\n"
