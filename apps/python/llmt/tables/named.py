"""Tables whose columns have names, column by column: numbers or texts."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from typing import Any

import numpy as np

from .raw import Raw, refuse_surrogates
from .sources import read_raw

Cells = np.ndarray | list[float | str]
"""float64 with NaN for what is missing; or texts, "" for what is missing, and numbers where both are mixed."""


def columns_of(table: Any, what: str) -> dict[str, Cells]:
    """The columns of a table: of all that ``read_table()`` reads and that has names, a mapping of columns, a structured
    array or a list of mappings. A column is numbers where ``read_table()`` has it so; any other cell is its text.

    Raises TypeError for other things and for names that are no words, ValueError for columns of unequal length, names
    that are there twice, text that is no Unicode and no rows. ``what`` names the argument.
    """
    columns: dict[str, Cells] = {}
    for name, cells in _pairs_of(table, what):
        if not isinstance(name, str):
            raise TypeError(f"{what}: a column is called {name!r}; a name is a word with its unit, as q1_deg or x_mm")
        refuse_surrogates(name, f"{what}: the name of column {name!r}")
        if name in columns:
            raise ValueError(f"{what}: column {name!r} is there twice")
        for cell in {cell for cell in cells if isinstance(cell, str)} if isinstance(cells, list) else ():
            refuse_surrogates(cell, f"{what}: {cell!r} in column {name!r}")
        columns[name] = cells
    if not columns:
        raise ValueError(f"{what}: no columns")
    rows = len(next(iter(columns.values())))
    for name, cells in columns.items():
        if len(cells) != rows:
            raise ValueError(f"{what}: column {name!r} has {len(cells)} rows, the first column has {rows}")
    if rows == 0:
        raise ValueError(f"{what}: no rows")
    return columns


def _pairs_of(table: Any, what: str) -> Iterable[tuple[Any, Cells]]:
    pairs: Iterable[tuple[Any, Any]]
    if isinstance(table, Mapping):
        pairs = table.items()
    elif hasattr(table, "iloc") and hasattr(table, "columns"):  # pandas: a name may be there twice
        pairs = ((name, table.iloc[:, k]) for k, name in enumerate(table.columns))
    elif hasattr(table, "get_columns"):  # polars
        pairs = ((column.name, column) for column in table.get_columns())
    elif hasattr(table, "column_names") and hasattr(table, "column"):  # pyarrow
        pairs = ((name, table.column(k)) for k, name in enumerate(table.column_names))
    elif hasattr(table, "__arrow_c_stream__"):
        raw = read_raw(table, what)
        pairs = ((name, _cells_of(raw, k)) for k, name in enumerate(raw.labels or [])) if raw.dimensions == 2 else ()
    elif isinstance(table, np.ndarray) and table.dtype.names:
        pairs = ((name, table[name]) for name in table.dtype.names)
    elif isinstance(table, (list, tuple)) and table and all(isinstance(row, Mapping) for row in table):
        names = dict.fromkeys(name for row in table for name in row)
        pairs = ((name, [row.get(name) for row in table]) for name in names)
    else:
        raise TypeError(
            f"{what}: {type(table).__name__} has no columns with names; give a path, a DataFrame or a dict of columns"
        )
    return ((name, _read(cells, what, name)) for name, cells in pairs)


def _read(cells: Any, what: str, name: Any) -> Cells:
    if isinstance(cells, (str, bytes)):
        raise TypeError(f"{what}: column {name!r} is a text and no list of values")
    if len(cells) == 0:
        return []
    try:
        raw = read_raw(cells, f"{what}: column {name!r}")
    except TypeError:  # dates, or words among numbers, say; whoever needs numbers names the first cell that is none
        return [_number_or_text(cell) for cell in (cells.to_pylist() if hasattr(cells, "to_pylist") else cells)]
    if raw.dimensions != 1:
        raise TypeError(f"{what}: column {name!r} has {raw.dimensions} dimensions")
    return _cells_of(raw, 0)


def _cells_of(raw: Raw, column: int) -> Cells:
    values, words = raw.values[:, column], raw.columns[column].words
    return values if words is None else ["" if np.isnan(k) else words[int(k)] for k in values]


def _number_or_text(cell: Any) -> float | str:
    if cell is None or type(cell).__name__ in ("NAType", "NaTType"):
        return ""
    return float(cell) if isinstance(cell, (int, float, np.number, np.bool_)) else str(cell)
