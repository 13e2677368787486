"""Local linear model trees: regression models that can be read.

>>> import numpy as np
>>> from llmt import LocalLinearTreeRegressor
>>> X = np.random.default_rng(0).uniform(-1, 1, (300, 2))
>>> y = np.where(X[:, 0] > 0, 3 * X[:, 1], 1.0)
>>> model = LocalLinearTreeRegressor().fit(X, y)
>>> model.predict([[0.5, 0.5], [-0.5, 0.5]]).round(1)
array([1.5, 1. ])

NumPy is all that it needs. scikit-learn, pandas, polars, pyarrow, matplotlib, shap, onnx and Dask are used where they
are installed; none of them is imported before something is called that needs it.
"""

from importlib import import_module
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from ._boosted import BoostedLocalLinearTreeRegressor as BoostedLocalLinearTreeRegressor
    from ._dynamic import DynamicLocalLinearTreeRegressor as DynamicLocalLinearTreeRegressor
    from ._discover import Missing as Missing
    from ._discover import discover as discover
    from ._discover import find_missing as find_missing
    from ._found import Found as Found
    from ._found import load_found as load_found
    from ._given import Parameter as Parameter
    from ._estimator import LocalLinearTreeRegressor as LocalLinearTreeRegressor
    from ._load import load as load
    from ._model import BoostedModel as BoostedModel
    from ._model import Model as Model
    from ._signals import Signals as Signals
    from ._signals import signals as signals

    __version__: str

# Where each public name is defined; the module is imported when the name is asked for.
_homes = {
    "BoostedLocalLinearTreeRegressor": "_boosted",
    "BoostedModel": "_model",
    "DynamicLocalLinearTreeRegressor": "_dynamic",
    "Found": "_found",
    "LocalLinearTreeRegressor": "_estimator",
    "Missing": "_discover",
    "Model": "_model",
    "Parameter": "_given",
    "Signals": "_signals",
    "__version__": "_core",
    "discover": "_discover",
    "find_missing": "_discover",
    "load": "_load",
    "load_found": "_found",
    "signals": "_signals",
}

__all__ = [
    "BoostedLocalLinearTreeRegressor",
    "BoostedModel",
    "DynamicLocalLinearTreeRegressor",
    "Found",
    "LocalLinearTreeRegressor",
    "Missing",
    "Model",
    "Parameter",
    "Signals",
    "__version__",
    "discover",
    "find_missing",
    "load",
    "load_found",
    "signals",
]


def __getattr__(name: str) -> object:
    home = _homes.get(name)
    if home is None:
        raise AttributeError(f"module 'llmt' has no attribute {name!r}")
    value = getattr(import_module(f"llmt.{home}"), name)
    globals()[name] = value
    return value


def __dir__() -> list[str]:
    return sorted({*__all__, *(name for name in globals() if name.startswith("__"))})
