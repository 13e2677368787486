"""Warnings about tables that are probably not what the user thinks, as `llmt fit` prints them."""

import warnings

import numpy as np

from . import _core
from .tables import Table
from .tables.raw import number_hint


def warn_of_accidental_inputs(table: Table, meant: set[str], stacklevel: int) -> list[int]:
    """Warns of columns that look like names, dates or numbers of the rows, or as if some of their numbers were none.
    Returns the positions of those that are left out. Tables without names are not looked at: their columns were chosen
    by hand."""
    if table.names is None:
        return []
    found = _core.accidental_inputs(table.values, table.levels)
    found = [each for each in found if table.names[each[1]] not in meant]
    left_out = [
        position
        for kind, position, _, is_left_out in found
        if is_left_out and (kind == "dates" or not number_hint(table.levels[position], ""))
    ]
    if len(left_out) == len(table.names):  # one input stays at least
        left_out = []
    for kind, position, detail, _ in found:
        name = table.names[position]
        if kind == "row_numbers":
            text = "numbers the rows and is an input; leave it out of X if it is not meant"
        elif kind == "far_value":
            text = f"looks as if numbers stood for missing values: {detail}; if they do, make them NaN"
        elif kind == "unit":
            text = f"has {detail} in every cell, and is taken for categories; give the numbers alone to have numbers"
        elif position in left_out:
            text = (
                f"has {kind}, {len(table.levels[position])} different ones in {len(table.values)} rows, and is left out; "
                + ("give a number, as days; " if kind == "dates" else "")
                + "categorical_features takes it for categories"
            )
        elif len(table.levels[position]) > _core.most_categories:
            continue  # refused by the caller
        elif kind == "dates":
            text = "looks like a date and is taken for categories; give a number, as days, or leave it out of X"
        elif hint := number_hint(table.levels[position], f'X["{name}"]'):
            text = f"has words that read as numbers, and is taken for categories; convert it: {hint}"
        else:
            text = (
                f"has words, {len(table.levels[position])} different ones in {len(table.values)} rows, and is taken for "
                "categories; leave it out of X if they are names of the rows, or name it in categorical_features"
            )
        warnings.warn(f'column "{name}" {text}', stacklevel=stacklevel)
    return left_out


def warn_of_few_rows(rows: int, stacklevel: int) -> None:
    """Warns where the errors on held-out rows say next to nothing."""
    if rows < 10:
        warnings.warn(
            f"X has {rows} row{'' if rows == 1 else 's'}: below 10, held-out errors cannot tell which model is better, and "
            "the mean of y may be; give more rows",
            stacklevel=stacklevel,
        )


def warn_of_gross_errors(fitted: "_core.Fit", outputs: np.ndarray, names: list[str], stacklevel: int) -> None:
    """Warns of few rows that carry most of the held-out squared error."""
    for column, name in enumerate(names):
        if _core.dominant_rows(np.ascontiguousarray(outputs[:, column]))[0]:
            continue  # these were named before the fit
        rows, share, held_out = fitted.gross_errors(column)
        if rows:
            warnings.warn(
                f'{len(rows)} of {held_out} held-out rows carry {100 * share:.0f} % of the held-out squared error of '
                f'"{name}": {_places(rows, outputs[:, column])}. If they are mistakes, correct them or use '
                'loss="tukey", which leaves such rows out',
                stacklevel=stacklevel,
            )


def _places(rows: list[int], target: np.ndarray) -> str:
    named = ", ".join(f"{row} ({target[row]:.4g})" for row in rows[:5]) + (", ..." if len(rows) > 5 else "")
    return f"row{'' if len(rows) == 1 else 's'} {named}"


def check_targets(outputs: np.ndarray, names: list[str], robust: str, stacklevel: int) -> None:
    """Warns of a constant target and of few rows that decide a fit by squares. Raises ValueError for a value beside
    which all others are rounding errors. `robust`: how a fit that is robust is asked for; empty: this one is."""
    for column, name in enumerate(names):
        target = outputs[:, column]
        if len(target) > 1 and target.min() == target.max():
            warnings.warn(f'target "{name}" is {target[0]:g} in every row: the model is that constant', stacklevel=stacklevel)
        if not robust:
            continue
        rows, share, hide_the_others = _core.dominant_rows(np.ascontiguousarray(target))
        if not rows:
            continue
        if hide_the_others:
            raise ValueError(
                f'target "{name}", row {rows[0]}: {target[rows[0]]:.6g} is so large that the differences between all '
                f"other values are below its rounding error; correct it, leave the row out, or use {robust}"
            )
        warnings.warn(
            f'{len(rows)} of {len(target)} rows carry {100 * share:.3g} % of the squares of "{name}" about its median: '
            f"{_places(rows, target)}. If they are mistakes, correct them or use {robust}",
            stacklevel=stacklevel,
        )
