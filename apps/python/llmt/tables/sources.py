"""Where tables come from."""

from __future__ import annotations

import sys
from typing import Any

import numpy as np

from .._core import read_arrow
from .arrays import from_array, from_sequence
from .frames import from_frame, from_series
from .raw import Column, Raw


def read_raw(table: Any, name: str) -> Raw:
    """Reads a table or a column, which is called ``name``. Libraries are recognised where they are imported already."""
    if _is_of(table, "scipy.sparse", "issparse"):
        raise TypeError(
            f"Sparse data was passed for {name}, but dense data is required. Use '.toarray()' to convert to a dense "
            "numpy array."
        )
    if isinstance(table, np.ndarray):
        return from_array(table, name)
    pandas = sys.modules.get("pandas")
    if pandas is not None and isinstance(table, getattr(pandas, "DataFrame", ())):
        return from_frame(table)
    if pandas is not None and isinstance(table, getattr(pandas, "Series", ())):
        return from_series(table, name)
    polars = sys.modules.get("polars")
    if polars is not None and isinstance(table, getattr(polars, "LazyFrame", ())):
        raise TypeError(f"{name} is a LazyFrame, which has no values yet: collect() it first")
    if hasattr(table, "__arrow_c_stream__") or hasattr(table, "__arrow_c_array__"):
        return from_arrow(table, name)
    if hasattr(table, "collect") and not hasattr(table, "__array__"):
        raise TypeError(f"{name} is a {type(table).__qualname__}, which has no values yet: collect() it first")
    if isinstance(table, dict):
        raise TypeError(f"{name} is a dict: make a table of it first, such as pandas.DataFrame({name})")
    return from_sequence(table, name)


def from_arrow(table: Any, name: str) -> Raw:
    """Reads what speaks the Arrow C data interface: polars, pyarrow, DuckDB and others."""
    if hasattr(table, "__arrow_c_stream__"):
        capsules = (table.__arrow_c_stream__(),)
    else:
        capsules = table.__arrow_c_array__()
    read: Any = read_arrow(*capsules, name=name)
    values, columns, is_table = read
    found = [Column(words, kind == "codes", "Arrow" if kind == "dates" else "") for _, kind, words in columns]
    labels = [label for label, _, _ in columns]
    return Raw(values, found, labels, 2 if is_table else 1, series=not is_table, owned=True)


def _is_of(thing: Any, module: str, test: str) -> bool:
    loaded = sys.modules.get(module)
    return loaded is not None and bool(getattr(loaded, test)(thing))
