"""Files as finite-element programs lay them out, written after their documentation, for the tests."""

import struct
from typing import Any

import numpy as np

Array = np.ndarray


def hbmat(A: Array) -> str:
    """A symmetric matrix as HBMAT of Ansys writes it: one number a line, (I14) and (d25.15), no line 5."""
    n = A.shape[0]
    lower = [(i, j) for j in range(n) for i in range(j, n) if A[i, j] != 0.0]
    pointers = [1 + sum(j < column for _, j in lower) for column in range(n + 1)]
    counts = (len(pointers), len(lower), len(lower))
    lines = [
        "Stiffness matrix from ANSYS FULL file dumped into Harwell-Boeing format".ljust(80),
        "".join(f"{count:14d}" for count in (sum(counts), *counts, 0)),
        "RSA".ljust(14) + "".join(f"{count:14d}" for count in (n, n, len(lower), 0)),
        "(I14)".ljust(16) + "(I14)".ljust(16) + "(d25.15)".ljust(20) + "(d25.15)".ljust(20),
    ]
    lines += [f"{p:14d}" for p in pointers] + [f"{i + 1:14d}" for i, _ in lower]
    return "\n".join([*lines, *(d25_15(A[i, j]) for i, j in lower)]) + "\n"


def d25_15(value: float) -> str:
    """A number in the Fortran format D25.15: the mantissa begins with 0."""
    if value == 0.0:
        return "0.000000000000000D+00".rjust(25)
    mantissa, exponent = f"{abs(value):.14E}".split("E")
    digits = mantissa.replace(".", "")
    return f"{'-' if value < 0 else ''}0.{digits}D{int(exponent) + 1:+03d}".rjust(25)


def ansys_mapping(labels: list[tuple[int, str]]) -> str:
    """The file name.mapping that HBMAT writes."""
    lines = ["    Matrix Eqn          Node    DOF     "]
    lines += [f"{row:14d}{node:14d}{dof:>8}" for row, (node, dof) in enumerate(labels, start=1)]
    return "\n".join(lines) + "\n"


def abaqus_input(A: Array, labels: list[tuple[int, int]], *, full: bool = False) -> str:
    """*MATRIX OUTPUT, FORMAT=MATRIX INPUT: node, DOF, node, DOF, value; one triangle, or all."""
    lines = []
    for i, row in enumerate(labels):
        for j, column in enumerate(labels):
            if A[i, j] != 0.0 and (full or j <= i):
                lines.append(f"{row[0]},{row[1]}, {column[0]},{column[1]},  {A[i, j]:.15e}")
    return "\n".join(lines) + "\n"


def coordinate(A: Array) -> str:
    """*MATRIX OUTPUT, FORMAT=COORDINATE of Abaqus, and .sti and .mas of CalculiX: row, column, value."""
    n = A.shape[0]
    entries = [(i, j) for j in range(n) for i in range(j + 1) if A[i, j] != 0.0]
    return "".join(f"{i + 1} {j + 1} {A[i, j]:20.13e}\n" for i, j in entries)


def dmig(name: str, A: Array, labels: list[tuple[int, int]], *, large: bool = True) -> str:
    """A symmetric matrix as DMIG entries, as a punch file has them (large fields) or by hand (small)."""
    lines = [f"DMIG    {name:<8}{0:>8}{6:>8}{2:>8}{0:>8}"]
    for j, (node, dof) in enumerate(labels):
        rows = [i for i in range(j, len(labels)) if A[i, j] != 0.0]
        if large:
            lines.append(f"DMIG*   {name:<16}{node:>16}{dof:>16}")
            lines += [f"*       {labels[i][0]:>16}{labels[i][1]:>16}{A[i, j]:>16.9E}" for i in rows]
            continue
        line = f"DMIG    {name:<8}{node:>8}{dof:>8}{'':8}"
        for at, i in enumerate(rows):
            line += f"{labels[i][0]:>8}{labels[i][1]:>8}{small(A[i, j]):>8}{'':8}"
            if at % 2 == 0:
                lines.append(line)
                line = "+".ljust(8)
        lines += [line] if line.strip() != "+" else []
    return "\n".join(lines) + "\n"


