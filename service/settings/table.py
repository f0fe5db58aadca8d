"""The table of all settings in a page: ``python -m service.settings.table docs/operations.md``."""

from __future__ import annotations

import sys
from pathlib import Path

from pydantic.fields import FieldInfo

from service.settings.settings import Settings

BEGIN, END = "<!-- settings: begin -->", "<!-- settings: end -->"
_HEAD = "| variable | default | |\n| --- | --- | --- |\n"
# Defaults that depend on the machine.
_SAID = {"workers": "processors"}


def settings_table() -> str:
    """The settings with their defaults and what they mean, as a table of Markdown."""
    return _HEAD + "".join(_row(name, field) for name, field in Settings.model_fields.items())


def _row(name: str, field: FieldInfo) -> str:
    default = _SAID.get(name) or _shown(field.get_default(call_default_factory=True))
    meaning = (field.description or "").replace("|", "\\|")
    return f"| `STICKSLIP_{name.upper()}` | {default} | {meaning} |\n"


def _shown(default: object) -> str:
    if default is None:
        return "unset"
    return f"`{str(default).lower() if isinstance(default, bool) else default}`"


def with_table(text: str) -> str:
    """The page with the table between its marks as it is now (ValueError if the marks are not there)."""
    before, rest = text.split(BEGIN)
    _, after = rest.split(END)
    return f"{before}{BEGIN}\n\n{settings_table()}\n{END}{after}"


def main() -> None:
    """Bring the table of a page up to date."""
    page = Path(sys.argv[1])
    page.write_text(with_table(page.read_text(encoding="utf-8")), encoding="utf-8")


if __name__ == "__main__":
    main()
