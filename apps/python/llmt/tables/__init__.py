"""Tables as people have them, as the numbers that the learner takes.

NumPy arrays, lists, pandas, polars, pyarrow and all that speaks Arrow are read; none of them but NumPy is imported.
Words are categories. What cannot be read is a TypeError or a ValueError that names the column.
"""

from __future__ import annotations

import warnings
from collections.abc import Collection, Mapping, Sequence
from dataclasses import dataclass
from typing import Any, NoReturn

import numpy as np

from .._core import most_categories
from .categories import UNKNOWN, by_given_levels, by_own_levels, positions_of, refuse_many
from .raw import Raw, feature_names, number_hint, place, place_of, refuse_dates, refuse_infinite
from .sources import read_raw

__all__ = ["UNKNOWN", "Table", "read_column", "read_table", "read_targets", "refuse_many_words", "row_labels"]

_OWNER = "LocalLinearTreeRegressor"
_RESHAPE = (
    "Reshape your data either using array.reshape(-1, 1) if your data has a single feature or array.reshape(1, -1) "
    "if it contains a single sample."
)
_UNCHECKED: Any = object()


@dataclass(frozen=True)
class Table:
    """Inputs as the learner takes them."""

    values: np.ndarray  # (rows, columns) float64; NaN: missing; a category is its position in its column's levels
    names: list[str] | None  # None: columns without names
    levels: list[list[str]]  # of each column; []: numbers
    # Of each column: the words that are not among the given levels, and how many cells have each; these are UNKNOWN.
    unknown_words: list[dict[str, int]]

    @property
    def unknown(self) -> list[int]:
        """Of each column: cells with a category that is not among the given levels."""
        return [sum(words.values()) for words in self.unknown_words]


def read_table(
    X: Any,
    *,
    levels: Sequence[Sequence[str]] | None = None,
    categorical: Collection[str | int] = (),
    name: str = "X",
    owner: str = _OWNER,
    fitted_names: Sequence[str] | None = _UNCHECKED,
    dates: bool = False,
    any_words: bool = False,
) -> Table:
    """Reads a table of inputs.

    A column is numbers (booleans are 0 and 1) or words. Words are categories: their levels are the words that occur,
    sorted by their bytes of UTF-8, without outer blanks; an empty word is a missing value, as None and NaN are. "NA"
    and the like are words: who has read a file may have made them missing values. A column without any value is
    numbers.

    ``levels``: those of a fitted model. Columns with levels are read by label, a number by its value where the label
    is the text of a number; a label that is not among them becomes UNKNOWN and is counted. All other columns must be
    numbers. ``fitted_names``: the columns' names in training, or None, to be checked as scikit-learn does.

    ``categorical``: names or positions of columns that are categories although they are numbers. Their labels are the
    shortest texts of the numbers.

    ``dates``: columns of dates and moments are read as words, their texts, where the columns have names; else they are
    a TypeError. ``any_words``: columns of any number of different words are read where they are not in
    ``categorical``, for a caller that leaves some of them out and calls refuse_many_words() on the rest.

    A float64 array without categories is not copied. Frames are copied once, column by column.

    Raises TypeError for columns of a type that cannot be read, ValueError for infinite values and for tables that are
    not two-dimensional or have no rows or no columns. Both name the column where there is one.
    """
    if getattr(X, "ndim", None) == 1 and hasattr(X, "iloc"):  # before its cells, which may be of many types
        _refuse_series(X)
    if isinstance(X, (list, tuple)) and X and isinstance(X[0], Mapping):
        raise TypeError(f"{name} is a list of dicts; make a table of it: pandas.DataFrame({name})")
    raw = read_raw(X, name)
    if raw.dimensions != 2:
        if raw.series:
            _refuse_series(X)
        raise ValueError(f"Expected 2D array, got 1D array instead:\narray={X}.\n{_RESHAPE}")
    names = feature_names(raw.labels)
    if fitted_names is not _UNCHECKED:
        _check_names(names, fitted_names, owner, name)
    rows, columns = raw.values.shape
    if levels is not None and len(levels) != columns:
        raise ValueError(f"{name} has {columns} features, but {owner} is expecting {len(levels)} features as input.")
    for count, what in ((rows, "sample"), (columns, "feature")):
        if count == 0:
            raise ValueError(
                f"Found array with 0 {what}(s) (shape={(rows, columns)}) while a minimum of 1 is required by {owner}."
            )
    refuse_infinite(raw, name)
    if not dates or names is None:
        refuse_dates(raw, name)
    if levels is not None:
        unknown = [by_given_levels(raw, j, list(given)) for j, given in enumerate(levels)]
        return Table(raw.values, names, [list(given) for given in levels], unknown)
    declared = positions_of(categorical, names, columns)
    most = [None if any_words and j not in declared else most_categories for j in range(columns)]
    found = [by_own_levels(raw, j, j in declared, most[j]) for j in range(columns)]
    return Table(raw.values, names, found, [{} for _ in range(columns)])


