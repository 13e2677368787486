"""The estimator of one tree."""

import json
import math
from collections.abc import Iterable, Mapping, Sequence
from typing import Any, Literal

import numpy as np

from . import _advice, _core
from ._frames import mean_baseline
from ._model import Model, StreamModel, TextModel
from ._progress import Bar
from ._regressor import FitRows, TableRegressor, check_rows, count, names_of, seconds, spread, target_names, weights_of
from ._tree_views import TreeViews
from .tables import Table, read_table, read_targets

# Beyond, a share of error was meant to be per cent.
_most_loss = 2.0


def _rules(value: Any) -> int:
    """A number of rules; None is 0, the default step."""
    if value is not None and (isinstance(value, bool) or count("readable_rules", value) == 0):
        raise ValueError(f"readable_rules is {value!r}; it must be a whole number of 1 or more, or None")
    return count("readable_rules", value)


class LocalLinearTreeRegressor(TreeViews, TableRegressor):
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
    readable_rules : int or None, default=None
        As `readable=True`, but of the readable trees the one with the most rules up to this number. `steps_` has them.
    teach : bool, default=False
        Fit the tree, and the readable one, to the answers of a sum of trees (`BoostedLocalLinearTreeRegressor`), on the
        rows and on rows made of them, if that lowers the held-out error. `summary_["teaching"]` has the errors of the
        tree alone, of the taught tree and of the sum. Takes several times as long.
    time_limit : float or None, default=None
        Seconds that the fit may take: the model is the tree of the most leaves that ends by then.
        `summary_["time_limit"]["max_leaves"]` given as `max_leaves` makes the same model again. A readable tree takes its
        own time.
    random_state : int, RandomState or None, default=None
        Seed of the folds, and of what teaches. None is 1, so that the same rows give the same model.
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

    _of_file = Model
    _why_no_intervals = "fit it with cv=5 (cv=0 holds nothing out, and partial_fit does not either)"

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
        readable_rules: int | None = None,
        teach: bool = False,
        time_limit: float | None = None,
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
        self.readable_rules = readable_rules
        self.teach = teach
        self.time_limit = time_limit
        self.random_state = random_state
        self.n_jobs = n_jobs

    def _learn(self, rows: FitRows) -> None:
        labels = rows.groups
        options = self._options(rows.table)
        if not isinstance(self.cv, (int, np.integer)) and not rows.held_out:
            options["folds.count"], labels = _given_folds(self.cv, *rows.given, rows.fitted)
        with Bar() as bar:
            fitted = _core.fit(
                rows.table.values,
                rows.outputs,
                options,
                input_names=self._inputs,
                output_names=self._outputs,
                levels=rows.table.levels,
                weights=rows.weights,
                groups=labels,
                held_out=rows.held_out,
                may_have_codes=bool(self.integer_codes),
                readable_loss=self._readable_loss(),
                readable_rules=_rules(self.readable_rules),
                teach=bool(self.teach),
                time_limit=seconds("time_limit", self.time_limit),
                report=bar,
            )
        if self.loss == "squared":
            _advice.warn_of_gross_errors(fitted, rows.outputs, self._outputs, stacklevel=4)
        self.accurate_model_ = Model(fitted.model())
        readable = fitted.readable()
        self.model_ = self.accurate_model_ if readable is None else Model(readable)
        self.summary_ = json.loads(fitted.summary("table"))
        self._is_readable = readable is not None
        self._mean = mean_baseline(rows.outputs, fitted.held_out(), rows.weights)
        self._fit = fitted
        self._stream: StreamModel | None = None

    def _robust(self) -> str:
        return 'loss="tukey"' if self.loss == "squared" else ""

    def partial_fit(self, X: Any, y: Any, sample_weight: Any = None) -> "LocalLinearTreeRegressor":
        """Learns from further rows as they come, in memory that does not depend on their number.

        The tree is grown by a stream's rules (docs/algorithms), not by `fit`; a call after `fit` starts anew. Inputs
        are numbers. A stream takes the parameters `max_leaves`, `min_samples_leaf` and `validity`; `n_jobs`,
        `random_state`, `select_features` and `integer_codes` change nothing.

        Raises
        ------
        ValueError
            For rows that cannot be learned from, and for any other parameter whose value is not its default.
        """
        with self._learning():
            stream: StreamModel | None = getattr(self, "_stream", None)
            if stream is not None:
                table = read_table(X, levels=self._levels, fitted_names=self._fitted_names())
            else:
                table = read_table(X)
            outputs, names = read_targets(y)
            check_rows(len(table.values), len(outputs))
            for name, levels in zip(names_of(table), table.levels, strict=True):
                if levels:
                    raise ValueError(f'column "{name}" has words; partial_fit learns from numbers')
            self._refuse_others("is not for streams")
            options = self._options()
            if stream is None:
                self._remember_columns(table)
                self._is_flat = outputs.ndim == 1
                self.n_outputs_ = 1 if outputs.ndim == 1 else outputs.shape[1]
                self._inputs = names_of(table)
                self._outputs = names or target_names(self.n_outputs_)
                self._levels = table.levels
                stream = self._stream = StreamModel(self.n_features_in_, self.n_outputs_, options)
            elif stream.options and {**options, "validity": ""} != {**stream.options, "validity": ""}:
                raise ValueError(
                    "parameters have changed since the first partial_fit; a clone of the estimator begins anew"
                )
            outputs = outputs.reshape(len(outputs), -1)
            if outputs.shape[1] != self.n_outputs_:
                raise ValueError(f"y has {outputs.shape[1]} targets, the rows before had {self.n_outputs_}")
            stream.handle.add(table.values, outputs, weights_of(sample_weight, len(outputs)))
            self._sample = spread(table.values, 500)
            self._take_stream(stream)
        return self

    def merge(self, other: "LocalLinearTreeRegressor") -> "LocalLinearTreeRegressor":
        """Adds what another estimator learned by `partial_fit` from other rows, which this one need not see.

        Both must have learned from the same columns with the same parameters. Shards of a table are so learned apart,
        by any number of processes, and merged in pairs.
        """
        with self._learning():
            own: StreamModel | None = getattr(self, "_stream", None)
            given: StreamModel | None = getattr(other, "_stream", None)
            if own is None or given is None:
                raise ValueError("merge needs two estimators that have learned by partial_fit")
            if self._inputs != other._inputs or self._outputs != other._outputs:
                raise ValueError(
                    f"columns {self._inputs} and targets {self._outputs} do not go with {other._inputs} and "
                    f"{other._outputs}"
                )
            own.handle.merge(given.handle)
            self._take_stream(own)
        return self

    def _take_stream(self, stream: StreamModel) -> None:
        self.model_ = Model(stream.handle.model(self._inputs, self._outputs, self.validity))
        self.summary_ = {"rows": stream.handle.rows(), "rmse": stream.handle.prequential_rmse()}
        self._fit = self._mean = None
        self._is_readable = False

    def predict_standard_error(self, X: Any) -> np.ndarray:
        """Standard errors of the local models' means, shaped as predictions; for intervals: predict_interval."""
        return self._shaped(self._model().handle.standard_errors(self._table(X).values, self._threads()))

    def apply(self, X: Any) -> np.ndarray:
        """The leaf of every row: its position in `leaves_`, (rows,), or (rows, trees) where there are several."""
        leaves: np.ndarray = self._model().handle.leaf_of(self._table(X).values, self._threads())
        return leaves[:, 0] if leaves.shape[1] == 1 else leaves

    def _take_model(self, model: TextModel) -> None:
        super()._take_model(model)
        self.accurate_model_ = self.model_
        self._mean = self._stream = None
        self._is_readable = False

    def _readable_loss(self) -> float | None:
        if self.readable is False and self.readable_rules is None:
            return None
        if isinstance(self.readable, (bool, np.bool_)):
            return 0.15
        try:
            loss = float(self.readable)
        except (TypeError, ValueError):
            loss = math.nan
        if not 0.0 <= loss <= _most_loss:
            hint = f": {loss / 100.0:g} for {loss:g} %" if loss > _most_loss else ""
            raise ValueError(
                f"readable is {self.readable!r}; it must be True, False or a share of error from 0 to {_most_loss:g}{hint}"
            )
        return loss

    def _options(self, table: Table | None = None) -> dict[str, Any]:
        """The options of a fit by the library's names. Without a table, signs are those of no particular columns.

        A parameter that is no option as it stands has a method _read_NAME.
        """
        options = {}
        for field in _core.fit_fields():
            if name := field["parameter"]:
                read = getattr(self, f"_read_{name}", None)
                options[field["name"]] = read(table) if read else _value(field, getattr(self, name))
        return options

    def _refuse_others(self, sentence: str) -> None:
        """Refuses parameters that the library does not have as options of a fit, and that were given.

        `integer_codes` says something of the data; who calls this takes it.
        """
        options = {"integer_codes"} | {field["parameter"] for field in _core.fit_fields()}
        for name, given in self.get_params(deep=False).items():
            is_off = given is None or (isinstance(given, (bool, np.bool_)) and not given)
            is_empty = is_off or (hasattr(given, "__len__") and len(given) == 0)
            if name not in options and not is_empty:
                raise ValueError(f"{name} {sentence}")

    def _read_cv(self, table: Table | None) -> int:
        if table is None and not isinstance(self.cv, (int, np.integer)):
            raise ValueError("cv must be a number of folds here; only fit takes rows that were dealt by hand")
        return _folds(self.cv)

    def _read_contiguous(self, table: Table | None) -> str:
        if self.contiguous and not isinstance(self.cv, (int, np.integer)):
            raise ValueError("contiguous is for a number of folds; here cv deals the rows itself")
        return "contiguous" if self.contiguous else "random"

    def _read_random_state(self, table: Table | None) -> int:
        return self._seed()

    def _read_n_jobs(self, table: Table | None) -> int:
        return self._threads()

    def _read_monotonic_cst(self, table: Table | None) -> list[str]:
        if self.monotonic_cst is None:
            return []
        given = self.monotonic_cst
        if table is not None:
            signs = _signs(given, self._inputs, table)
        else:
            signs = [int(any(given.values() if isinstance(given, Mapping) else given))]
        return [{-1: "falling", 0: "any", 1: "rising"}[sign] for sign in signs]


def _value(field: dict[str, Any], given: Any) -> Any:
    """A parameter as the option that it is: a switch, a count or one of some choices."""
    if field["kind"] == "switch":
        return bool(given)
    if field["kind"] == "count":
        return count(field["parameter"], given)
    if given not in field["choices"]:
        raise ValueError(f"{field['parameter']} is {given!r}; it must be one of {', '.join(field['choices'])}")
    return given


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


def _folds(cv: Any) -> int:
    """The number of folds; 5 where `cv` deals them itself."""
    if not isinstance(cv, (int, np.integer)):
        return 5
    folds = count("cv", cv)
    if folds == 1:
        raise ValueError("cv is 1; it must be 2 folds or more, or 0 to hold nothing out")
    return folds


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


__all__ = ["LocalLinearTreeRegressor"]
