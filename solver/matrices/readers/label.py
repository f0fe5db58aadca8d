"""The name of a row: a node and a component."""

from __future__ import annotations

from typing import NamedTuple

COMPONENTS = ("UX", "UY", "UZ", "ROTX", "ROTY", "ROTZ")
OWN_COMPONENTS = ("U1", "U2", "U3", "UR1", "UR2", "UR3")
"""Along and about the axes of a node's own frame, where it could not be turned into the global one."""


class Label(NamedTuple):
    """A node and a component of its motion: ``UX`` to ``ROTZ``, or what the file calls it."""

    node: int
    component: str

    def __str__(self) -> str:
        return f"{self.node}.{self.component}"

    @property
    def rotation(self) -> bool:
        """Whether it is an angle."""
        return self.component in COMPONENTS[3:] + OWN_COMPONENTS[3:]

    @property
    def place(self) -> tuple[int, int, str]:
        """What labels are sorted by: node, then UX to ROTZ, then the rest."""
        known = self.component in COMPONENTS
        return self.node, COMPONENTS.index(self.component) if known else len(COMPONENTS), self.component
