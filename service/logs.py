"""Where the log of a service process goes."""

from __future__ import annotations

import logging

_FORMAT = "%(asctime)s %(levelname)s %(name)s %(message)s"


def configure(level: int = logging.INFO) -> None:
    """Log to standard error, unless the program has set up logging already."""
    logging.basicConfig(level=level, format=_FORMAT)
    logging.getLogger("alembic").setLevel(logging.WARNING)
