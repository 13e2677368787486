"""A table between its source and the learner, and the words of its errors."""

from __future__ import annotations

import math
from collections import Counter
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any, NoReturn

import numpy as np


@dataclass
class Column:
    """What the cells of a column are."""

    words: list[str] | None = None  # cells are positions in this list, of which some may not occur; None: numbers
    declared: bool = False  # numbers that the source declares to be categories
    dates: str = ""  # the type of a column of dates or moments, whose words are their texts; empty: it is none


@dataclass
class Raw:
    """A table as its source has it."""

    values: np.ndarray  # (rows, columns) float64; NaN: missing
    columns: list[Column]
    labels: list[Any] | None  # of the columns, as the source has them
    dimensions: int = 2  # 1: a column by itself
    series: bool = False  # a column of a library for frames
    owned: bool = False  # whether the values may be changed

    def writable(self, column: int) -> np.ndarray:
        """The cells of a column, to be changed. Copies the values if they are the caller's."""
        if not self.owned:
            self.values = np.array(self.values, order="F")
            self.owned = True
        return self.values[:, column]


def place(label: Any) -> str:
    """A column in a message."""
    return f'column "{label}"' if isinstance(label, str) else f"column {label!r}"


def place_of(raw: Raw, column: int, name: str) -> str:
    """As place(), of a table that is called ``name``."""
    if raw.dimensions == 1:
        return name
    return place(raw.labels[column] if raw.labels is not None else column)


def refuse_dates(raw: Raw, name: str) -> None:
    """Raises TypeError for the first column of dates."""
    for j, column in enumerate(raw.columns):
        if column.dates:
            refuse_type(place_of(raw, j, name), "dates", column.dates)


_TIMES = "convert it to numbers, such as days since a first date, or leave it out"
_ADVICE = {
    "dates": _TIMES,
    "times": _TIMES,
    "durations": "convert it to numbers, such as seconds, or leave it out",
    "periods": _TIMES,
    "intervals": "convert it to text or to numbers, such as the middle, or leave it out",
    "bytes": "decode it to text, or leave it out",
    "complex numbers": "make columns of the real and the imaginary part, or leave it out",
    "structs": "make columns of its parts, or leave it out",
    "sparse numbers": "convert it to a dense column (.sparse.to_dense())",
}


def refuse_type(where: str, what: str, of_type: Any) -> NoReturn:
    """Raises TypeError for a column of a type that cannot be read."""
    advice = _ADVICE.get(what, "convert it to numbers or text, or leave it out")
    raise TypeError(f"{where} holds {what} ({of_type}): {advice}")


def feature_names(labels: Sequence[Any] | None) -> list[str] | None:
    """Names if all of them are text, None if none is.

    Raises TypeError for a mix, in scikit-learn's words, and ValueError for names that occur twice or are not UTF-8.
    """
    if not labels or not any(isinstance(label, str) for label in labels):
        return None
    if not all(isinstance(label, str) for label in labels):
        types = sorted({type(label).__qualname__ for label in labels})
        raise TypeError(
            "Feature names are only supported if all input features have string names, but your input has "
            f"{types} as feature name / column name types. If you want feature names to be stored and validated, you "
            "must convert them all to strings, by using X.columns = X.columns.astype(str) for example. Otherwise you "
            "can remove feature / column names from your input data, or convert them all to a non-string data type."
        )
    names = [str(label) for label in labels]
    if len(set(names)) < len(names):
        twice = [name for name, count in Counter(names).items() if count > 1]
        raise ValueError(f"{place(twice[0])} occurs more than once: columns are told apart by their names")
    for name in names:
        refuse_surrogates(name, f"the name of column {name!r}")
    return names


def refuse_surrogates(text: str, what: str) -> None:
    """Raises ValueError for a text that has no UTF-8."""
    try:
        text.encode()
    except UnicodeEncodeError:
        raise ValueError(f"{what} is no Unicode: it has surrogates that stand alone") from None


def refuse_infinite(raw: Raw, name: str) -> None:
    """Raises ValueError for the first infinite value, in scikit-learn's words."""
    block = 65536  # rows, so that the mask is small
    for first in range(0, len(raw.values), block):
        infinite = np.isinf(raw.values[first : first + block])
        if infinite.any():
            row, column = np.argwhere(infinite)[0]
            raise ValueError(
                f"Input {name} contains infinity or a value too large for dtype('float64').\nThe first is "
                f"{raw.values[first + row, column]} in row {first + row} of {place_of(raw, int(column), name)}."
            )


def number_hint(words: Sequence[str], expression: str) -> str:
    """How to make numbers of a column (`expression`) of pandas whose words all read as numbers; else ""."""
    for decimal, text in ((".", expression), (",", f'{expression}.str.replace(",", ".")')):
        try:
            if words and all(math.isfinite(float(word.replace(decimal, "."))) for word in words):
                return f"{text}.astype(float)"
        except ValueError:
            continue
    return ""
