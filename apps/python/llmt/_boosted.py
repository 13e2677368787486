"""The estimator of a sum of trees."""

import json
import warnings
from collections.abc import Sequence
from typing import TYPE_CHECKING, Any, NoReturn

import numpy as np

from . import _core
from ._model import BoostedModel
from ._progress import Bar
from ._regressor import FitRows, TableRegressor, count, seconds, spread
from ._tree import level_names
from ._views import Views

if TYPE_CHECKING:
    from ._explanation import Explanation


class BoostedLocalLinearTreeRegressor(Views, TableRegressor):
    """A sum of many small local linear trees, each fitted to what the trees before it leave.

    More accurate than one tree where the target has many steps or interactions; nobody reads it. Which trees are taken
    and how many there are is decided by the error on rows that are held out; then the sum is fitted to all rows
    (docs/algorithms/boosting.md). A sum is fitted to each target.

    Inputs are those of `LocalLinearTreeRegressor`: numbers, words (categories by themselves; the rarest beyond 255 are
    not told from each other) and missing cells, in arrays and frames. What a sum has not: rules and equations, monotone
    inputs, a robust loss, learning from a stream, ONNX and SQL. `LocalLinearTreeRegressor` has them.

    Parameters
    ----------
    learning_rate : float or None, default=None
        Factor on every tree, above 0 and at most 1. None: 0.1 where the trees are soft, else 0.05 to
        0.1 by the number of rows (docs/algorithms/boosting.md).
    max_iter : int, default=2000
        Most trees of a target, before the sum is fitted to all rows with a quarter more.
    seeds : int, default=1
        The model is the mean of this many sums, whose splits look at other inputs each. Two are about 2 % more accurate
        in the mean of many tables; to fit and to predict takes as many times as long.
    time_limit : float or None, default=None
        Seconds that the fit may take: the model is the sum of the most trees that ends by then.
        `summary_["time_limit"]["max_rounds"]` given as `max_iter` makes the same model again.
    categorical_features : sequence of str or int, default=()
        Columns that are categories although they hold numbers. Columns of words are categories anyway.
    random_state : int, RandomState or None, default=None
        Seed of the rows that are held out and of the inputs that a split looks at. None is 1, so that the same rows give
        the same model.
    n_jobs : int or None, default=None
        Threads; None and -1: all that the process may use. The model does not depend on it.

    Attributes
    ----------
    model_ : BoostedModel
        What was fitted.
    n_features_in_ : int
    feature_names_in_ : ndarray of str
        Only where the table has names.
    n_outputs_ : int
    n_iter_ : int, or ndarray of int where y had two dimensions
        Trees of the sum, or of each target's.
    summary_ : dict
        What was compared and chosen, as `llmt fit --boost --json` prints it.

    Examples
    --------
    >>> import numpy as np
    >>> from llmt import BoostedLocalLinearTreeRegressor
    >>> X = np.linspace(0, 1, 200).reshape(-1, 1)
    >>> y = np.abs(X[:, 0] - 0.5)
    >>> BoostedLocalLinearTreeRegressor().fit(X, y).predict([[0.25], [0.75]]).round(2)
    array([0.25, 0.25])
    """

    _of_file = BoostedModel
    _where_rows = {
        "explain()": "give them as background",
        "partial_dependence()": "give them as X",
        "feature_importances_": "take the mean of abs(explain(X, background).values)",
    }
    _why_no_intervals = "fit it to at least 10 rows that differ"

    def __init__(
        self,
        *,
        learning_rate: float | None = None,
        max_iter: int = 2000,
        seeds: int = 1,
        time_limit: float | None = None,
        categorical_features: Sequence[str | int] = (),
        random_state: Any = None,
        n_jobs: int | None = None,
    ) -> None:
        self.learning_rate = learning_rate
        self.max_iter = max_iter
        self.seeds = seeds
        self.time_limit = time_limit
        self.categorical_features = categorical_features
        self.random_state = random_state
        self.n_jobs = n_jobs

    def _learn(self, rows: FitRows) -> None:
        options = self._options()
        with Bar() as bar:
            fitted = _core.boost(
                rows.table.values,
                rows.outputs,
                options,
                input_names=self._inputs,
                output_names=self._outputs,
                levels=rows.table.levels,
                weights=rows.weights,
                groups=rows.groups,
                held_out=rows.held_out,
                time_limit=seconds("time_limit", self.time_limit),
                report=bar,
            )
        self.model_ = BoostedModel.of_handle(fitted.model())
        self.summary_ = json.loads(fitted.summary("table"))
        self._fit = fitted
        if self.summary_["sums"][0]["variant"] == "mean":
            warnings.warn(
                "X has fewer than 10 rows that differ, too few for a sum of trees: the model is the mean of y. "
                "LocalLinearTreeRegressor takes so few",
                stacklevel=3,
            )

    def _robust(self) -> str:
        return 'LocalLinearTreeRegressor(loss="tukey")'

    @property
    def n_iter_(self) -> "int | np.ndarray":
        trees: list[int] = self._model().handle.trees()
        return trees[0] if self._is_flat else np.array(trees)

    def explain(self, X: Any, background: Any = None) -> "Explanation":
        """Contributions of the inputs to each prediction; they add up to it.

        They are the Shapley values of the inputs, where those that are not in a coalition have the values of the rows of
        `background`: interventional SHAP values, exact for these rows (docs/algorithms/explanation.md). The result has
        the attributes of shap's explanations, so that `shap.plots` take it.

        Parameters
        ----------
        X : table, (rows, columns)
            Rows to explain.
        background : table, (rows, columns), optional
            Rows to compare with, all of them: the time grows with their number. By default at most 100 rows of the fit,
            evenly spaced.

        Raises
        ------
        ValueError
            Without a background if the model was loaded from a file, which has no rows.
        """
        from ._explanation import explanation_of

        values = self._table(X).values
        rows = self._rows("explain()", 100) if background is None else self._table(background).values
        return explanation_of(self._model().handle, values, rows, self._threads())

    def partial_dependence(self, name: "str | int", at: Any = None, X: Any = None) -> tuple[np.ndarray, np.ndarray]:
        """The mean prediction over rows in which one input has the same value in all of them (Friedman 2001).

        Parameters
        ----------
        name : str or int
            Name or position of the input.
        at : sequence, optional
            Values, or labels of categories. By default 50 values over the range of training, or all categories.
        X : table, (rows, columns), optional
            The rows. By default at most 500 rows of the fit, evenly spaced.

        Returns
        -------
        values : ndarray, (values,)
            Labels where the input is categorical.
        predictions : ndarray, (values,), or (values, targets) where y had two dimensions
        """
        handle = self._model().handle
        position = self._column(name)
        column = handle.inputs()[position]
        levels = level_names(column)
        if at is None:
            at = levels or np.linspace(column["low"], column["high"], 50)
        if unknown := [label for label in at if levels and label not in levels]:
            raise ValueError(f"at: {unknown[0]!r} is no category of {column['name']!r}; there are {', '.join(levels)}")
        values = np.array([levels.index(label) if levels else label for label in at], dtype=float)
        rows = self._rows("partial_dependence()", 500) if X is None else self._table(X).values
        means = handle.partial_dependence(rows, position, values, self._threads())
        return np.array(list(at)), self._shaped(means)

    def to_onnx(self, *args: Any, **keywords: Any) -> NoReturn:
        """Raises ValueError: a sum is too large for a graph of ONNX's operators. `to_c` has all of it."""
        self._refuse("to_onnx()")

    def to_sql(self, *args: Any, **keywords: Any) -> NoReturn:
        """Raises ValueError: a sum is too large for a SELECT. `to_c` has all of it."""
        self._refuse("to_sql()")

    def __str__(self) -> str:
        if not hasattr(self, "model_"):
            return repr(self)
        text: str = self._model().handle.text("sum of trees", 100)
        return text

    def _refuse(self, who: str) -> NoReturn:
        trees, leaves, parameters = self._model().handle.size()
        raise ValueError(
            f"{who}: a sum of {trees} trees with {leaves} leaves and {parameters} parameters is too large to be written "
            "with its slopes and limits; to_c() writes it, and LocalLinearTreeRegressor, one tree, can be written"
        )

    def _importances(self) -> np.ndarray:
        return np.asarray(self._model().handle.importance(self._rows("feature_importances_", 500), self._threads()))

    def _rows(self, who: str, most: int) -> np.ndarray:
        """Rows of the fit, evenly spaced."""
        self._model()
        if len(self._sample) < 2:
            raise ValueError(f"{who} needs rows to compare with, and a model file has none: {self._where_rows[who]}")
        return spread(self._sample, most)

    def _column(self, name: "str | int") -> int:
        if not isinstance(name, str):
            position = int(name)
            if not 0 <= position < self.n_features_in_:
                raise ValueError(f"there is no input {position}; they are numbered from 0 to {self.n_features_in_ - 1}")
            return position
        if name not in self._inputs:
            raise ValueError(f"there is no input {name!r}; there are {', '.join(self._inputs)}")
        return self._inputs.index(name)

    def _options(self) -> dict[str, Any]:
        rate = 0.0 if self.learning_rate is None else float(self.learning_rate)
        if self.learning_rate is not None and not 0.0 < rate <= 1.0:
            raise ValueError(f"learning_rate is {self.learning_rate!r}; it must lie above 0 and be at most 1, or None")
        rounds = count("max_iter", self.max_iter)
        if rounds < 1:
            raise ValueError(f"max_iter is {self.max_iter!r}; it must be a whole number of 1 or more")
        seeds = count("seeds", self.seeds)
        if not 1 <= seeds <= 100:
            raise ValueError(f"seeds is {self.seeds!r}; it must be a whole number from 1 to 100")
        return {
            "rate": rate,
            "max_rounds": rounds,
            "seeds": seeds,
            "mean_of_few": True,
            "seed": self._seed(),
            "max_threads": self._threads(),
        }


__all__ = ["BoostedLocalLinearTreeRegressor"]
