"""Tables of any kind as columns, as CSV text and back.

The C++ readers know what the columns of a table mean, and say what is wrong with one. A table in memory is therefore
written as CSV text, every number with the digits that give the same number again, and read by them.
"""

from __future__ import annotations

import csv
import io
import math
import os
from collections.abc import Iterable, Mapping
from typing import Any

import numpy as np

Source = tuple[str, "str | None"]


def columns_of(table: Any, what: str) -> dict[str, list[Any]]:
    """The columns of a pandas or polars DataFrame, a pyarrow Table, whatever offers ``__arrow_c_stream__`` where
    pyarrow is there, a mapping of columns, a structured array or a list of mappings.

    Raises TypeError for other things and for names that are no words, ValueError for columns of unequal length, names
    that are there twice and no rows. ``what`` names the argument.
    """
    pairs = list(_pairs_of(table, what))
    columns: dict[str, list[Any]] = {}
    for name, values in pairs:
        if not isinstance(name, str):
            raise TypeError(f"{what}: a column is called {name!r}; a name is a word with its unit, as q1_deg or x_mm")
        if name in columns:
            raise ValueError(f"{what}: column {name!r} is there twice")
        columns[name] = values
    if not columns:
        raise ValueError(f"{what}: no columns")
    rows = len(next(iter(columns.values())))
    for name, values in columns.items():
        if len(values) != rows:
            raise ValueError(f"{what}: column {name!r} has {len(values)} rows, the first column has {rows}")
    if rows == 0:
        raise ValueError(f"{what}: no rows")
    return columns


def _pairs_of(table: Any, what: str) -> Iterable[tuple[Any, list[Any]]]:
    if isinstance(table, Mapping):
        return [(name, _values_of(values, what, name)) for name, values in table.items()]
    if hasattr(table, "iloc") and hasattr(table, "columns"):  # pandas: a name may be there twice
        return [(name, table.iloc[:, k].tolist()) for k, name in enumerate(table.columns)]
    if hasattr(table, "get_columns"):  # polars
        return [(column.name, column.to_list()) for column in table.get_columns()]
    if hasattr(table, "__arrow_c_stream__"):
        if not hasattr(table, "column_names"):
            import pyarrow

            table = pyarrow.table(table)
        return [(name, table.column(k).to_pylist()) for k, name in enumerate(table.column_names)]
    if isinstance(table, np.ndarray) and table.dtype.names:
        return [(name, table[name].tolist()) for name in table.dtype.names]
    if isinstance(table, (list, tuple)) and table and all(isinstance(row, Mapping) for row in table):
        names = dict.fromkeys(name for row in table for name in row)
        return [(name, [row.get(name) for row in table]) for name in names]
    raise TypeError(
        f"{what}: {type(table).__name__} has no columns with names; give a path, a DataFrame or a dict of columns"
    )


def _values_of(values: Any, what: str, name: Any) -> list[Any]:
    if isinstance(values, (str, bytes)):
        raise TypeError(f"{what}: column {name!r} is a text and no list of values")
    if hasattr(values, "to_list"):
        return list(values.to_list())
    if hasattr(values, "to_pylist"):
        return list(values.to_pylist())
    array = np.asarray(values) if not isinstance(values, (list, tuple)) else values
    if isinstance(array, np.ndarray):
        if array.ndim > 1:
            raise TypeError(f"{what}: column {name!r} has {array.ndim} dimensions")
        return array.reshape(-1).tolist()
    return list(array)


def _cell(value: Any, what: str, name: str) -> str:
    if isinstance(value, str):
        if "\n" in value or "\r" in value:
            raise ValueError(f"{what}: column {name!r}: a cell has a line break")
        return '"' + value.replace('"', '""') + '"' if any(c in value for c in ',;\t"') else value
    if value is None:
        return ""
    if isinstance(value, (bool, np.bool_)):
        return str(int(value))
    try:
        number = float(value)
    except (TypeError, ValueError):  # pandas.NA raises TypeError, too
        return "" if type(value).__name__ in ("NAType", "NaTType") else _cell(str(value), what, name)
    return "" if math.isnan(number) else repr(number)


def csv_text(table: Any, what: str) -> str:
    """The table as CSV text; numbers read back exactly, and a cell that is None or NaN is empty."""
    columns = columns_of(table, what)
    cells = [[_cell(value, what, name) for value in values] for name, values in columns.items()]
    if len(cells) == 1:  # a blank line is no row
        cells = [[cell or '""' for cell in cells[0]]]
    header = ",".join(_cell(name, what, name) for name in columns)
    return "\n".join([header, *(",".join(row) for row in zip(*cells, strict=True))]) + "\n"


def source_of(table: Any, what: str) -> Source:
    """A path by its name, and anything else as text under the name of the argument."""
    if isinstance(table, (str, os.PathLike)):
        return os.fspath(table), None
    return f"<{what}>", csv_text(table, what)


def _numbers(cells: list[str]) -> list[Any]:
    try:
        return [float(cell) if cell else math.nan for cell in cells]
    except ValueError:
        return list(cells)


def frame_of(text: str) -> Any:
    """CSV text as a pandas DataFrame where pandas is there, else as a dict of arrays."""
    header, *rows = csv.reader(io.StringIO(text))
    columns = {name: np.asarray(_numbers([row[k] for row in rows])) for k, name in enumerate(header)}
    return _frame(columns)


def records(rows: list[dict[str, Any]]) -> Any:
    """Rows as a pandas DataFrame where pandas is there, else as they are."""
    try:
        import pandas
    except ImportError:
        return rows
    return pandas.DataFrame(rows)


def _frame(columns: dict[str, Any]) -> Any:
    try:
        import pandas
    except ImportError:
        return columns
    return pandas.DataFrame(columns)
