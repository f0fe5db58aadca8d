"""The parameter paths that help, schemas and errors give as examples."""

from __future__ import annotations

DISK_LOAD = "shroud.N0"
"""Normal load of a contact of the shipped scene `bladed-disk`."""
DAMPER_LOAD = "damper.N0"
"""That of `two-dof`."""
DISK_LOADS = "shroud.N0,root.N0"
"""Both loads of `bladed-disk`, which share a value."""
