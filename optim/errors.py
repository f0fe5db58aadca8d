"""The exceptions of the design layer."""

from __future__ import annotations


class DesignError(Exception):
    """A design problem that cannot be posed; the message names the argument and what would be right."""

    def __init__(self, name: str, value: object, wanted: str) -> None:
        self.name = name
        self.value = value
        super().__init__(f"`{name}` {wanted}, got {value!r}")
