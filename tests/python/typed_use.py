"""A program that uses the package, for mypy --strict in test_typing.py: it is read, not run."""

from typing import Any

import numpy as np
from numpy.typing import NDArray

import llmt
from llmt import BoostedLocalLinearTreeRegressor, LocalLinearTreeRegressor, Model


def held_out(inputs: NDArray[np.float64], outputs: NDArray[np.float64]) -> float:
    estimator = LocalLinearTreeRegressor(random_state=1).fit(inputs, outputs)
    predicted: NDArray[np.float64] = estimator.predict(inputs)
    return float(np.mean((predicted - outputs) ** 2))


def of_a_file(path: str) -> Any:
    version: str = llmt.__version__
    return version, Model.load(path)


def by_a_sum(inputs: NDArray[np.float64], outputs: NDArray[np.float64]) -> NDArray[np.float64]:
    estimator = BoostedLocalLinearTreeRegressor(learning_rate=0.1).fit(inputs, outputs)
    either = llmt.load("model.json")
    predicted: NDArray[np.float64] = either.predict(inputs)
    return predicted if estimator.n_iter_ is not None else estimator.explain(inputs, background=inputs).values
