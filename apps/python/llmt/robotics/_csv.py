"""Tables of any kind as CSV text and back.

The C++ readers know what the columns of a table mean, and say what is wrong with one. A table in memory is therefore
written as CSV text, every number with the digits that give the same number again, and read by them.
"""

from __future__ import annotations

import csv
import errno
import io
import math
import os
from typing import Any

import numpy as np

from llmt.tables.named import columns_of

Source = tuple[str, "str | None"]


def _cell(cell: float | str, what: str, name: str) -> str:
    if not isinstance(cell, str):
        return "" if math.isnan(cell) else repr(cell)
    if "\n" in cell or "\r" in cell:
        raise ValueError(f"{what}: column {name!r}: a cell has a line break")
    return '"' + cell.replace('"', '""') + '"' if any(c in cell for c in ',;\t"') else cell


def csv_text(table: Any, what: str) -> str:
    """The table as CSV text; numbers read back exactly, and a cell that is missing is empty."""
    columns = columns_of(table, what)
    cells = [
        [_cell(cell, what, name) for cell in (column if isinstance(column, list) else column.tolist())]
        for name, column in columns.items()
    ]
    if len(cells) == 1:  # a blank line is no row
        cells = [[cell or '""' for cell in cells[0]]]
    header = ",".join(_cell(name, what, name) for name in columns)
    return "\n".join([header, *(",".join(row) for row in zip(*cells, strict=True))]) + "\n"


def source_of(table: Any, what: str) -> Source:
    """A path by its name, and anything else as text under the name of the argument."""
    if isinstance(table, (str, os.PathLike)):
        if not os.path.exists(table):
            raise FileNotFoundError(errno.ENOENT, os.strerror(errno.ENOENT), os.fspath(table))
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
    try:
        import pandas
    except ImportError:
        return columns
    return pandas.DataFrame(columns)
