"""Parquet: columns as in CSV; conditions in columns, or in the metadata of the file."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from optim.identification.data.measured_table import Table
from optim.identification.readers.data_readers import DataFormat, numbers_of, read_head, table_of
from optim.problem.checks import DataError
from solver.errors import MissingExtraError


def read_parquet(path: Path, paths: frozenset[str]) -> list[Table]:
    """Read a file.

    Raises
    ------
    MissingExtraError
        pyarrow is not installed.
    DataError
        What is wrong, with its row.
    """
    try:
        import pyarrow as pa
        import pyarrow.parquet as pq
    except ImportError as error:
        raise MissingExtraError("pyarrow", "parquet") from error
    try:
        found = pq.read_table(path)
    except (OSError, pa.ArrowException) as error:
        raise DataError(path.name, str(error), "must be a Parquet file") from error
    metadata = found.schema.metadata or {}
    told = {
        number: f"{key.decode('utf-8', 'replace')} = {value.decode('utf-8', 'replace')}"
        for number, (key, value) in enumerate(metadata.items(), start=1)
        if len(value) <= 200
    }
    head = read_head(path.name, told, paths)
    columns = [
        np.asarray(numbers_of(path.name, name, found.column(name).to_pylist()), np.float64)
        for name in found.column_names
    ]
    return [table_of(path.name, found.column_names, columns, head, paths)]


FORMAT = DataFormat(
    name="Parquet",
    suffixes=(".parquet",),
    help="Columns named as in CSV; conditions in columns, or in the metadata of the file; needs pyarrow.",
    read=read_parquet,
)