def small(value: float) -> str:
    """A number in 8 characters, as Nastran writes it: 1.5+3."""
    mantissa, exponent = f"{value:.3e}".split("e")
    return f"{mantissa}{int(exponent):+d}" if int(exponent) else mantissa


def strings(column: Array) -> list[tuple[int, Array]]:
    """The runs of entries that are not zero: first row (from 0) and values."""
    rows = np.flatnonzero(column)
    runs = np.split(rows, np.flatnonzero(np.diff(rows) > 1) + 1) if rows.size else []
    return [(int(run[0]), column[run]) for run in runs]


def op4_text(
    matrices: dict[str, Array], *, sparse: bool = False, bigmat: bool = False, double: bool = True
) -> str:
    """OUTPUT4 as text: dense columns, or strings, with both or one number before them."""
    per, lines = 2 if double else 1, []
    for name, A in matrices.items():
        rows, columns = A.shape
        heading = f"{columns:8d}{-rows if bigmat else rows:8d}{6 if rows == columns else 2:8d}{per:8d}"
        lines.append(f"{heading}{name:<8}1P,3E23.16")
        for j in range(columns):
            runs = strings(A[:, j])
            if not runs:
                continue
            if not sparse:
                first, last = runs[0][0], runs[-1][0] + runs[-1][1].size
                runs = [(first, A[first:last, j])]
                lines.append(f"{j + 1:8d}{first + 1:8d}{per * (last - first):8d}")
            else:
                head = 2 if bigmat else 1
                lines.append(f"{j + 1:8d}{0:8d}{sum(per * v.size + head for _, v in runs):8d}")
            for first, values in runs:
                length = per * values.size + 1
                if sparse:
                    lines.append(
                        f"{length:8d}{first + 1:8d}" if bigmat else f"{65536 * length + first + 1:12d}"
                    )
                lines += [
                    "".join(f"{v:23.16E}" for v in values[at : at + 3]) for at in range(0, values.size, 3)
                ]
        lines += [f"{columns + 1:8d}{1:8d}{1:8d}", f"{1.0:23.16E}"]
    return "\n".join(lines) + "\n"


def op4_binary(
    matrices: dict[str, Array], *, order: str = "<", sparse: bool = False, bigmat: bool = False,
    double: bool = True, word: int = 4,
) -> bytes:  # fmt: skip
    """OUTPUT4 as Fortran's unformatted records, in either byte order, with words of 4 or 8 bytes."""
    integer = "i" if word == 4 else "q"
    real = "d" if double or word == 8 else "f"
    per = 8 // word if double else 1
    out = b""

    def record(*parts: bytes) -> bytes:
        content = b"".join(parts)
        mark = struct.pack(f"{order}i", len(content))
        return mark + content + mark

    def integers(*values: int) -> bytes:
        return struct.pack(f"{order}{len(values)}{integer}", *values)

    def reals(values: Any) -> bytes:
        return struct.pack(f"{order}{len(values)}{real}", *values)

    for name, A in matrices.items():
        rows, columns = A.shape
        form = 6 if rows == columns else 2
        heading = integers(columns, -rows if bigmat else rows, form, 2 if double else 1)
        out += record(heading, name.ljust(2 * word).encode())
        for j in range(columns):
            runs = strings(A[:, j])
            if not runs:
                continue
            if not sparse:
                first, last = runs[0][0], runs[-1][0] + runs[-1][1].size
                out += record(integers(j + 1, first + 1, per * (last - first)), reals(A[first:last, j]))
                continue
            parts = []
            for first, values in runs:
                length = per * values.size + 1
                head = (length, first + 1) if bigmat else (65536 * length + first + 1,)
                parts += [integers(*head), reals(values)]
            words = sum(per * v.size + (2 if bigmat else 1) for _, v in runs)
            out += record(integers(j + 1, 0, words), *parts)
        out += record(integers(columns + 1, 1, 1), reals([1.0]))
    return out
