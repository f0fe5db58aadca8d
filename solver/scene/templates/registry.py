"""The templates there are."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from pydantic import ValidationError

from solver.errors import Issue, SceneError, pointer
from solver.scene.json_schema import plain, words_of
from solver.scene.scene import Scene
from solver.scene.templates.ground import GroundDamper
from solver.scene.templates.shroud import ShroudContact
from solver.scene.templates.template import Template
from solver.scene.templates.underplatform import PlatformDamper, RingDamper
from solver.scene.validation import field_issues

TEMPLATES: Mapping[str, type[Template]] = {
    each.NAME: each for each in (GroundDamper, PlatformDamper, ShroudContact, RingDamper)
}


def template_schema(template: type[Template]) -> dict[str, Any]:
    """The questions of a template as a JSON Schema with the words of its docstring."""
    schema: dict[str, Any] = plain(template.model_json_schema())
    words = words_of(template)
    for key, given in schema["properties"].items():
        given["description"] = words[key]
    schema["description"] = (template.__doc__ or "").partition("\n")[0]
    return schema


def template_tables(name: str, answers: Mapping[str, Any]) -> dict[str, Any]:
    """The tables of a scene made of a template.

    Raises
    ------
    SceneError
        There is no such template, or an answer is out of its range: a JSON pointer and a sentence for each.
    """
    template = TEMPLATES.get(name)
    if template is None:
        message = f"no template {name!r}: there are {', '.join(TEMPLATES)}"
        raise SceneError([Issue(pointer="", message=message)])
    questions = ", ".join(template.model_fields)
    unknown = [
        Issue(pointer=pointer(key), message=f"`{key}` is no question of {name!r}: there are {questions}")
        for key in answers
        if key not in template.model_fields
    ]
    if unknown:
        raise SceneError(unknown)
    try:
        return template.model_validate(dict(answers)).tables()
    except ValidationError as error:
        raise SceneError(field_issues(error, dict(answers))) from error


def new_scene(template: str, **answers: Any) -> Scene:
    """A scene of a common case, made of the few things a designer knows.

    Parameters
    ----------
    template : ``ground-damper``, ``platform-damper``, ``shroud`` or ``split-ring``.
    answers : the fields of its class in `solver.scene.templates`, in SI units; the rest has defaults.

    Raises
    ------
    SceneError
        There is no such template, or an answer is out of its range.
    """
    return Scene.from_dict(template_tables(template, answers))
