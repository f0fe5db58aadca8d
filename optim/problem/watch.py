"""What a caller may give to watch a search and to stop it."""

from __future__ import annotations

from collections.abc import Callable

OnProgress = Callable[[float, int], None] | None
ShouldStop = Callable[[], bool] | None
