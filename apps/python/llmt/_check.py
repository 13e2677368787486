"""Whether new rows are like those of the fit."""

from dataclasses import dataclass
from typing import Any

import numpy as np

_shift = 1.0  # standard deviations of the mean, beyond which a column is said to be shifted
_shown_columns = 10


@dataclass(frozen=True)
class Check:
    """What `check` found. `rows_outside`: positions of rows beyond the training range of an input that the model uses;
    `columns`: a dict for each input with something to say; `rmse`: of each target, beside `rmse_held_out`."""

    rows: int
    rows_outside: np.ndarray
    columns: list[dict[str, Any]]
    rmse: dict[str, float]
    rmse_held_out: dict[str, float]

    @property
    def is_clean(self) -> bool:
        """Nothing was found."""
        return not len(self.rows_outside) and not self.columns

    def __str__(self) -> str:
        lines = [f"{self.rows} rows, {len(self.rows_outside)} of them outside of the training ranges"]
        for column in self.columns[:_shown_columns]:
            said = [f"{column[key]} {words}" for key, words in _words.items() if column[key]]
            if column["shift"]:
                said.append(f"mean {column['mean']:.4g}, in training {column['training_mean']:.4g}")
            lines.append(f"  {column['name']}: {'; '.join(said)}")
        if len(self.columns) > _shown_columns:
            lines.append(f"  and {len(self.columns) - _shown_columns} more columns")
        for name, rmse in self.rmse.items():
            held_out = self.rmse_held_out.get(name)
            beside = "" if held_out is None else f", on held-out rows of the fit {held_out:.4g}"
            lines.append(f"RMSE of {name}: {rmse:.4g}{beside}")
        return "\n".join(lines)

    __repr__ = __str__


_words = {
    "below": "below the training range",
    "above": "above the training range",
    "unknown": "with a category that training had not",
    "missing": "missing",
}


def check(estimator: Any, X: Any, y: Any = None) -> Check:
    """Compares the rows with what the model knows of its inputs."""
    from .tables import read_targets

    table = estimator._table(X)
    handle = estimator._model().handle
    sample = estimator._sample
    columns = []
    for position, (column, is_used) in enumerate(zip(handle.inputs(), handle.used_inputs(), strict=True)):
        if not is_used:
            continue
        found = _look_at(column, table.values[:, position], sample[:, position], table.unknown[position])
        if any(found[key] for key in (*_words, "shift")):
            columns.append(found)
    distance = handle.extrapolation(table.values, estimator._threads())[:, 0]
    rmse: dict[str, float] = {}
    held_out: dict[str, float] = {}
    if y is not None:
        observed, _ = read_targets(y)
        predicted = np.asarray(estimator.predict(X))
        if observed.shape != predicted.shape:
            raise ValueError(f"y has the shape {observed.shape}, the predictions have {predicted.shape}")
        errors = np.sqrt(np.mean((predicted - observed).reshape(len(observed), -1) ** 2, axis=0))
        rmse = dict(zip(estimator._outputs, map(float, errors), strict=True))
        held_out = estimator._held_out_rmse()
    return Check(len(table.values), np.flatnonzero(distance > 0), columns, rmse, held_out)


def _look_at(column: dict[str, Any], values: np.ndarray, training: np.ndarray, unknown: int) -> dict[str, Any]:
    is_number = not column["levels"]
    present = values[~np.isnan(values)]
    known = training[~np.isnan(training)]
    found = {
        "name": column["name"],
        "below": int((present < column["low"]).sum()) if is_number else 0,
        "above": int((present > column["high"]).sum()) if is_number else 0,
        "unknown": int(unknown),
        "missing": int(np.isnan(values).sum()),
        "mean": float(present.mean()) if is_number and len(present) else np.nan,
        "training_mean": float(column["centre"]),
        "shift": 0.0,
    }
    spread = float(known.std()) if len(known) > 1 else 0.0
    if is_number and len(present) >= 20 and spread > 0:
        shift = abs(found["mean"] - found["training_mean"]) / spread
        found["shift"] = shift if shift > _shift else 0.0
    return found
