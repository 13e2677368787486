"""A fit that ends within a time, and the parameter that makes the same model without one."""

import numpy as np
import pytest

from llmt import BoostedLocalLinearTreeRegressor, LocalLinearTreeRegressor

X = np.random.default_rng(1).uniform(0, 1, (150, 2))
Y = np.sin(9 * X[:, 0]) * X[:, 1]


@pytest.mark.parametrize(
    ("estimator", "size", "parameter", "least"),
    [
        (LocalLinearTreeRegressor, "max_leaves", "max_leaves", 8),
        (BoostedLocalLinearTreeRegressor, "max_rounds", "max_iter", 32),
    ],
)
def test_the_size_makes_the_same_model_again(estimator, size, parameter, least):
    timed = estimator(time_limit=1e-9).fit(X, Y)
    said = timed.summary_["time_limit"]
    assert said["reached"] and said[size] == least and said["taken"] > said["seconds"]
    assert timed.to_json() == estimator(**{parameter: said[size]}).fit(X, Y).to_json()
    whole = estimator(time_limit=1e6).fit(X, Y)
    assert not whole.summary_["time_limit"]["reached"]
    assert whole.to_json() == estimator().fit(X, Y).to_json() != timed.to_json()
    assert "time_limit" not in estimator().fit(X, Y).summary_


@pytest.mark.parametrize("estimator", [LocalLinearTreeRegressor, BoostedLocalLinearTreeRegressor])
def test_what_is_no_time_is_refused_by_name(estimator):
    for value in (0, -1, float("nan"), float("inf"), "5", True):
        with pytest.raises(ValueError, match="time_limit is .*; it must be a number of seconds above 0, or None"):
            estimator(time_limit=value).fit(X, Y)
    with pytest.raises(ValueError, match="teaching does not go with a time limit"):
        LocalLinearTreeRegressor(time_limit=5, teach=True).fit(X, Y)
