"""Categories: words, and numbers that are names."""

from __future__ import annotations

import re
from collections.abc import Collection
from typing import Any

import numpy as np

from .._core import most_categories
from .raw import Raw, place_of, refuse_surrogates

_NUMBER = re.compile(r"[+-]?([0-9]+\.?[0-9]*|\.[0-9]+)([eE][+-]?[0-9]+)?", re.ASCII)
_NO_NUMBER = frozenset(("", "na", "n/a", "nan", "null", "?"))  # missing among numbers, as in a CSV file, in any case
UNKNOWN = -1.0
"""Stands for a label that training had not, which is no position; NaN is a missing cell."""
_EXACT = 2.0**53  # whole numbers from here on share a float64


def bare(word: str) -> str:
    """The label that a word means; empty: missing. Any other word is a label: who writes "NA" may mean Namibia."""
    return word.strip(" \t\r")


def text_of(number: float) -> str:
    """The shortest text that is read as the number."""
    text = repr(float(number) + 0.0)  # no -0
    return text.removesuffix(".0")


def positions_of(categorical: Collection[str | int], names: list[str] | None, columns: int) -> set[int]:
    """Columns that are named, or given by position.

    Raises ValueError for a column that is not there, TypeError for what is neither name nor position.
    """
    wanted: Collection[Any] = [categorical] if isinstance(categorical, (str, int)) else categorical
    positions = set()
    for column in wanted:
        if isinstance(column, str):
            if names is None or column not in names:
                has = "the columns have no names" if names is None else f"the columns are {', '.join(names)}"
                raise ValueError(f'categorical_features has "{column}", which is not among the columns: {has}')
            positions.add(names.index(column))
        elif isinstance(column, (int, np.integer)) and not isinstance(column, bool):
            if not 0 <= column < columns:
                raise ValueError(f"categorical_features has {column}, and the positions of the columns are 0 to {columns - 1}")
            positions.add(int(column))
        else:
            raise TypeError(f"categorical_features takes names or positions of columns, not {column!r}")
    return positions


def by_own_levels(raw: Raw, column: int, declared: bool, most: int | None = most_categories) -> list[str]:
    """Turns the cells of a column of words, or of numbers that are declared to be categories, into positions in its
    sorted labels, which are returned. Empty: numbers, untouched.

    Raises ValueError if there are more than ``most`` labels.
    """
    words = raw.columns[column].words
    if words is None and not (declared or raw.columns[column].declared):
        return []
    cells = raw.writable(column)
    here = np.isnan(cells)
    if words is not None:
        index = np.where(here, len(words), cells).astype(np.intp)
        occurs = np.bincount(index, minlength=len(words) + 1)[: len(words)] > 0
        labels = [bare(word) if used else "" for word, used in zip(words, occurs, strict=True)]
    else:
        _refuse_merged(raw, column, cells)
        numbers, found = np.unique(cells[~here], return_inverse=True)
        index = np.full(len(cells), len(numbers), dtype=np.intp)
        index[~here] = found
        labels = [text_of(number) for number in numbers]
    levels = sorted(set(labels) - {""})  # by code point, which is the order of the bytes of UTF-8
    where = place_of(raw, column, "the column")
    if most is not None:
        refuse_many(levels, where, most)
    for level in levels:
        if not level.isascii():
            refuse_surrogates(level, f"{level!r} in {where}")
    position = {level: float(k) for k, level in enumerate(levels)}
    cells[:] = np.array([position.get(label, np.nan) for label in labels] + [np.nan])[index]
    return levels or (["(none)"] if declared else [])


def refuse_many(levels: list[str], where: str, most: int = most_categories) -> None:
    """Raises ValueError if there are more than ``most`` labels."""
    if len(levels) > most:
        raise ValueError(f"{where} has {len(levels)} categories; at most {most} can be learnt: leave it out")


def by_given_levels(raw: Raw, column: int, levels: list[str]) -> dict[str, int]:
    """Turns the cells of a column into positions in given labels; returns the words that have none and became UNKNOWN,
    with the number of their cells.

    Without labels the column must be numbers: raises TypeError if it is words other than NA and the like.
    """
    words = raw.columns[column].words
    cells = raw.values[:, column]
    here = np.isnan(cells)
    if words is None and not levels:
        return {}
    if words is None:
        return _numbers_by_level(raw, column, levels)
    index = np.where(here, len(words), cells).astype(np.intp)
    labels = [bare(word) for word in words] + [""]
    if not levels:
        is_word = np.array([label.lower() not in _NO_NUMBER for label in labels])[index]
        if is_word.any():
            row = int(np.argmax(is_word))
            raise TypeError(
                f"{place_of(raw, column, 'the column')} holds {'dates' if raw.columns[column].dates else 'words'} "
                f"({words[index[row]]!r} in row {row}); in training "
                "it held numbers"
            )
        raw.writable(column)[:] = np.nan
        return {}
    position = {level: float(k) for k, level in enumerate(levels)}
    raw.writable(column)[:] = np.array([position.get(label, UNKNOWN if label else np.nan) for label in labels])[index]
    cells_of = np.bincount(index, minlength=len(labels))
    unknown: dict[str, int] = {}
    for label, count in zip(labels, cells_of.tolist(), strict=True):
        if label and label not in position and count:
            unknown[label] = unknown.get(label, 0) + count
    return unknown


def _numbers_by_level(raw: Raw, column: int, levels: list[str]) -> dict[str, int]:
    """Numbers by the value of the labels that are texts of numbers; raises TypeError if there are no such labels."""
    position: dict[float, float] = {}
    for k, level in enumerate(levels):
        if _NUMBER.fullmatch(level):
            value = float(level)
            if value not in position or text_of(value) == level:  # of "3" and "3.0" the former
                position[value] = float(k)
    cells = raw.writable(column)
    here = ~np.isnan(cells)
    if not position and here.any():
        row = int(np.argmax(here))
        raise TypeError(
            f"{place_of(raw, column, 'the column')} holds numbers ({text_of(cells[row])} in row {row}); in training it held words"
        )
    numbers, index = np.unique(cells[here], return_inverse=True)
    if any(level.lstrip("+-").isdigit() and abs(float(level)) >= _EXACT for level in levels):
        _refuse_merged(raw, column, cells)
    known = np.array([position.get(number, UNKNOWN) for number in numbers.tolist()])
    cells[here] = known[index] if len(known) else np.nan
    of_numbers = np.bincount(index, minlength=len(known)).tolist()
    return {text_of(number): count for number, count in zip(numbers.tolist(), of_numbers, strict=True) if number not in position}


def _refuse_merged(raw: Raw, column: int, cells: np.ndarray) -> None:
    """Names of so many digits may have become one."""
    large = np.abs(cells) >= _EXACT
    if large.any():
        row = int(np.argmax(large))
        raise ValueError(
            f"{place_of(raw, column, 'the column')}: {text_of(cells[row])} in row {row} has too many digits to be told "
            "from its neighbours as a number: convert the column to text"
        )
