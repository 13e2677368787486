"""The estimator."""

import json
import os
import warnings
from collections.abc import Iterable, Mapping, Sequence
from typing import Any, Literal

import numpy as np

from . import _advice, _core
from ._base import BaseEstimator, NotFittedError, RegressorMixin
from ._frames import mean_baseline
from ._model import Model, StreamModel
from ._progress import Bar
from ._views import Views
from .tables import Table, read_column, read_table, read_targets, row_labels

_most_seeds = 2**31
_choices = {
    "rule": ("rd", "retis", "ra", "m5", "lolimot", "lolimot-data", "hilomot"),
    "validity": ("auto", "crisp", "blend", "gaussian"),
    "local_models": ("linear", "quadratic", "auto"),
    "sparse": ("never", "auto", "always"),
    "loss": ("squared", "tukey"),
}


class LocalLinearTreeRegressor(Views, RegressorMixin, BaseEstimator):
    """A regression tree with a linear equation in every leaf, which may blend smoothly into its neighbours.

    The tree cuts the input space into boxes; in every box the prediction is an affine function of the inputs. How many
    leaves there are, whether they meet in jumps or in smooth transitions, and which inputs are left out is decided by
    the error on rows that were held out.

    Inputs may be numbers, words (categories by themselves) and missing (NaN, None, null). Tables are NumPy arrays,
    frames of pandas and polars, tables of pyarrow, and whatever gives an Arrow stream.

    Parameters
    ----------
    max_leaves : int or None, default=None
        Most leaves of a tree. None or 0: 300, fewer for few rows.
    min_samples_leaf : int or None, default=None
        Fewest rows in a leaf. None or 0: depends on the number of inputs.
    rule : {"rd", "retis", "ra", "m5", "lolimot", "lolimot-data", "hilomot"}, default="rd"
        How the tree is grown.
    validity : {"auto", "crisp", "blend", "gaussian"}, default="auto"
        How leaves meet: crisp at their borders, in smooth blends, as normalised Gaussians, or the better of the first
        two.
    local_models : {"linear", "quadratic", "auto"}, default="linear"
        Whether local models have products and squares of the inputs.
    sparse : {"never", "auto", "always"}, default="never"
        Whether local models keep only the slopes that forward selection takes.
    loss : {"squared", "tukey"}, default="squared"
        "tukey" leaves out rows far from a preliminary tree.
    cv : int, splitter or iterable of (train, test), default=5
        Folds of the held-out error by which everything is chosen. 0: the tree stays as it was grown. A splitter of
        scikit-learn or a list of row indices must hold out every row once.
    contiguous : bool, default=False
        Folds are blocks of consecutive rows, for time series and measured paths.
    select_features : bool, default=True
        Leave out inputs where that lowers the held-out error beyond chance.
    integer_codes : bool, default=True
        Take inputs of few whole numbers for categories where that lowers the held-out error.
    categorical_features : sequence of str or int, default=()
        Columns that are categories although they hold numbers. Columns of words are categories anyway.
    monotonic_cst : dict, sequence of int or None, default=None
        1: the prediction never falls as the input rises; -1: it never rises; 0: anything. By names or positions of
        columns.
    shared_tree : bool, default=False
        One tree for all targets instead of one each.
    readable : bool or float, default=False
        Predict by the smallest crisp tree with short, rounded equations whose held-out error is at most 15 % (or this
        share) above that of the best crisp tree.
    random_state : int, RandomState or None, default=None
        Seed of the folds. None is 1, so that the same rows give the same model.
    n_jobs : int or None, default=None
        Threads; None and -1: all that the process may use. The model does not depend on it.

    Attributes
    ----------
    model_ : Model
        What was fitted.
    n_features_in_ : int
    feature_names_in_ : ndarray of str
        Only where the table has names.
    n_outputs_ : int
    summary_ : dict
        What was compared and chosen, as `llmt fit --json` prints it.

    Examples
    --------
    >>> import numpy as np
    >>> from llmt import LocalLinearTreeRegressor
    >>> X = np.linspace(0, 1, 200).reshape(-1, 1)
    >>> y = np.abs(X[:, 0] - 0.5)
    >>> LocalLinearTreeRegressor(validity="crisp").fit(X, y).predict([[0.25], [0.75]]).round(2)
    array([0.25, 0.25])
    """

    def __init__(
        self,
        *,
        max_leaves: int | None = None,
        min_samples_leaf: int | None = None,
        rule: str = "rd",
        validity: Literal["auto", "crisp", "blend", "gaussian"] = "auto",
        local_models: Literal["linear", "quadratic", "auto"] = "linear",
        sparse: Literal["never", "auto", "always"] = "never",
        loss: Literal["squared", "tukey"] = "squared",
        cv: Any = 5,
        contiguous: bool = False,
        select_features: bool = True,
        integer_codes: bool = True,
        categorical_features: Sequence[str | int] = (),
        monotonic_cst: Mapping[str, int] | Sequence[int] | None = None,
        shared_tree: bool = False,
        readable: bool | float = False,
        random_state: Any = None,
        n_jobs: int | None = None,
    ) -> None:
        self.max_leaves = max_leaves
        self.min_samples_leaf = min_samples_leaf
        self.rule = rule
        self.validity = validity
        self.local_models = local_models
        self.sparse = sparse
        self.loss = loss
        self.cv = cv
        self.contiguous = contiguous
        self.select_features = select_features
        self.integer_codes = integer_codes
        self.categorical_features = categorical_features
        self.monotonic_cst = monotonic_cst
        self.shared_tree = shared_tree
        self.readable = readable
        self.random_state = random_state
        self.n_jobs = n_jobs

    def fit(
        self, X: Any, y: Any, sample_weight: Any = None, groups: Any = None, eval_set: Any = None
    ) -> "LocalLinearTreeRegressor":
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
            Choose by the error on these rows in the place of folds. They do not enter the model.

        Raises
        ------
        ValueError, TypeError
            For what cannot be learned from; the message names the column or the parameter.
        """
        table = read_table(X, categorical=self.categorical_features)
        outputs, names = read_targets(y)
        _check_rows(len(table.values), len(outputs))
        rows = len(outputs)
        self.n_outputs_ = 1 if outputs.ndim == 1 else outputs.shape[1]
        self._is_flat = outputs.ndim == 1
        outputs = outputs.reshape(rows, -1)
        weights = _weights_of(sample_weight, rows)
        labels = None if groups is None else row_labels(groups, rows)
        self._inputs = _names_of(table)
        self._outputs = names or _target_names(self.n_outputs_)
        self._levels = table.levels
        held_out: list[int] = []
        if eval_set is not None:
            if groups is not None:
                raise ValueError("groups deal folds, and eval_set takes their place: give one of them")
            values, judged = self._evaluation(eval_set, table, outputs)
            held_out = list(range(rows, rows + len(judged)))
            table = Table(np.vstack([table.values, values]), table.names, table.levels, table.unknown)
            outputs = np.vstack([outputs, judged])
            weights = None if weights is None else np.concatenate([weights, np.ones(len(judged))])
        meant = {str(name) for name in self.categorical_features}
        _advice.warn_of_accidental_inputs(table, meant, stacklevel=3)
        _advice.check_targets(outputs, self._outputs, self.loss != "squared", stacklevel=4)
        _advice.warn_of_few_rows(rows, stacklevel=3)
        options = self._options(table)
        if not isinstance(self.cv, (int, np.integer)) and not held_out:
            options["folds"], labels = _given_folds(self.cv, X, y, groups, rows)
        with Bar() as bar:
            fitted = _core.fit(
                table.values,
                outputs,
                options,
                input_names=self._inputs,
                output_names=self._outputs,
                levels=table.levels,
                weights=weights,
                groups=labels,
                held_out=held_out,
                may_have_codes=bool(self.integer_codes),
                readable_loss=self._readable_loss(),
                report=bar,
            )
        if self.loss == "squared":
            _advice.warn_of_gross_errors(fitted, outputs, self._outputs, stacklevel=3)
        self._remember_columns(table)
        self.accurate_model_ = Model(fitted.model())
        readable = fitted.readable()
        self.model_ = self.accurate_model_ if readable is None else Model(readable)
        self.summary_ = json.loads(fitted.summary("table"))
        self._is_readable = readable is not None
        self._mean = mean_baseline(outputs, fitted.held_out(), weights)
        self._sample = _spread(table.values[:rows], 500)
        self._fit = fitted
        self._stream: StreamModel | None = None
        return self

    def partial_fit(self, X: Any, y: Any, sample_weight: Any = None) -> "LocalLinearTreeRegressor":
        """Learns from further rows as they come, in memory that does not depend on their number.

        The tree is grown by a stream's rules (docs/algorithms), not by `fit`; a call after `fit` starts anew. Inputs
        are numbers. Parameters that are not for streams are not used.
        """
        stream: StreamModel | None = getattr(self, "_stream", None)
        if stream is not None:
            table = read_table(X, levels=self._levels, fitted_names=self._fitted_names())
        else:
            table = read_table(X)
        outputs, names = read_targets(y)
        _check_rows(len(table.values), len(outputs))
        for name, levels in zip(_names_of(table), table.levels, strict=True):
            if levels:
                raise ValueError(f'column "{name}" has words; partial_fit learns from numbers')
        if stream is None:
            self._remember_columns(table)
            self._is_flat = outputs.ndim == 1
            self.n_outputs_ = 1 if outputs.ndim == 1 else outputs.shape[1]
            self._inputs = _names_of(table)
            self._outputs = names or _target_names(self.n_outputs_)
            self._levels = table.levels
            options = {
                "max_leaves": _count("max_leaves", self.max_leaves),
                "min_leaf_samples": _count("min_samples_leaf", self.min_samples_leaf),
            }
            stream = self._stream = StreamModel(self.n_features_in_, self.n_outputs_, options)
        outputs = outputs.reshape(len(outputs), -1)
        if outputs.shape[1] != self.n_outputs_:
            raise ValueError(f"y has {outputs.shape[1]} targets, the rows before had {self.n_outputs_}")
        stream.handle.add(table.values, outputs, _weights_of(sample_weight, len(outputs)))
        self.model_ = Model(stream.handle.model(self._inputs, self._outputs))
        self.summary_ = {"rows": stream.handle.rows(), "rmse": stream.handle.prequential_rmse()}
        self._sample = _spread(table.values, 500)
        self._fit = self._mean = None
        self._is_readable = False
        return self

    def predict(self, X: Any) -> np.ndarray:
        """Predictions, (rows,), or (rows, targets) where y had two dimensions."""
        return self._shaped(self._model().handle.predict(self._table(X).values, self._threads()))

    def predict_interval(self, X: Any, coverage: float = 0.9) -> np.ndarray:
        """Intervals that hold the share `coverage` of the targets (CV+, Barber et al. 2021).

        Returns
        -------
        ndarray, (rows, 2), or (rows, 2, targets) where y had two dimensions
            Lower and upper ends.

        Raises
        ------
        ValueError
            If nothing was held out in the fit (cv=0), or too few rows for the coverage.

        Warns
        -----
        UserWarning
            Of rows outside of the training ranges, for which no interval is honest. `check` says where they are.
        """
        handle = self._model().handle
        level = _share("coverage", coverage)
        if not handle.has_intervals:
            raise ValueError(
                "predict_interval needs rows that were held out, and this model has none: fit it with cv=5 (cv=0 holds "
                "nothing out, and partial_fit does not either)"
            )
        values = self._table(X).values
        lower, upper, _ = handle.intervals(values, level, self._threads())
        outside = np.flatnonzero(handle.extrapolation(values, self._threads())[:, 0] > 0)
        if len(outside):
            warnings.warn(
                f"{len(outside)} of {len(values)} rows lie outside of the training ranges, the first is row {outside[0]}: "
                "their intervals are not to be believed; check(X) names the columns",
                stacklevel=2,
            )
        ends = np.stack([lower, upper], axis=1)
        return ends[:, :, 0] if self._is_flat else ends

    def predict_standard_error(self, X: Any) -> np.ndarray:
        """Standard errors of the local models' means, shaped as predictions; for intervals: predict_interval."""
        return self._shaped(self._model().handle.standard_errors(self._table(X).values, self._threads()))

    def apply(self, X: Any) -> np.ndarray:
        """The leaf of every row: its position in `leaves_`, (rows,), or (rows, trees) where there are several."""
        leaves = self._model().handle.leaf_of(self._table(X).values, self._threads())
        return leaves[:, 0] if leaves.shape[1] == 1 else leaves

    def to_json(self) -> str:
        """The model as JSON text, as `llmt fit -o` writes it."""
        return self._model().to_json()

    def save(self, path: "str | os.PathLike[str]") -> None:
        """Writes the model file that `llmt predict` and `load` read."""
        self._model().save(path)

    @classmethod
    def load(cls, path: "str | os.PathLike[str]") -> "LocalLinearTreeRegressor":
        """An estimator with the model of a file. What belongs to the fit alone, such as summary_, is not in files."""
        return cls()._take_model(Model.load(path))

    def _take_model(self, model: Model) -> "LocalLinearTreeRegressor":
        columns = model.handle.inputs()
        self.model_ = self.accurate_model_ = model
        self._inputs = [column["name"] for column in columns]
        self._outputs = model.handle.outputs()
        self._levels = [list(column["levels"]) if not column["codes"] else [] for column in columns]
        self.n_features_in_ = len(columns)
        self.feature_names_in_ = np.asarray(self._inputs, dtype=object)
        self.n_outputs_ = len(self._outputs)
        self._is_flat = self.n_outputs_ == 1
        self._fit = self._mean = None
        self._stream = None
        self._is_readable = False
        self._sample = np.array([[column["centre"] for column in columns]])
        self.summary_ = {}
        return self

    def __getstate__(self) -> dict[str, Any]:
        state = dict(super().__getstate__())
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

    def _evaluation(self, given: Any, table: Table, outputs: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Inputs and targets of an eval_set, read as the training rows were."""
        if len(given) == 1 and len(given[0]) == 2:  # a list of one pair, as boosters take it
            given = given[0]
        if len(given) != 2:
            raise ValueError("eval_set must be a pair (X, y)")
        X, y = given
        rows = read_table(X, levels=table.levels, fitted_names=table.names, name="eval_set[0]").values
        judged, _ = read_targets(y)
        _check_rows(len(rows), len(judged))
        judged = judged.reshape(len(judged), -1)
        if judged.shape[1] != outputs.shape[1]:
            raise ValueError(f"eval_set has {judged.shape[1]} targets, y has {outputs.shape[1]}")
        return rows, judged

    def _model(self) -> Model:
        if not hasattr(self, "model_"):
            raise NotFittedError(
                f"This {type(self).__name__} instance is not fitted yet. Call 'fit' with appropriate arguments before "
                "using this estimator."
            )
        model: Model = self.model_
        return model

    def _table(self, X: Any) -> Table:
        self._model()
        return read_table(X, levels=self._levels, fitted_names=self._fitted_names())

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
        return _count("n_jobs", self.n_jobs)

    def _readable_loss(self) -> float | None:
        if self.readable is False:
            return None
        return 0.15 if self.readable is True else float(self.readable)

    def _seed(self) -> int:
        if self.random_state is None:
            return 1
        if isinstance(self.random_state, np.random.RandomState):
            return int(self.random_state.randint(_most_seeds))
        return _count("random_state", self.random_state)

    def _options(self, table: Table) -> dict[str, Any]:
        options = self._options_without_columns()
        if self.monotonic_cst is not None:
            options["trends"] = _signs(self.monotonic_cst, self._inputs, table)
        return options

    def _options_without_columns(self) -> dict[str, Any]:
        for name, choices in _choices.items():
            if getattr(self, name) not in choices:
                raise ValueError(f"{name} is {getattr(self, name)!r}; it must be one of {', '.join(choices)}")
        return {
            "max_leaves": _count("max_leaves", self.max_leaves),
            "min_leaf_samples": _count("min_samples_leaf", self.min_samples_leaf),
            "rule": self.rule,
            "validity": self.validity,
            "terms": self.local_models,
            "sparse": self.sparse,
            "loss": self.loss,
            "folds": _folds(self.cv),
            "contiguous": bool(self.contiguous),
            "seed": self._seed(),
            "choose_inputs": bool(self.select_features),
            "shared_partition": bool(self.shared_tree),
            "max_threads": self._threads(),
        }


def _check_rows(inputs: int, outputs: int) -> None:
    if inputs != outputs:
        raise ValueError(f"Found input variables with inconsistent numbers of samples: [{inputs}, {outputs}]")


def _weights_of(sample_weight: Any, rows: int) -> np.ndarray | None:
    if sample_weight is None:
        return None
    weights, _ = read_column(sample_weight, name="sample_weight")
    if weights.ndim != 1:
        raise ValueError("Sample weights must be 1D array or scalar")
    if len(weights) != rows:
        raise ValueError(f"sample_weight.shape == {weights.shape}, expected {(rows,)}!")
    if not np.isfinite(weights).all() or (weights < 0).any():
        raise ValueError("sample_weight: weights must be finite and not negative")
    if not weights.any():
        raise ValueError("sample_weight: all weights are zero")
    return weights


def _given_folds(cv: Any, X: Any, y: Any, groups: Any, rows: int) -> tuple[int, np.ndarray]:
    """Folds that the user dealt, as groups: with as many groups as folds each group is a fold."""
    if isinstance(cv, str) or not (hasattr(cv, "split") or isinstance(cv, Iterable)):
        raise ValueError(f"cv is {cv!r}; it must be a whole number, a splitter or a list of (train, test)")
    splits = list(cv.split(X, y, groups) if hasattr(cv, "split") else cv)
    labels = np.full(rows, np.nan)
    for fold, (_, test) in enumerate(splits):
        if not np.isnan(labels[test]).all():
            raise ValueError("cv: a row is held out in two folds; every row must be held out once")
        labels[test] = fold
    if len(splits) < 2 or np.isnan(labels).any():
        raise ValueError("cv: there must be two folds or more that hold out every row once")
    return len(splits), labels


def _names_of(table: Table) -> list[str]:
    if table.names is not None:
        return list(table.names)
    return [f"x{position}" for position in range(table.values.shape[1])]


def _target_names(outputs: int) -> list[str]:
    return ["y"] if outputs == 1 else [f"y{position}" for position in range(outputs)]


def _share(name: str, value: Any) -> float:
    share = float(value)
    if not 0.0 < share < 1.0:
        hint = f": {share / 100.0:g} for {share:g} %" if 1.0 < share < 100.0 else ""
        raise ValueError(f"{name} is {value!r}; it must lie between 0 and 1{hint}")
    return share


def _folds(cv: Any) -> int:
    """The number of folds; 5 where `cv` deals them itself."""
    if not isinstance(cv, (int, np.integer)):
        return 5
    count = _count("cv", cv)
    if count == 1:
        raise ValueError("cv is 1; it must be 2 folds or more, or 0 to hold nothing out")
    return count


def _count(name: str, value: Any) -> int:
    """A parameter that is a whole number of 0 or more; None is 0, which is the default."""
    if value is None:
        return 0
    try:
        count = int(value)
    except (TypeError, ValueError):
        count = -1
    if count < 0 or count != value:
        raise ValueError(f"{name} is {value!r}; it must be a whole number of 0 or more")
    return count


def _signs(given: Mapping[str, int] | Sequence[int], names: list[str], table: Table) -> list[int]:
    if isinstance(given, Mapping):
        for name in given:
            if name not in names:
                raise ValueError(f"monotonic_cst names {name!r}, which is no column; the columns are {', '.join(names)}")
        signs = [int(given.get(name, 0)) for name in names]
    else:
        signs = [int(sign) for sign in given]
        if len(signs) != len(names):
            raise ValueError(f"monotonic_cst has {len(signs)} entries for {len(names)} columns")
    for name, sign, levels in zip(names, signs, table.levels, strict=True):
        if sign not in (-1, 0, 1):
            raise ValueError(f"monotonic_cst of {name!r} is {sign}; it must be -1, 0 or 1")
        if sign and levels:
            raise ValueError(f"monotonic_cst names {name!r}, which is categorical")
    return signs


def _spread(values: np.ndarray, most: int) -> np.ndarray:
    """At most so many rows as importance() looks at, evenly spaced."""
    rows = len(values)
    if rows <= most:
        return np.array(values)
    return np.array(values[[row * rows // most for row in range(most)]])


__all__ = ["LocalLinearTreeRegressor"]
