"""Pictures in one style, fit for reports: ``style``, ``responses``, ``motion``."""

from __future__ import annotations

SUFFIXES = (".png", ".svg", ".pdf", ".html")
"""The formats a picture can have; the suffix of its file chooses."""
