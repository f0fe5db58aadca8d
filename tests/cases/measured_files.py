"""Files of measured responses in the styles of the usual programs, written from the formats' descriptions."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

GRAVITY, LBF, INCH = 9.80665, 4.4482216152605, 0.0254
HERTZ = np.linspace(0.8, 1.6, 17)  # steps of 0.05: no digits are lost
LEVEL = 100.0  # [N], of `two-dof`
SPIN = 2.0 * np.pi * HERTZ
# A resonance of some metres, as `two-dof` has it [m].
MOTION = 60.0 / (45.0 - SPIN**2 + 3.0j * SPIN)


@dataclass(frozen=True)
class Measured:
    """A way to write the motion: derivative, unit in SI, by a force of so many newtons."""

    order: int
    unit: str
    factor: float
    force: str = ""
    newtons: float = 1.0

    @property
    def label(self) -> str:
        return self.unit + (f"/{self.force}" if self.force else "")

    @property
    def numbers(self) -> np.ndarray:
        """The complex numbers in the file."""
        by = self.newtons / LEVEL if self.force else 1.0
        return MOTION * (1j * SPIN) ** self.order / self.factor * by


UNITS = (
    Measured(0, "m", 1.0),
    Measured(0, "mm", 1e-3),
    Measured(0, "µm", 1e-6),
    Measured(0, "in", INCH),
    Measured(1, "m/s", 1.0),
    Measured(1, "mm/s", 1e-3),
    Measured(1, "in/s", INCH),
    Measured(2, "m/s2", 1.0),
    Measured(2, "m/s²", 1.0),
    Measured(2, "g", GRAVITY),
    Measured(2, "m/s^2", 1.0),
    Measured(0, "m", 1.0, "N"),
    Measured(0, "mm", 1e-3, "N"),
    Measured(0, "mm", 1e-3, "kN", 1e3),
    Measured(0, "in", INCH, "lbf", LBF),
    Measured(1, "mm/s", 1e-3, "N"),
    Measured(2, "(m/s²)", 1.0, "N"),
    Measured(2, "m/s2", 1.0, "kN", 1e3),
    Measured(2, "g", GRAVITY, "N"),
    Measured(2, "g", GRAVITY, "lbf", LBF),
)


@dataclass(frozen=True)
class Universal:
    """A function of data set 58 or 58b."""

    function: int = 4
    unit: Measured = UNITS[11]
    labelled: bool = True
    ordinate: int | None = None
    denominator: int | None = None
    abscissa: int = 18
    node: int = 1
    direction: int = 1
    reference: tuple[int, int] = (1, 1)
    even: bool = False
    double: bool = True
    real: bool = False
    binary: str = ""
    exponent: str = "E"
    floats: int = 2
    sign: float = 1.0
    system: tuple[float, float] | None = None
    title: str = "Prüfstand"
    width: str = "wide"
    ordinate_label: str | None = None

    def written(self) -> bytes:
        numbers = self.sign * self.unit.numbers
        if self.system is not None and not self.labelled:
            numbers = self.sign * _of_system(self.unit, self.system)
        x = HERTZ
        y = np.abs(numbers)[:, None] if self.real else np.column_stack([numbers.real, numbers.imag])
        rows = y if self.even else np.column_stack([x, y])
        kind = ({True: 4, False: 2} if self.real else {True: 6, False: 5})[self.double]
        ordinate = (8, 11, 12)[self.unit.order] if self.ordinate is None else self.ordinate
        below = (13 if self.unit.force else 0) if self.denominator is None else self.denominator
        labels = (self.unit.unit, self.unit.force or "NONE") if self.labelled else ("NONE", "NONE")
        if self.ordinate_label is not None:
            labels = (self.ordinate_label, labels[1])
        head = [
            self.title,
            "NONE",
            "28-NOV-26 12:00:00",
            "NONE",
            "NONE",
            f"{self.function:5d}{1:10d}{1:5d}{0:10d} {'blade':10s}{self.node:10d}{self.direction:4d} "
            f"{'NONE':10s}{self.reference[0]:10d}{self.reference[1]:4d}",
            f"{kind:10d}{len(x):10d}{int(self.even):10d}{x[0]:13.5e}{x[1] - x[0]:13.5e}{0.0:13.5e}",
            *(
                f"{kind:10d}{0:5d}{0:5d}{0:5d} {'NONE':20s} {label:20s}"
                for kind, label in (
                    (self.abscissa, "Hz" if self.labelled else "NONE"),
                    (ordinate, labels[0]),
                    (below, labels[1]),
                    (0, "NONE"),
                )
            ),
        ]
        first = "    58"
        if self.binary:
            order = 1 if self.binary == "<" else 2
            size = rows.size * (8 if self.double else 4)
            first += f"b{order:6d}{self.floats:6d}{11:12d}{size:12d}{0:6d}{0:6d}{0:12d}{0:12d}"
        before = b"".join((line.ljust(80) + "\n").encode() for line in ("    -1", first, *head))
        end = b"    -1\n"
        if self.system is not None:
            length, force = self.system
            factors = f"{length:25.16E}{force:25.16E}{1.0:25.16E}\n{0.0:25.16E}\n"
            units = f"    -1\n   164\n{9:10d}{'user':20s}{2:10d}\n{factors}    -1\n"
            before = units.replace("E", "D").encode() + before
        if self.binary:
            return before + rows.astype(self.binary + ("f8" if self.double else "f4")).tobytes() + b"\n" + end
        return before + self._text(rows).replace("E", self.exponent).encode() + end

    def _text(self, rows: np.ndarray) -> str:
        """In the columns of the description: of uneven double precision the abscissa is in single."""
        if not self.double:
            flat = [f"{value:13.5E}" for value in rows.ravel()]
            return _lines(flat, 6)
        if self.even:
            return _lines([f"{value:20.12E}" for value in rows.ravel()], 4)
        per_line = 2 if self.real else 1
        cells = ["".join([f"{row[0]:13.5E}", *(f"{value:20.12E}" for value in row[1:])]) for row in rows]
        return _lines(cells, per_line)


def _lines(cells: Sequence[str], per_line: int) -> str:
    return "".join("".join(cells[i : i + per_line]) + "\n" for i in range(0, len(cells), per_line))


def _of_system(unit: Measured, system: tuple[float, float]) -> np.ndarray:
    """Numbers in the lengths and forces of data set 164: SI times its factors."""
    length, force = system
    si = replace(unit, factor=1.0, newtons=1.0).numbers
    return si * length / (force if unit.force else 1.0)


@dataclass(frozen=True)
class Text:
    """An export as text: the frequency, and one or two columns of the motion."""

    unit: Measured = UNITS[1]
    form: str = "complex"  # parts, phase, amplitude, cells
    heads: tuple[str, ...] = ()
    separator: str = ";"
    decimal: str = "."
    group: str = ""
    digits: int = 7
    encoding: str = "utf-8"
    quoted: bool = False
    above: str = ""
    units_below: bool = False
    exponent: str = ""
    ending: str = "\n"
    index: str = ""
    suffix: str = ".csv"
    whole: bool = False  # motions without decimals
    minutes: bool = False  # frequencies in 1/min, which have no leading zero

    @property
    def rounding(self) -> np.ndarray:
        """What the digits leave out of the motion, (17,) [m]."""
        return (
            0.0 * SPIN
            if self.exponent
            else 10.0 ** -(0 if self.whole else self.digits) * np.abs(MOTION / self.unit.numbers)
        )

    def motion(self, value: float) -> str:
        return self.number(value, 0 if self.whole else self.digits)

    def number(self, value: float, digits: int | None = None) -> str:
        if self.exponent:
            told = f"{value:.9e}".replace("e", self.exponent)
            return told.replace(".", self.decimal)
        told = f"{value:,.{self.digits if digits is None else digits}f}"
        whole, point, rest = told.partition(".")
        return whole.replace(",", self.group) + (self.decimal + rest if point else "")

    def columns(self) -> dict[str, list[str]]:
        """Quantity to cells."""
        numbers = self.unit.numbers
        made = {"frequency": [self.number(60.0 * f if self.minutes else f) for f in HERTZ]}
        if self.form == "parts":
            made |= {"real": [*map(self.motion, numbers.real)], "imag": [*map(self.motion, numbers.imag)]}
        elif self.form == "cells":
            made["amplitude"] = [
                f"{self.motion(z.real)}{'+' if z.imag >= 0 else ''}{self.motion(z.imag)}{self.index or 'i'}"
                for z in numbers
            ]
        else:
            made["amplitude"] = [*map(self.motion, np.abs(numbers))]
        if self.form == "phase":
            made["phase"] = [*map(self.number, np.degrees(np.angle(numbers)))]
        return made

    def headings(self) -> dict[str, str]:
        """Quantity to heading."""
        names = dict(zip(self.columns(), self.heads or self.columns(), strict=False))
        if self.units_below:
            return names
        units = {"frequency": "1/min" if self.minutes else "Hz", "phase": "deg"}
        return {key: f"{name} [{units.get(key, self.unit.label)}]" for key, name in names.items()}

    def written(self) -> bytes:
        columns = self.columns()
        lines = [[*self.headings().values()]]
        if self.units_below:
            units = {"frequency": "1/min" if self.minutes else "Hz", "phase": "deg"}
            lines.append([units.get(key, self.unit.label) for key in columns])
        lines += [list(row) for row in zip(*columns.values(), strict=True)]
        if self.quoted:
            lines = [[f'"{cell}"' for cell in row] for row in lines]
        text = self.above + "\n".join(self.separator.join(row) for row in lines) + "\n"
        return text.replace("\n", self.ending).encode(self.encoding)

    def choices(self) -> list[str]:
        """What the command is told of the columns; nothing where the headings say it."""
        if not self.heads:
            return []
        return [f"{heading}={quantity}" for quantity, heading in self.headings().items()]
