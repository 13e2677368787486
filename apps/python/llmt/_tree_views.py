"""What a fitted tree shows besides: leaves, rules, pictures, reports, and its model in other languages."""

import html
import json
from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

from ._views import Views, no_fit

if TYPE_CHECKING:
    from ._explanation import Explanation
    from ._model import Model

_no_page = (
    "this build of llmt has no page for reports: it was built without the packages that `cmake/setup report` fetches; "
    "plot() and _repr_html_() need none of them"
)


class TreeViews(Views):
    """The part of the estimator of one tree that explains and shows it."""

    if TYPE_CHECKING:
        model_: Model
        _mean: Any
        _is_readable: bool

    @property
    def leaves_(self) -> Any:
        """A row for each leaf: where it holds, rows, error, coefficients and their standard errors. A DataFrame where
        pandas is installed."""
        from ._frames import leaves_frame

        return leaves_frame(self._model().to_dict(), self._model().handle)

    @property
    def rules_(self) -> Any:
        """A row for each rule of a crisp model: condition, equation, rows and error. Raises ValueError for blends."""
        from ._frames import rules_frame

        return rules_frame(self._model().to_dict(), self._model().handle)

    @property
    def candidates_(self) -> Any:
        """What was tried, with held-out errors and their spread, what was chosen, and the mean as a baseline."""
        from ._frames import candidates_frame

        return candidates_frame(self._summary("candidates_"), self._mean, self._is_readable)

    @property
    def steps_(self) -> Any:
        """The readable trees that can be had, a row for each number of rules that pays: `target`, `rules`, `terms` of the
        longest rule, `size` of the expression, held-out `rmse` and its `spread`, `above_model`, the share of error above
        the most accurate model, and `taken`. `readable_rules=N` takes another one."""
        from ._frames import steps_frame

        return steps_frame(self._summary("steps_"))

    @property
    def curves_(self) -> Any:
        """Held-out errors over the number of leaves and of inputs, for each target."""
        from ._frames import curves

        return curves(self._summary("curves_"))

    @property
    def importance_(self) -> Any:
        """By how much the error on held-out rows grows without each input, the largest first for each target.

        Columns: `target`, `input`, `increase` of the RMSE when the input's values are exchanged between rows, and its
        `standard_error`; within two of them an increase is chance. The folds' models of the most accurate fit predict
        (docs/python/explain.md).
        """
        from ._frames import importance_frame

        return importance_frame(self._summary("importance_"))

    def permutation_importance(
        self, X: Any, y: Any, *, n_repeats: int = 5, random_state: int = 1, sample_weight: Any = None
    ) -> Any:
        """As `importance_`, of this model on rows that are given: such as the fit has not seen, for an honest answer."""
        from ._frames import importance_rows
        from ._regressor import check_rows, weights_of
        from .tables import read_targets

        table = self._table(X)
        outputs, _ = read_targets(y)
        check_rows(len(table.values), len(outputs))
        increase, errors = self._model().handle.permutation_importance(
            table.values,
            outputs.reshape(len(outputs), -1),
            weights_of(sample_weight, len(outputs)),
            n_repeats,
            random_state,
            self._threads(),
        )
        return importance_rows(self._outputs, self._inputs, increase, errors)

    def plot_importance(self, ax: Any = None, target: "str | int" = 0) -> Any:
        """The inputs by `importance_`, with whiskers of two standard errors; of a model without held-out rows by
        `feature_importances_`."""
        from ._plots import plot_importance, plot_increase

        of_target = self._increase(target)
        if of_target is None:
            return plot_importance(self._inputs, self._importances(), ax=ax)
        return plot_increase(*of_target, ax=ax, name=self._outputs[self._position(target)])

    def _increase(self, target: "str | int") -> "tuple[list[str], list[float], list[float]] | None":
        """Inputs, increases and standard errors of a target; None if nothing was held out."""
        self._model()
        name = self._outputs[self._position(target)]
        for partition in self.summary_.get("partitions", []):
            if name in partition["targets"] and "importance" in partition:
                rows = partition["importance"][partition["targets"].index(name)]
                return (
                    [row["input"] for row in rows],
                    [row["increase"] for row in rows],
                    [row["standard_error"] for row in rows],
                )
        return None

    def explain(self, X: Any) -> "Explanation":
        """Contributions of the inputs to each prediction; they add up to it.

        They are the Aumann-Shapley shares along the straight line from the mean of the training rows to the row
        (docs/algorithms). The result has the attributes of shap's explanations, so that `shap.plots` take it.
        """
        from ._explanation import explanation_of

        return explanation_of(self._model().handle, self._table(X).values)

    def report(self, path: "str | Path") -> None:
        """Writes the page of `llmt fit --report`: one HTML file that needs no network."""
        from ._files import write_text

        self._model()
        if self._fit is None:
            raise ValueError(f"report() {no_fit}")
        page = self._fit.page(Path(path).stem, "made with llmt from Python")
        if not page:
            raise ImportError(_no_page)
        write_text(path, page)

    def plot(self, ax: Any = None, target: "str | int" = 0) -> Any:
        """The tree with its equations (matplotlib). Returns the axes."""
        from ._plots import plot_tree

        return plot_tree(self._model().to_dict(), self.summary_ or None, ax=ax, target=target, readable=self._is_readable)

    def plot_all(self, target: "str | int" = 0) -> Any:
        """A figure of four: the tree, predicted against observed on held-out rows, the error over the number of leaves,
        and the importance of inputs. Returns the axes."""
        from ._plots import plot_all

        observed, predicted = self._held_out("plot_all()", target)
        return plot_all(
            self._model().to_dict(),
            self.summary_,
            self._inputs,
            self._increase(target) or self._importances(),
            observed,
            predicted,
            target,
            readable=self._is_readable,
        )

    def plot_predicted(self, ax: Any = None, target: "str | int" = 0) -> Any:
        """Predicted against observed, on rows that the predicting model had not seen."""
        from ._plots import plot_predicted

        observed, predicted = self._held_out("plot_predicted()", target)
        return plot_predicted(observed, predicted, ax=ax, name=self._outputs[self._position(target)])

    def plot_error(self, ax: Any = None, target: "str | int" = 0) -> Any:
        """The held-out error over the number of leaves."""
        from ._plots import plot_error_over_leaves

        return plot_error_over_leaves(
            self._summary("plot_error()"), ax=ax, target=target, readable=self._is_readable
        )

    def to_python(self, name: str = "predict") -> str:
        """Source of a Python function of one row that needs nothing but the standard library."""
        from .export import to_python

        return to_python(self._model().to_dict(), name)

    def to_plain(self, language: str = "python", name: str = "model") -> str:
        """A readable tree as plain `if` and equations that a person reads, in "c", "python" or "sql": a function
        NAME_TARGET(inputs) for each target, in SQL a query of the table NAME. Raises ValueError for other models, which
        are more than their rules."""
        languages = ("c", "python", "sql")
        if language not in languages:
            raise ValueError(f"language is {language!r}; it must be one of {', '.join(languages)}")
        if not (language == "sql" or (name.isidentifier() and name.isascii())):
            raise ValueError(f"name is {name!r}; it must be an identifier")
        try:
            text: str = self._model().handle.plain_source(language, name)
        except RuntimeError as error:
            raise ValueError(str(error)) from None
        return text

    def to_sql(self, table: str = "data", dialect: str = "postgresql", keep: "Sequence[str]" = ()) -> str:
        """A SELECT that predicts the rows of a table; `keep`: columns that it also gives. Dialects are those of
        `llmt.export.to_sql`."""
        from .export import to_sql

        return to_sql(self._model().to_dict(), table, dialect, keep)

    def to_onnx(self) -> Any:
        """An ONNX model of standard operators."""
        from .export import to_onnx

        return to_onnx(self._model().to_dict())

    def to_sympy(self) -> Any:
        """An expression of sympy, one for each target."""
        from .export import to_sympy

        return to_sympy(self._model().to_dict())

    def to_latex(self) -> str:
        """The rules as LaTeX."""
        from .export import to_latex

        return to_latex(self._model().to_dict())

    def __str__(self) -> str:
        if not hasattr(self, "model_"):
            return repr(self)
        from ._text import tree_text

        return tree_text(json.loads(self.model_.to_json()), self.summary_ or None, mean=self._mean, readable=self._is_readable)

    def _repr_html_(self) -> str:
        if not hasattr(self, "model_"):
            return f"<pre>{html.escape(repr(self))}</pre>"
        from ._html import tree_html

        return tree_html(json.loads(self.model_.to_json()), self.summary_ or None, mean=self._mean, readable=self._is_readable)

    def _summary(self, who: str) -> dict[str, Any]:
        self._model()
        if "partitions" not in self.summary_:
            raise ValueError(f"{who} is about the comparison that fit makes; partial_fit and model files have none")
        return self.summary_

    def _held_out(self, who: str, target: "str | int") -> tuple[list[float], list[float]]:
        self._model()
        if self._fit is None:
            raise ValueError(f"{who} {no_fit}")
        observed, predicted = self._fit.held_out_predictions(self._position(target))
        if not observed:
            raise ValueError(f"{who}: nothing was held out in the fit (cv=0)")
        return observed, predicted
