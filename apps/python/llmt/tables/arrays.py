"""Arrays of NumPy, lists, and columns of Python's objects."""

from __future__ import annotations

import datetime
import numbers
from decimal import Decimal
from typing import Any, NoReturn

import numpy as np

from .raw import Column, Raw, place, refuse_type

_RESHAPE = (
    "Reshape your data either using array.reshape(-1, 1) if your data has a single feature or array.reshape(1, -1) "
    "if it contains a single sample."
)


def from_sequence(table: Any, name: str) -> Raw:
    """Reads lists of lists and objects that turn themselves into arrays."""
    try:
        array = np.asarray(table)
        if array.dtype.kind in "USO" and not hasattr(table, "__array__"):
            array = np.array(table, dtype=object)  # NumPy makes texts of all cells if one is
    except ValueError as error:
        if "inhomogeneous" in str(error):
            raise ValueError(f"{name} is no table: its rows have different lengths") from None
        raise
    if array.ndim == 0 and array.dtype.kind == "O":
        raise TypeError(f"{name} must be a table, such as an array or a DataFrame, not {type(table).__qualname__!r}")
    return from_array(array, name)


def from_array(array: np.ndarray, name: str) -> Raw:
    """Reads an array of any type; one of float64 is not copied."""
    if array.ndim == 0:
        raise ValueError(f"Expected 2D array, got scalar array instead:\narray={array}.\n{_RESHAPE}")
    if array.ndim > 2:
        raise ValueError(f"Found array with dim {array.ndim}, while dim <= 2 is required by {name}.")
    mask = np.ma.getmask(array)
    dimensions = array.ndim
    array = np.asarray(array)
    table = array if dimensions == 2 else array.reshape(-1, 1)
    columns = [Column() for _ in range(table.shape[1])]
    kind = table.dtype.kind
    if kind in "biuf":
        with np.errstate(over="ignore"):  # of long doubles; infinity is refused later
            values = np.require(table, np.float64, "A")
        if any(stride % values.itemsize for stride in values.strides):  # a field of records
            values = values.copy()
    elif kind in "OUT":
        values = np.empty(table.shape, order="F")
        cells = table.astype(object) if kind != "O" else table
        for j in range(table.shape[1]):
            where = place(j) if dimensions == 2 else name
            columns[j] = read_objects(cells[:, j], values[:, j], where)
    elif kind == "c":
        raise ValueError(f"Complex data not supported\n{table}\n")
    elif table.dtype.names is not None:
        raise TypeError(
            f"{name} is an array of records ({', '.join(table.dtype.names)}): make a table of it first, such as "
            f"pandas.DataFrame({name})"
        )
    else:
        what = {"M": "dates", "m": "durations", "S": "bytes"}.get(kind, "values")
        refuse_type(place(0) if dimensions == 2 else name, what, table.dtype)
    owned = not np.shares_memory(values, array) if values.size else True
    if mask is not np.ma.nomask and mask.any():
        values = values if owned else np.array(values, order="F")
        values[mask.reshape(values.shape)] = np.nan
        owned = True
    return Raw(values, columns, None, dimensions, owned=owned)


def read_objects(cells: np.ndarray, out: np.ndarray, where: str) -> Column:
    """Reads a column of Python's objects, numbers or words, into ``out``.

    Raises TypeError for a mix of both and for other objects, naming the row.
    """
    types = set(map(type, cells))
    blanks = {kind for kind in types if kind is type(None) or kind.__name__ in ("NAType", "NaTType")}
    if all(issubclass(kind, (numbers.Real, Decimal, np.bool_)) for kind in types - blanks):
        _read_numbers(cells, blanks, out, where)
        return Column()
    positions: dict[str, int] = {}
    first_word: int | None = None
    first_number: int | None = None
    for row, cell in enumerate(cells):
        if isinstance(cell, str):
            out[row] = positions.setdefault(cell, len(positions))
            first_word = row if first_word is None else first_word
        elif type(cell) in blanks or (isinstance(cell, (float, np.floating, Decimal)) and cell != cell):
            out[row] = np.nan
        elif isinstance(cell, (numbers.Real, Decimal, np.bool_)):
            first_number = row if first_number is None else first_number
        else:
            _refuse_object(cell, f"{where}, row {row}")
        if first_word is not None and first_number is not None:
            raise TypeError(
                f"{where} mixes words and numbers: {str(cells[first_word])!r} in row {first_word}, "
                f"{cells[first_number]} in row {first_number}; convert all to text, or the words to numbers or None"
            )
    return Column([str(word) for word in positions])


def _read_numbers(cells: np.ndarray, blanks: set[type], out: np.ndarray, where: str) -> None:
    try:
        if blanks - {type(None)}:
            cells = np.array([None if type(cell) in blanks else cell for cell in cells], dtype=object)
        out[:] = cells.astype(np.float64)
        return
    except (OverflowError, ValueError, TypeError):  # a number beyond float64, a signalling NaN
        pass
    for row, cell in enumerate(cells):
        try:
            out[row] = np.nan if cell is None else float(cell)
        except OverflowError:
            out[row] = np.inf if cell > 0 else -np.inf
        except (ValueError, TypeError):
            raise TypeError(f"{where}, row {row}: {cell!r} is no number") from None


def _refuse_object(cell: Any, where: str) -> NoReturn:
    if isinstance(cell, numbers.Complex):
        raise ValueError(f"Complex data not supported\n{cell} in {where}\n")
    for types, what in (
        ((datetime.date, np.datetime64), "dates"),
        ((datetime.time,), "times"),
        ((datetime.timedelta, np.timedelta64), "durations"),
        ((bytes, bytearray), "bytes"),
    ):
        if isinstance(cell, types):
            refuse_type(where, what, type(cell).__qualname__)
    raise TypeError(f"{where}: argument must be a string or a number, not {type(cell).__qualname__!r}")
