"""The revisions of before the first release, by which the tests bring old databases to the one of today."""

from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

import pytest
from alembic.config import Config

from service.db import revisions

FOLDER = Path(__file__).parent.parent / "data" / "earlier_revisions"


@contextmanager
def known() -> Iterator[None]:
    """Have `service.db.revisions` go by these instead of its own."""
    ours = revisions._config

    def config() -> Config:
        made = ours()
        made.set_main_option("version_locations", str(FOLDER))
        return made

    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(revisions, "_config", config)
        yield
