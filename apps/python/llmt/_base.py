"""What the estimator inherits: scikit-learn's base classes, or the little of them that is needed without scikit-learn."""

import inspect
from typing import Any

import numpy as np

try:
    from sklearn.base import BaseEstimator, RegressorMixin
    from sklearn.exceptions import NotFittedError
except ImportError:

    class NotFittedError(ValueError, AttributeError):  # type: ignore[no-redef]
        """Raised where something is asked of an estimator before fit."""

    class BaseEstimator:  # type: ignore[no-redef]
        """Parameters by name, as scikit-learn has them."""

        @classmethod
        def _get_param_names(cls) -> list[str]:
            return sorted(name for name in inspect.signature(cls.__init__).parameters if name != "self")

        def get_params(self, deep: bool = True) -> dict[str, Any]:
            return {name: getattr(self, name) for name in self._get_param_names()}

        def set_params(self, **params: Any) -> "BaseEstimator":
            for name, value in params.items():
                if name not in self._get_param_names():
                    raise ValueError(
                        f"Invalid parameter {name!r} for estimator {type(self).__name__}. "
                        f"Valid parameters are: {self._get_param_names()!r}."
                    )
                setattr(self, name, value)
            return self

        def __repr__(self) -> str:
            defaults = inspect.signature(type(self).__init__).parameters
            given = [
                f"{name}={value!r}" for name, value in self.get_params().items() if defaults[name].default is not value
            ]
            return f"{type(self).__name__}({', '.join(given)})"

        def __getstate__(self) -> dict[str, Any]:
            return dict(self.__dict__)

        def __setstate__(self, state: dict[str, Any]) -> None:
            self.__dict__.update(state)

    class RegressorMixin:  # type: ignore[no-redef]
        """The score of regressors."""

        _estimator_type = "regressor"

        def score(self, X: Any, y: Any, sample_weight: Any = None) -> float:
            observed = np.asarray(y, dtype=float)
            predicted = self.predict(X)  # type: ignore[attr-defined]
            weights = np.ones(len(observed)) if sample_weight is None else np.asarray(sample_weight, dtype=float)
            mean = np.average(observed, axis=0, weights=weights)
            left = np.average((observed - predicted) ** 2, axis=0, weights=weights)
            all_ = np.average((observed - mean) ** 2, axis=0, weights=weights)
            return float(np.mean(1.0 - left / all_))


__all__ = ["BaseEstimator", "NotFittedError", "RegressorMixin"]
