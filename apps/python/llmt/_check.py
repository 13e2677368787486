"""Whether a model is still good on new rows, in the words of `llmt check`."""

import json
from dataclasses import dataclass, field
from typing import Any

import numpy as np


@dataclass(frozen=True)
class Check:
    """What `check` found.

    `verdict`: "good", "moved, within limits", "no longer good" or "not evaluated", whose `reason` says why. `rows_outside`:
    positions of rows beyond the training range of an input. `targets`: a dict for each target: `rmse`, `promised`,
    `covered` (share of rows in their 90 % intervals), `leaves`, ... `inputs`: a dict for each input that the model uses;
    `columns`: those of them with something to say. `print` shows it as `llmt check` does.
    """

    verdict: str
    reason: str | None
    rows: int
    rows_outside: np.ndarray
    targets: list[dict[str, Any]]
    inputs: list[dict[str, Any]]
    tests: int
    _text: str = field(repr=False)

    @property
    def is_clean(self) -> bool:
        """Nothing was found, and no row is outside of the training range."""
        return not len(self.rows_outside) and not self.columns and self.verdict in ("good", "not evaluated")

    @property
    def columns(self) -> list[dict[str, Any]]:
        """The inputs that are not as in training."""
        keys = ("moved", "below", "above", "unknown", "missing")
        return [column for column in self.inputs if any(column[key] for key in keys)]

    @property
    def rmse(self) -> dict[str, float]:
        """The error of each target that was given."""
        return {target["name"]: target["rmse"] for target in self.targets if target["rows"]}

    @property
    def promised(self) -> dict[str, float]:
        """The error that held-out rows of the fit promise for rows like these."""
        return {target["name"]: target["promised"] for target in self.targets if target["promised"] is not None}

    def __str__(self) -> str:
        return self._text

    __repr__ = __str__


def check(estimator: Any, X: Any, y: Any, max_error: Any, level: float, sample_weight: Any) -> Check:
    """Judges the rows in C++."""
    from .tables import read_targets

    table = estimator._table(X)
    rows = len(table.values)
    outputs = np.full((rows, len(estimator._outputs)), np.nan)
    if y is not None:
        observed, _ = read_targets(y)
        if observed.size != outputs.size or len(observed) != rows:
            raise ValueError(f"y has the shape {observed.shape}, the predictions have {outputs.shape}")
        outputs[:] = observed.reshape(outputs.shape)
    limits = [] if max_error is None else np.atleast_1d(np.asarray(max_error, dtype=float)).tolist()
    weights = None if sample_weight is None else np.asarray(sample_weight, dtype=float)
    found, text = estimator._model().handle.check(
        table.values, outputs, table.unknown_words, float(level), limits, weights, estimator._threads()
    )
    parsed = json.loads(found)
    return Check(
        parsed["verdict"],
        parsed["reason"],
        parsed["rows"],
        np.asarray(parsed["outside"], dtype=int) - 1,
        parsed["targets"],
        parsed["inputs"],
        parsed["tests"],
        text.rstrip(),
    )
