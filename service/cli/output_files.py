"""The files a computing command writes beside what it prints: ``--plot`` and ``--out``."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Protocol, Self

from service.cli.options.inputs import output_path

if TYPE_CHECKING:
    from matplotlib.figure import Figure

    from solver.results.dataset import Dataset
    from solver.scene.scene import Scene


class Result(Protocol):
    """What can be written as a table."""

    def to_dataset(self) -> Dataset:
        """The result as named arrays."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Outputs:
    """Where a picture and the numbers go, if anywhere."""

    picture: Path | None
    file: Path | None

    @classmethod
    def asked(cls, plot: str | None, out: str | None) -> Self:
        """Check both options before the work begins.

        Raises
        ------
        InputError
            A suffix that has no writer, or a folder that is not there.
        """
        if plot is None and out is None:
            return cls(picture=None, file=None)
        from solver.views.io import SUFFIXES as FILES
        from solver.views.plots import SUFFIXES as PICTURES

        return cls(picture=output_path("--plot", plot, PICTURES), file=output_path("--out", out, FILES))

    def write(
        self, result: Result, draw: Callable[[], Figure] | None, *, scene: Scene | None = None
    ) -> None:  # fmt: skip
        """Write what was asked for.

        Parameters
        ----------
        result : what was computed.
        draw : makes its picture; None where there is nothing to draw.
        scene : of a result that does not know its own.
        """
        if self.picture is None and self.file is None:
            return
        from dataclasses import replace

        from solver.views.io import save, scene_attributes

        data = result.to_dataset()
        if scene is not None and "scene" not in data.attributes:
            data = replace(data, attributes={**data.attributes, **scene_attributes(scene)})
        if self.picture is not None and draw is not None:
            from solver.views.plots import html

            html.save(draw(), self.picture, data)
        if self.file is not None:
            save(data, self.file)
