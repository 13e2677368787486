"""What the estimators share: tables in, predictions out, model files."""

import os
import threading
import warnings
from collections.abc import Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, ClassVar

import numpy as np

from . import _advice, _core
from ._base import BaseEstimator, NotFittedError, RegressorMixin
from ._model import TextModel
from .tables import UNKNOWN, Table, read_column, read_table, read_targets, refuse_many_words, row_labels

if TYPE_CHECKING:
    from typing_extensions import Self

_most_seeds = 2**31


@dataclass(frozen=True)
class FitRows:
    """What `fit` was given, read and checked."""

    table: Table  # the rows of an eval_set below the others
    outputs: np.ndarray  # (rows, targets)
    weights: np.ndarray | None
    groups: np.ndarray | None
    held_out: list[int]  # positions of the rows of an eval_set
    fitted: int  # rows without those
    given: tuple[Any, Any, Any]  # X, y and groups as they were given


class TableRegressor(RegressorMixin, BaseEstimator):
    """The part of an estimator that reads tables, predicts, and keeps its model as text."""

    _of_file: ClassVar[type[TextModel]]
    _why_no_intervals: ClassVar[str]

    if TYPE_CHECKING:
        categorical_features: Any
        random_state: Any
        n_jobs: int | None
        model_: Any
        summary_: dict[str, Any]
        _fit: Any

    def fit(self, X: Any, y: Any, sample_weight: Any = None, groups: Any = None, eval_set: Any = None) -> "Self":
        """Learns from a table.

        Parameters
        ----------
        X : table, (rows, columns)
            Inputs. NaN, None and null are missing; infinity is refused.
        y : array, (rows,) or (rows, targets)
            Targets, all finite.
        sample_weight : array, (rows,), optional
            Weight k counts as the row k times, weight 0 as a row that is not there.
        groups : array, (rows,), optional
            Rows with equal labels are held out together.
        eval_set : tuple (X, y), optional
            Choose by the error on these rows, and hold out none of the others. They do not enter the model.

        Raises
        ------
        ValueError, TypeError
            For what cannot be learned from; the message names the column or the parameter.
        """
        with self._learning():
            rows = self._read_rows(X, y, sample_weight, groups, eval_set)
            self._learn(rows)
            self._take_rows(rows)
        return self

    def predict(self, X: Any) -> np.ndarray:
        """Predictions, (rows,), or (rows, targets) where y had two dimensions."""
        return self._shaped(self._model().handle.predict(self._table(X).values, self._threads()))

    def predict_interval(self, X: Any, coverage: float = 0.9) -> np.ndarray:
        """Intervals that hold the share `coverage` of the targets (docs/algorithms/intervals.md).

        They are wider for rows in a gap of the training rows: within the range of every input, but far from all of
        them. After a fit with sample weights that are no counts they are those of rows of the median weight.

        Returns
        -------
        ndarray, (rows, 2), or (rows, 2, targets) where y had two dimensions
            Lower and upper ends.

        Raises
        ------
        ValueError
            If nothing was held out in the fit, or too few rows for the coverage.

        Warns
        -----
        UserWarning
            Of rows outside of the training ranges, for which no interval is honest, and of rows with a missing cell or
            a category as too few training rows had, or none. `check` says where they are.
        """
        level = share("coverage", coverage)
        handle = self._handle_with_intervals("predict_interval")
        values = self._table(X).values
        lower, upper, uncalibrated = handle.intervals(values, level, self._threads())
        self._warn_of_rows_outside(values)
        if len(uncalibrated):
            warnings.warn(
                f"{len(uncalibrated)} of {len(values)} rows have a missing cell or an unknown category, as too few training "
                f"rows had, the first is row {uncalibrated[0]}: their intervals are likely too narrow; check(X) names the "
                "columns",
                stacklevel=2,
            )
        ends = np.stack([lower, upper], axis=1)
        return ends[:, :, 0] if self._is_flat else ends

    def predict_quantiles(self, X: Any, quantiles: Sequence[float] = (0.05, 0.5, 0.95)) -> np.ndarray:
        """Values below which the given shares of the targets lie, ascending in each row (docs/algorithms/intervals.md).

        Parameters
        ----------
        X : table, (rows, columns)
            Inputs, as in `predict`.
        quantiles : numbers between 0 and 1, ascending
            0.5 stands for the prediction; 0.05 and 0.95 are the ends of the interval that holds 90 %.

        Returns
        -------
        ndarray, (rows, quantiles), or (rows, quantiles, targets) where y had two dimensions

        Raises
        ------
        ValueError
            If nothing was held out in the fit, or too few rows for a quantile.

        Warns
        -----
        UserWarning
            Of rows outside of the training ranges, as `predict_interval`.
        """
        probabilities = [share("quantiles", quantile) for quantile in quantiles]
        handle = self._handle_with_intervals("predict_quantiles")
        values = self._table(X).values
        of_targets = handle.quantiles(values, probabilities, self._threads())
        self._warn_of_rows_outside(values)
        stacked = np.stack(of_targets, axis=2)
        return stacked[:, :, 0] if self._is_flat else stacked

    def _handle_with_intervals(self, method: str) -> Any:
        handle = self._model().handle
        if not handle.has_intervals:
            raise ValueError(
                f"{method} needs rows that were held out, and this model has none: {self._why_no_intervals}"
            )
        return handle

    def _warn_of_rows_outside(self, values: np.ndarray) -> None:
        outside = np.flatnonzero(self._model().handle.extrapolation(values, self._threads())[:, 0] > 0)
        if len(outside):
            warnings.warn(
                f"{len(outside)} of {len(values)} rows lie outside of the training ranges, the first is row {outside[0]}: "
                "their intervals are not to be believed; check(X) names the columns",
                stacklevel=3,
            )

    def to_json(self) -> str:
        """The model as JSON text, as `llmt fit -o` writes it."""
        text: str = self._model().to_json()
        return text

    def save(self, path: "str | os.PathLike[str]") -> None:
        """Writes the model file that `llmt predict` and `load` read."""
        self._model().save(path)

    @classmethod
    def load(cls, path: "str | os.PathLike[str]") -> "Self":
        """An estimator with the model of a file. What belongs to the fit alone, such as summary_, is not in files."""
        estimator = cls()
        estimator._take_model(cls._of_file.load(path))
        return estimator

    def __getstate__(self) -> dict[str, Any]:
        with self._learning():
            state = dict(super().__getstate__())
            if state.get("_stream") is not None:
                state["_stream"] = state["_stream"].copy()  # of the same moment as model_
        del state["_lock"]
        if "_fit" in state:
            state["_fit"] = None
        return state

    def __sklearn_is_fitted__(self) -> bool:
        return hasattr(self, "model_")

    def __sklearn_tags__(self) -> Any:
        tags = super().__sklearn_tags__()
        tags.input_tags.allow_nan = True
        tags.input_tags.categorical = True
        tags.input_tags.string = True
        tags.target_tags.multi_output = True
        return tags

    def _learning(self) -> Any:
        """The lock of what changes the estimator: threads that share it learn one after the other."""
        return self.__dict__.setdefault("_lock", threading.RLock())

    def _learn(self, rows: "FitRows") -> None:
        """Makes model_ and summary_ of the rows, and keeps the fit."""
        raise NotImplementedError

    def _robust(self) -> str:
        """How a fit that is robust to gross errors in y is asked for; empty: this one is."""
        raise NotImplementedError

    def _read_rows(self, X: Any, y: Any, sample_weight: Any, groups: Any, eval_set: Any) -> "FitRows":
        """Reads and checks what `fit` is given, and warns of what is probably not meant."""
        table = read_table(
            X, categorical=self.categorical_features, owner=type(self).__name__, dates=True, any_words=True
        )
        outputs, names = read_targets(y, owner=type(self).__name__)
        check_rows(len(table.values), len(outputs))
        rows = len(outputs)
        self.n_outputs_ = 1 if outputs.ndim == 1 else outputs.shape[1]
        self._is_flat = outputs.ndim == 1
        outputs = outputs.reshape(rows, -1)
        weights = weights_of(sample_weight, rows)
        labels = None if groups is None else row_labels(groups, rows)
        self._inputs = names_of(table)
        self._outputs = names or target_names(self.n_outputs_)
        self._levels = table.levels
        held_out: list[int] = []
        if eval_set is not None:
            if groups is not None:
                raise ValueError("groups deal folds, and eval_set takes their place: give one of them")
            values, judged = self._evaluation(eval_set, table, outputs)
            held_out = list(range(rows, rows + len(judged)))
            table = Table(np.vstack([table.values, values]), table.names, table.levels, table.unknown_words)
            outputs = np.vstack([outputs, judged])
            weights = None if weights is None else np.concatenate([weights, np.ones(len(judged))])
        meant = {str(name) for name in self.categorical_features}
        for position in _advice.warn_of_accidental_inputs(table, meant, stacklevel=4):
            table.values[:, position] = 0.0  # one level in all rows, of which nothing can be learned
            if len(table.levels[position]) > _core.most_categories:
                del table.levels[position][1:]
        refuse_many_words(table)
        _advice.check_targets(outputs, self._outputs, self._robust(), stacklevel=4)
        _advice.warn_of_few_rows(rows, stacklevel=4)
        return FitRows(table, outputs, weights, labels, held_out, rows, (X, y, groups))

    def _take_rows(self, rows: "FitRows") -> None:
        """Remembers of the rows of a fit what predictions and views need."""
        self._remember_columns(rows.table)
        self._sample = spread(rows.table.values[: rows.fitted], 500)

    def _take_model(self, model: TextModel) -> None:
        """Sets all that a model file says."""
        columns = model.handle.inputs()
        self.model_ = model
        self._inputs = [column["name"] for column in columns]
        self._outputs = model.handle.outputs()
        self._levels = [list(column["levels"]) if not column["codes"] else [] for column in columns]
        self.n_features_in_ = len(columns)
        self.feature_names_in_ = np.asarray(self._inputs, dtype=object)
        self.n_outputs_ = len(self._outputs)
        self._is_flat = self.n_outputs_ == 1
        self._fit = None
        self._sample = np.array([[column["centre"] for column in columns]])
        self.summary_ = {}

    def _evaluation(self, given: Any, table: Table, outputs: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Inputs and targets of an eval_set, read as the training rows were."""
        if len(given) == 1 and len(given[0]) == 2:  # a list of one pair, as boosters take it
            given = given[0]
        if len(given) != 2:
            raise ValueError("eval_set must be a pair (X, y)")
        X, y = given
        rows = read_table(X, levels=table.levels, fitted_names=table.names, name="eval_set[0]", dates=True).values
        rows = np.where((rows == UNKNOWN) & [bool(of) for of in table.levels], np.nan, rows)
        judged, _ = read_targets(y)
        check_rows(len(rows), len(judged))
        judged = judged.reshape(len(judged), -1)
        if judged.shape[1] != outputs.shape[1]:
            raise ValueError(f"eval_set has {judged.shape[1]} targets, y has {outputs.shape[1]}")
        return rows, judged

    def _model(self) -> Any:
        if not hasattr(self, "model_"):
            raise NotFittedError(
                f"This {type(self).__name__} instance is not fitted yet. Call 'fit' with appropriate arguments before "
                "using this estimator."
            )
        return self.model_

    def _table(self, X: Any) -> Table:
        self._model()
        return read_table(
            X, levels=self._levels, fitted_names=self._fitted_names(), owner=type(self).__name__, dates=True
        )

    def _fitted_names(self) -> list[str] | None:
        names = getattr(self, "feature_names_in_", None)
        return None if names is None else list(names)

    def _remember_columns(self, table: Table) -> None:
        self.n_features_in_ = table.values.shape[1]
        if table.names is not None:
            self.feature_names_in_ = np.asarray(table.names, dtype=object)
        elif hasattr(self, "feature_names_in_"):
            del self.feature_names_in_

    def _shaped(self, values: np.ndarray) -> np.ndarray:
        return values[:, 0] if self._is_flat else values

    def _threads(self) -> int:
        if self.n_jobs is None or self.n_jobs == -1:
            return 0
        if self.n_jobs == 0:
            raise ValueError("n_jobs is 0; it must be a number of threads of 1 or more, or None or -1 for all")
        return count("n_jobs", self.n_jobs)

    def set_params(self, **params: Any) -> "Self":
        """Sets parameters; a name that is none is refused in a line that does not print the fitted model."""
        known = self.get_params(deep=True)
        for name in params:
            if name not in known:
                raise ValueError(
                    f"Invalid parameter {name!r} for estimator {type(self).__name__}. "
                    f"Valid parameters are: {sorted(known)!r}."
                )
        super().set_params(**params)
        return self

    def _seed(self) -> int:
        if self.random_state is None:
            return 1
        if isinstance(self.random_state, np.random.RandomState):
            return int(self.random_state.randint(_most_seeds))
        return count("random_state", self.random_state)


def check_rows(inputs: int, outputs: int) -> None:
    if inputs != outputs:
        raise ValueError(f"Found input variables with inconsistent numbers of samples: [{inputs}, {outputs}]")


def weights_of(sample_weight: Any, rows: int) -> np.ndarray | None:
    if sample_weight is None:
        return None
    weights, _ = read_column(sample_weight, name="sample_weight")
    if weights.ndim != 1:
        raise ValueError("Sample weights must be 1D array or scalar")
    if len(weights) != rows:
        raise ValueError(f"sample_weight.shape == {weights.shape}, expected {(rows,)}!")
    wrong = ~((weights >= 0) & (weights <= _core.largest_magnitude))
    if wrong.any():
        row = int(np.argmax(wrong))
        bound = f"from 0 to {_core.largest_magnitude:g}"
        raise ValueError(f"sample_weight of row {row} is {weights[row]:g}, it must be {bound}")
    if not weights.any():
        raise ValueError("sample_weight: all weights are zero")
    return weights


def names_of(table: Table) -> list[str]:
    if table.names is not None:
        return list(table.names)
    return [f"x{position}" for position in range(table.values.shape[1])]


def target_names(outputs: int) -> list[str]:
    return ["y"] if outputs == 1 else [f"y{position}" for position in range(outputs)]


def share(name: str, value: Any) -> float:
    number = float(value)
    if not 0.0 < number < 1.0:
        hint = f": {number / 100.0:g} for {number:g} %" if 1.0 < number < 100.0 else ""
        raise ValueError(f"{name} is {value!r}; it must lie between 0 and 1{hint}")
    return number


def count(name: str, value: Any) -> int:
    """A parameter that is a whole number of 0 or more; None is 0, which is the default."""
    if value is None:
        return 0
    try:
        number = int(value)
    except (TypeError, ValueError):
        number = -1
    if number < 0 or number != value:
        raise ValueError(f"{name} is {value!r}; it must be a whole number of 0 or more")
    return number


def seconds(name: str, value: Any) -> float:
    """A time above 0; None is 0, no limit."""
    if value is None:
        return 0.0
    number = float("nan") if isinstance(value, (bool, str)) else float(value)
    if not 0.0 < number < float("inf"):
        raise ValueError(f"{name} is {value!r}; it must be a number of seconds above 0, or None")
    return number


def spread(values: np.ndarray, most: int) -> np.ndarray:
    """At most so many rows as importance() looks at, evenly spaced."""
    rows = len(values)
    if rows <= most:
        return np.array(values)
    return np.array(values[[row * rows // most for row in range(most)]])
