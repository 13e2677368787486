"""What fitted estimators show: importance, curves, checks, and C."""

from typing import TYPE_CHECKING, Any

import numpy as np

if TYPE_CHECKING:
    from ._check import Check
    from .tables import Table

no_fit = "is not in a pickle or a file of the model: it needs the rows of the fit; fit again"


class Views:
    """The part of an estimator that explains and shows it; it only reads what `fit` has set."""

    if TYPE_CHECKING:
        summary_: dict[str, Any]
        _sample: np.ndarray
        _fit: Any
        _inputs: list[str]
        _outputs: list[str]

        def _model(self) -> Any: ...
        def _table(self, X: Any) -> Table: ...
        def _threads(self) -> int: ...

    @property
    def feature_importances_(self) -> np.ndarray:
        """How much each input moves the predictions over (at most 500 of) the training rows: shares of the mean absolute
        contribution, summing to 1; the mean over the targets."""
        return np.asarray(self._importances().mean(axis=0))

    def check(
        self,
        X: Any,
        y: Any = None,
        *,
        max_error: "float | list[float] | None" = None,
        level: float = 0.05,
        sample_weight: Any = None,
    ) -> "Check":
        """Whether the model is still good on new rows, and what of them changed, as `llmt check` says it: the error beside
        what held-out rows of the fit promise, intervals, leaves that got worse, inputs that are not as in training,
        unknown categories by name. Without `y` the verdict is "not evaluated", and the inputs are judged all the same.

        Parameters
        ----------
        X, y
            New rows and their targets.
        max_error : float or list of float, optional
            RMSE up to which the model is good, one a target; None: a tenth above the promised one, unless within chance.
        level : float
            Probability that something is said to have changed although nothing has.
        sample_weight : array-like, optional
            Weights of the rows, of a model that was fitted with weights.
        """
        from ._check import check

        return check(self, X, y, max_error, level, sample_weight)

    def summary(self, width: int = 100) -> str:
        """What was fitted, compared and chosen, as `llmt fit` prints it."""
        self._model()
        if self._fit is None:
            raise ValueError(f"summary() {no_fit}")
        text: str = self._fit.text("X", width)
        return text

    def plot_curve(self, name: str, ax: Any = None, at: Any = None, target: "str | int" = 0) -> Any:
        """The prediction along one input with its intervals. The others are at their means, categories at their commonest
        label in training; `at={"town": "Brno"}` gives other values."""
        from ._plots import plot_curve

        return plot_curve(self._model().handle, name, ax=ax, at=at, target=target, sample=self._sample)

    def plot_importance(self, ax: Any = None) -> Any:
        """The inputs by `feature_importances_`."""
        from ._plots import plot_importance

        return plot_importance(self._inputs, self._importances(), ax=ax)

    def to_c(self, name: str = "model") -> tuple[str, str]:
        """C99 source and header of a function NAME_predict; the same bytes as predict."""
        source, header = self._model().handle.to_c(name)
        return source, header

    def _importances(self) -> np.ndarray:
        return np.asarray(self._model().handle.importance(self._sample, self._threads()))

    def _position(self, target: "str | int") -> int:
        return self._outputs.index(target) if isinstance(target, str) else int(target)
