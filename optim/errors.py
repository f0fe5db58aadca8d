"""The exceptions of the design layer."""

from __future__ import annotations

from solver.errors import Issue, Place, SettingError


class DesignError(SettingError):
    """A design problem that cannot be posed; the message names the argument and what would be right.

    Parameters
    ----------
    name : the argument, or the keys and indices that lead to a part of it: ``("cases", 0, "band")`` is called
        ``cases[0].band``.
    value : what was given.
    wanted : what would be right.
    place : where that stands, if not where the name says.
    """

    def __init__(
        self, name: str | Place, value: object, wanted: str, *, place: Place | None = None
    ) -> None:  # fmt: skip
        super().__init__(name, value, wanted)
        self.place = self.issue.subject if place is None else place
        self.args = (self.issue.said(self.name),)


class DataError(DesignError):
    """Measured data that cannot be used; the message names the file, the line and what would be right.

    Parameters
    ----------
    source : the file, or the place in a description.
    value : what stands there.
    wanted : what would be right.
    line : of the file, counted from 1.
    column : its name.
    place : where the run stands in a description, ``("data", 0)``.
    """

    def __init__(
        self, source: str, value: object, wanted: str, *, line: int | None = None, column: str = "",
        place: Place = ("data",),
    ) -> None:  # fmt: skip
        where = source + (f", line {line}" if line is not None else "") + (f", `{column}`" if column else "")
        super().__init__("data", value, wanted, place=place)
        self.source, self.line, self.column = source, line, column
        self.issue = Issue(place, f"{where}: {wanted}", value, named=False)
        self.args = (self.issue.said(),)
