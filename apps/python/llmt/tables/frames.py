"""Frames and series of pandas 2 and 3, which is imported already where there is one."""

from __future__ import annotations

import datetime
import sys
from typing import Any

import numpy as np

from .._core import date_texts, read_arrow
from .arrays import read_objects
from .raw import Column, Raw, place, refuse_type


def from_frame(frame: Any) -> Raw:
    """Reads a frame, column by column into one matrix; one of float64 alone is not copied where pandas has it so."""
    labels = list(frame.columns)
    if len(labels) > 0 and all(dtype == np.float64 for dtype in frame.dtypes):
        values = frame.to_numpy()
        return Raw(values, [Column() for _ in labels], labels)
    values = np.empty(frame.shape, order="F")
    columns = [_read(frame.iloc[:, j], values[:, j], place(label)) for j, label in enumerate(labels)]
    return Raw(values, columns, labels, owned=True)


def from_series(series: Any, name: str) -> Raw:
    """Reads a series."""
    values = np.empty((len(series), 1), order="F")
    column = _read(series, values[:, 0], name)
    return Raw(values, [column], [series.name], 1, series=True, owned=True)


def _read(series: Any, out: np.ndarray, where: str) -> Column:
    pandas = sys.modules["pandas"]
    dtype = series.dtype
    if isinstance(dtype, np.dtype):
        if dtype.kind in "biuf":
            out[:] = series.to_numpy()
            return Column()
        if dtype.kind == "O":
            cells = series.to_numpy()
            moments = _moments(cells)
            return read_objects(cells, out, where) if moments is None else _read_dates(moments, out, "object")
        if dtype.kind == "M":
            return _read_dates(series.to_numpy(), out, str(dtype))
        what = {"m": "durations", "c": "complex numbers", "S": "bytes"}.get(dtype.kind, "values")
        refuse_type(where, what, dtype)
    if isinstance(dtype, pandas.CategoricalDtype):
        return _read_categories(series.cat, out, where)
    if isinstance(dtype, pandas.StringDtype):
        codes, words = series.factorize()
        out[:] = codes
        out[codes < 0] = np.nan
        return Column([str(word) for word in words])
    if isinstance(dtype, pandas.ArrowDtype):
        read: Any = read_arrow(series.array.__arrow_array__().__arrow_c_stream__(), name=where)
        values, columns, is_table = read
        if is_table:
            refuse_type(where, "structs", dtype)
        out[:] = values[:, 0]
        kind = columns[0][1]
        return Column(columns[0][2], kind == "codes", str(dtype) if kind == "dates" else "")
    if isinstance(dtype, pandas.DatetimeTZDtype):
        return _read_dates(series.dt.tz_convert("UTC").dt.tz_localize(None).to_numpy(), out, str(dtype))
    for kind, what in (
        (pandas.PeriodDtype, "periods"),
        (pandas.IntervalDtype, "intervals"),
        (pandas.SparseDtype, "sparse numbers"),
    ):
        if isinstance(dtype, kind):
            refuse_type(where, what, dtype)
    if pandas.api.types.is_numeric_dtype(dtype):
        out[:] = series.to_numpy(dtype=np.float64, na_value=np.nan)
        return Column()
    return read_objects(series.to_numpy(dtype=object), out, where)


def _read_categories(categories: Any, out: np.ndarray, where: str) -> Column:
    """Labels are read as a column by themselves."""
    labels = np.empty(len(categories.categories) + 1)
    labels[-1] = np.nan
    column = _read(categories.categories.to_series(), labels[:-1], where)
    out[:] = labels[categories.codes.to_numpy()]  # -1, missing, is the last
    return Column(column.words, column.words is None, column.dates)


_PER_SECOND = {"s": 1, "ms": 1000, "us": 1_000_000, "ns": 1_000_000_000}


def _read_dates(cells: np.ndarray, out: np.ndarray, dtype: str) -> Column:
    """Reads datetime64 as its texts, `2024-02-29` or `2024-02-29 12:00:00`."""
    missing = np.isnat(cells)
    counts, index = np.unique(cells[~missing].view(np.int64), return_inverse=True)
    out[missing] = np.nan
    out[~missing] = index
    return Column(date_texts(counts.tolist(), 86400 * _PER_SECOND[np.datetime_data(cells.dtype)[0]]), dates=dtype)


def _moments(cells: np.ndarray) -> np.ndarray | None:
    """The dates and moments of a column of Python's objects as datetime64, in UTC where they have a zone; None where
    other things are among them, or nothing else but missing cells."""
    kinds = set(map(type, cells))
    blanks = {kind for kind in kinds if kind is type(None) or kind.__name__ in ("NAType", "NaTType")}
    dates = [kind for kind in kinds - blanks if issubclass(kind, (datetime.date, np.datetime64))]
    if not dates or len(dates) < len(kinds - blanks):
        return None
    naive = [np.datetime64("NaT") if type(cell) in blanks else _without_zone(cell) for cell in cells]
    return np.array(naive, dtype="datetime64[us]")


def _without_zone(cell: Any) -> Any:
    if getattr(cell, "tzinfo", None) is None:
        return cell
    return cell.astimezone(datetime.timezone.utc).replace(tzinfo=None)