def refuse_many_words(table: Table) -> None:
    """Raises ValueError for the first column with more categories than can be learnt."""
    for position, levels in enumerate(table.levels):
        refuse_many(levels, place(position if table.names is None else table.names[position]))


def _refuse_series(X: Any) -> NoReturn:
    raise ValueError(
        f"Expected a 2-dimensional container but got {type(X)} instead. Pass a DataFrame containing a single row (i.e. "
        "single sample) or a single column (i.e. single feature) instead: of a frame X the first row is X.iloc[[0]]."
    )


def read_column(y: Any, *, name: str) -> tuple[np.ndarray, str | None]:
    """One column of numbers without a missing value, and its name where it has one.

    Raises ValueError for NaN, infinity and more than one dimension, TypeError for what are no numbers.
    """
    values, names = _read_numbers(y, name)
    if values.ndim != 1:
        raise ValueError(f"{name} should be a 1d array, got an array of shape {values.shape} instead.")
    return values, names[0] if names else None


def read_targets(y: Any, *, owner: str = _OWNER) -> tuple[np.ndarray, list[str] | None]:
    """Targets of the shape that they were given in, (rows,) or (rows, outputs), and their names. Errors as
    read_column()."""
    if y is None:
        raise ValueError(f"{owner} requires y to be passed, but the target y is None")
    return _read_numbers(y, "y")


def row_labels(groups: Any, rows: int, *, name: str = "groups") -> np.ndarray:
    """Of each row the number of its group, equal for equal labels, which are numbers or words.

    Raises ValueError for another number of rows and for a label that is missing.
    """
    kept = np.asarray(groups) if hasattr(groups, "__array__") and not hasattr(groups, "mask") else groups
    if isinstance(kept, np.ndarray) and kept.ndim == 1 and kept.dtype.kind in "iu":
        codes = np.unique(kept, return_inverse=True)[1].astype(np.float64)  # all digits of large numbers count
    else:
        raw = read_raw(groups, name)
        if raw.dimensions != 1:
            raise ValueError(f"{name} should be a 1d array, got an array of shape {raw.values.shape} instead.")
        by_own_levels(raw, 0, True, most=None)
        codes = raw.values[:, 0]
        _refuse_nan(raw, name)
    if len(codes) != rows:
        raise ValueError(f"Found input variables with inconsistent numbers of samples: {[rows, len(codes)]}: {name}")
    return codes


def _read_numbers(y: Any, name: str) -> tuple[np.ndarray, list[str] | None]:
    raw = read_raw(y, name)
    refuse_dates(raw, name)
    for j, column in enumerate(raw.columns):
        if column.words is not None and not np.isnan(raw.values[:, j]).all():
            row = int(np.flatnonzero(~np.isnan(raw.values[:, j]))[0])
            word = column.words[int(raw.values[row, j])]
            is_of_frame = raw.dimensions == 2 and raw.labels
            hint = number_hint(column.words, f"{name}[{raw.labels[j]!r}]" if is_of_frame and raw.labels else name)
            hint = f"; convert them: {hint}" if hint else ""
            raise TypeError(f"{place_of(raw, j, name)} holds words ({word!r} in row {row}); numbers are needed{hint}")
    refuse_infinite(raw, name)
    _refuse_nan(raw, name)
    if raw.dimensions == 1:
        label = raw.labels[0] if raw.labels else None
        return raw.values[:, 0], feature_names([label]) if isinstance(label, str) and label else None
    return raw.values, feature_names(raw.labels)


def _refuse_nan(raw: Raw, name: str) -> None:
    missing = np.isnan(raw.values)
    if missing.any():
        rows, columns = np.nonzero(missing)
        count = len(np.unique(rows))
        many = "leave this row out" if count == 1 else f"{count} rows have one: leave these rows out"
        raise ValueError(
            f"Input {name} contains NaN.\n"
            f"The first is in row {rows[0]} of {place_of(raw, int(columns[0]), name)}; {many}."
        )


def _check_names(names: list[str] | None, fitted: Sequence[str] | None, owner: str, name: str) -> None:
    """In scikit-learn's words, which its checks of estimators look for."""
    if names is None and fitted is None:
        return
    if fitted is None:
        warnings.warn(f"{name} has feature names, but {owner} was fitted without feature names", stacklevel=4)
        return
    if names is None:
        warnings.warn(
            f"{name} does not have valid feature names, but {owner} was fitted with feature names", stacklevel=4
        )
        return
    if names == list(fitted):
        return
    message = "The feature names should match those that were passed during fit.\n"
    unexpected = sorted(set(names) - set(fitted))
    missing = sorted(set(fitted) - set(names))
    for title, some in (
        ("Feature names unseen at fit time:\n", unexpected),
        ("Feature names seen at fit time, yet now missing:\n", missing),
    ):
        if some:
            message += title + "".join(f"- {each}\n" for each in some[:5]) + ("- ...\n" if len(some) > 5 else "")
    if not unexpected and not missing:
        message += "Feature names must be in the same order as they were in fit.\n"
    raise ValueError(message)
