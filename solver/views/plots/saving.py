"""Pictures as files."""

from __future__ import annotations

from pathlib import Path

from matplotlib.figure import Figure

from solver.results.dataset import Dataset
from solver.results.files import whole
from solver.views.plots.html import picture_page
from solver.views.plots.style import write


def save(page: Figure, path: Path, data: Dataset | None = None) -> None:
    """Write a picture, whole or not at all; the suffix chooses the format.

    Parameters
    ----------
    page : what was drawn.
    path : ends in one of `solver.views.plots.SUFFIXES`.
    data : the numbers behind it, which a page of HTML lists.
    """
    with whole(path) as temporary:
        if path.suffix.lower() == ".html":
            temporary.write_text(picture_page(page, data), "utf-8")
            return
        write(page, temporary, path.suffix.lower().removeprefix("."))
