"""Universal files: functions of data set 58 (or 58b) over the frequency, as modal analysers write them."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np

from optim.errors import DataError
from optim.identification.data.table import Dimension, Table, unit_of
from optim.identification.readers.registry import DataFormat, read_head, table_of
from solver.errors import MissingExtraError

_FREQUENCY, _FORCE = 18, 13  # specific data types of an axis
_MOTIONS = {8: "m", 11: "m/s", 12: "m/s2"}
_COMPLEX = (5, 6)
_TITLES = ("id1", "id2", "id3", "id4", "id5")


def read_universal(path: Path, paths: frozenset[str]) -> list[Table]:
    """Read every function over the frequency of a file; conditions stand in its five title lines.

    Raises
    ------
    MissingExtraError
        pyuff is not installed.
    DataError
        No such function, or one of something else.
    """
    try:
        import pyuff
    except ImportError as error:
        raise MissingExtraError("pyuff", "uff") from error
    try:
        file = pyuff.UFF(str(path))
        found = [file.read_sets(int(i)) for i, kind in enumerate(file.get_set_types()) if int(kind) == 58]
    except Exception as error:
        raise DataError(path.name, str(error), "must be a universal file") from error
    tables = [_table(path, number, one, paths) for number, one in enumerate(found, start=1)]
    if not tables:
        raise DataError(path.name, "none", "must have a function of data set 58")
    return tables


def _table(path: Path, number: int, one: Mapping[str, Any], paths: frozenset[str]) -> Table:
    source = f"{path.name}, function {number}"
    if one.get("abscissa_spec_data_type") != _FREQUENCY:
        raise DataError(source, one.get("abscissa_spec_data_type"), "must be over the frequency, type 18")
    kind = one.get("ordinate_spec_data_type")
    if kind not in _MOTIONS:
        wanted = "must be a displacement (8), velocity (11) or acceleration (12)"
        raise DataError(source, kind, wanted)
    unit = _unit(source, one, _MOTIONS[kind])
    head = read_head(source, {i: str(one.get(key, "")) for i, key in enumerate(_TITLES, start=1)}, paths)
    data = np.asarray(one["data"])
    heads, columns = ["frequency"], [np.asarray(one["x"], dtype=np.float64)]
    if one.get("ord_data_type") in _COMPLEX:
        heads += [f"real [{unit}]", f"imag [{unit}]"]
        columns += [data.real.astype(np.float64), data.imag.astype(np.float64)]
    else:
        heads.append(f"amplitude [{unit}]")
        columns.append(data.real.astype(np.float64))
    return table_of(source, heads, columns, head, paths)


def _unit(source: str, one: Mapping[str, Any], plain: str) -> str:
    """Return the unit: of the label if that is one we know, else SI; per newton over a force."""
    label = str(one.get("ordinate_axis_units_lab", "")).strip()
    label = label.split("/N")[0].replace("s^2", "s2").replace("s²", "s2")
    if label in ("", "NONE"):
        label = plain
    if unit_of(Dimension.MOTION, label) is None:
        raise DataError(
            source, label, "must have a unit of a motion, such as m, mm/s or m/s2", column="ordinate"
        )
    return label + ("/N" if one.get("orddenom_spec_data_type") == _FORCE else "")


FORMAT = DataFormat(
    name="Universal file",
    suffixes=(".uff", ".unv", ".uf", ".58"),
    help="Functions of data set 58 or 58b over the frequency, also per newton; conditions in title lines; "
    "needs the extra `uff` (pyuff).",
    read=read_universal,
)
