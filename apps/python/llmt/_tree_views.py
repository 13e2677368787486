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
    def curves_(self) -> Any:
        """Held-out errors over the number of leaves and of inputs, for each target."""
        from ._frames import curves

        return curves(self._summary("curves_"))

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
            self._importances(),
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
