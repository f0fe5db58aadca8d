"""The table of all settings in docs/operations.md; `python -m service.rendering.docs_tables` writes it."""

from __future__ import annotations

from pydantic.fields import FieldInfo

from service.settings.limits import Limits
from service.settings.settings import Settings

_HEAD = "| variable | default | |\n| --- | --- | --- |\n"
# Defaults that depend on the machine.
_SAID = {"workers": "processors"}


def settings_table() -> str:
    """The settings with their defaults and what they mean, as a table of Markdown."""
    fields = Settings.model_fields
    # What is inherited comes first there, and last here.
    ordered = sorted(fields, key=lambda name: name in Limits.model_fields)
    return _HEAD + "".join(_row(name, fields[name]) for name in ordered)


def _row(name: str, field: FieldInfo) -> str:
    default = _SAID.get(name) or _shown(field.get_default(call_default_factory=True))
    meaning = (field.description or "").replace("|", "\\|")
    return f"| `STICKSLIP_{name.upper()}` | {default} | {meaning} |\n"


def _shown(default: object) -> str:
    if default is None:
        return "unset"
    return f"`{str(default).lower() if isinstance(default, bool) else default}`"
