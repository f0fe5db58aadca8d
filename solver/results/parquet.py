"""Tables as Parquet, with units and attributes in the metadata."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import numpy as np

from solver.errors import MissingExtraError
from solver.results.dataset import ROW, Dataset, Variable

_KEY = b"stickslip"


def write(data: Dataset, path: Path) -> None:
    """Write the table of a dataset; MissingExtraError without pyarrow."""
    pa, pq = _pyarrow()
    columns = data.table().variables
    fields = [pa.field(name, _type(pa, v), metadata=v.attributes or None) for name, v in columns.items()]
    about = json.dumps({"kind": data.kind, "attributes": dict(data.attributes)})
    schema = pa.schema(fields, metadata={_KEY: about.encode()})
    pq.write_table(pa.table([pa.array(v.values) for v in columns.values()], schema=schema), path)


def read(path: Path) -> Dataset:
    """Read a table that `write` wrote, or any other.

    Raises
    ------
    OSError, ValueError
        Not a Parquet file.
    MissingExtraError
        pyarrow is not installed.
    """
    _, pq = _pyarrow()
    table = pq.read_table(path)
    about = json.loads((table.schema.metadata or {}).get(_KEY, b"{}"))
    variables = {}
    for field, column in zip(table.schema, table.columns, strict=True):
        notes = {key.decode(): text.decode() for key, text in (field.metadata or {}).items()}
        values = column.to_numpy()
        variables[field.name] = Variable(
            dims=(ROW,), values=values.astype(np.str_) if values.dtype.kind == "O" else values,
            unit=notes.get("units", ""), about=notes.get("long_name", ""),
        )  # fmt: skip
    return Dataset(
        kind=about.get("kind", "table"), rows=(ROW,), variables=variables,
        attributes=about.get("attributes", {}),
    )  # fmt: skip


def _type(pa: Any, variable: Variable) -> Any:
    kind = variable.values.dtype
    return pa.string() if kind.kind == "U" else pa.from_numpy_dtype(kind)


def _pyarrow() -> tuple[Any, Any]:
    try:
        import pyarrow as pa
        import pyarrow.parquet as pq
    except ImportError as error:
        raise MissingExtraError("pyarrow", "parquet") from error
    return pa, pq
