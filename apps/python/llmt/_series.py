"""Records of systems that move, as arrays."""

from typing import Any

import numpy as np


def signals(values: Any, name: str, rows: int = 0) -> tuple[np.ndarray, list[str]]:
    """Signals as columns, and their names: those of a frame, or `name`, or name1, name2, ..."""
    if values is None:
        return np.empty((rows, 0)), []
    columns = getattr(values, "columns", None)
    of_series = getattr(values, "name", None)
    array = np.asarray(values, dtype=float)
    if array.ndim == 1:
        array = array.reshape(-1, 1)
    if array.ndim != 2:
        raise ValueError(f"{name} has {array.ndim} dimensions; it has rows, or rows and columns")
    if columns is not None:
        names = [str(column) for column in columns]
    elif of_series is not None and array.shape[1] == 1:
        names = [str(of_series)]
    else:
        names = [name] if array.shape[1] == 1 else [f"{name}{k + 1}" for k in range(array.shape[1])]
    return array, names


def record_begins(records: Any, rows: int) -> list[int]:
    if records is None:
        return []
    labels = list(records)
    if len(labels) != rows:
        raise ValueError(f"records has {len(labels)} labels, y has {rows} rows")
    begins = [row for row in range(rows) if row == 0 or labels[row] != labels[row - 1]]
    seen: set[Any] = set()
    for row in begins:
        if labels[row] in seen:
            raise ValueError(f"records: {labels[row]!r} goes on in row {row}, behind another record; sort the rows")
        seen.add(labels[row])
    return begins


def step_of(values: Any, begins: list[int]) -> float:
    """The step of a frame's index in seconds; 1 where there is none."""
    index = getattr(values, "index", None)
    if index is None or callable(index) or len(index) < 2:
        return 1.0
    times = np.asarray(index)
    if times.dtype.kind == "M":
        times = times.astype("datetime64[ns]").astype(np.int64) / 1e9
    elif times.dtype.kind not in "iuf":
        return 1.0
    steps = np.diff(times.astype(float))
    inside = np.ones(len(steps), dtype=bool)
    inside[[begin - 1 for begin in begins if begin > 0]] = False
    step = float(np.median(steps[inside]))
    wrong = np.flatnonzero(inside & ~(np.abs(steps - step) <= 0.01 * abs(step)))
    if not step > 0 or len(wrong):
        row = int(wrong[0]) + 1 if len(wrong) else 1
        raise ValueError(f"y: the index does not rise in equal steps at row {row}; give dt, or put the rows on a grid")
    return step
