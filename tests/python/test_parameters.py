"""Every parameter of an estimator does something, or is refused by its name, wherever estimators are taken."""

import functools

import numpy as np
import pytest

from llmt import BoostedLocalLinearTreeRegressor, LocalLinearTreeRegressor, distributed

# A value other than the default for each parameter.
TREE = {
    "max_leaves": 1,
    "min_samples_leaf": 150,
    "rule": "ra",
    "validity": "blend",
    "local_models": "quadratic",
    "sparse": "always",
    "loss": "tukey",
    "cv": 2,
    "contiguous": True,
    "select_features": False,
    "integer_codes": False,
    "categorical_features": ["d"],
    "monotonic_cst": {"b": 1},
    "shared_tree": True,
    "readable": True,
    "readable_rules": 2,
    "teach": True,
    "time_limit": 1e-9,
    "random_state": 7,
    "n_jobs": 2,
}
FEW_FOLDS = {"cv": 3}  # of the trees, where the number of folds is not what is changed: fits take half of the time
SUM = {
    "learning_rate": 0.3,
    "max_iter": 4,
    "seeds": 2,
    "time_limit": 1e-9,
    "categorical_features": ["d"],
    "random_state": 7,
    "n_jobs": 2,
}
WITHOUT_EFFECT = {"n_jobs"}  # the result does not depend on the number of threads


def table(targets=1):
    """Inputs of noise that are left out, and codes without order that are taken for categories."""
    pandas = pytest.importorskip("pandas")
    rng = np.random.default_rng(2)
    X = rng.uniform(-1, 1, (300, 12))
    X[:, 3] = rng.integers(0, 8, len(X))
    y = np.where(X[:, 0] > 0, 2 * X[:, 1], np.abs(X[:, 2]))
    y += 2 * np.array([0, 2, -1, 1, -2, 2.5, 0.3, -1.5])[X[:, 3].astype(int)] + 0.3 * rng.normal(size=len(X))
    y[::75] += 3
    frame = pandas.DataFrame(X, columns=list("abcdefghijkl"))
    Y = np.column_stack([y, X[:, 2] * y])
    return frame, pandas.Series(y, name="y") if targets == 1 else pandas.DataFrame(Y, columns=["y", "z"])


def tree(**parameters):
    return LocalLinearTreeRegressor(**{**FEW_FOLDS, **parameters})


def inputs(name):
    """The columns that the parameter is tried with: all where inputs of noise matter, few where fits take long with many."""
    return {"select_features": "abcdefghijkl", "teach": "abcd"}.get(name, "abcdef")


@functools.cache
def fitted(estimator, columns, targets=1, name="", rows=300):
    """The estimator with the value above of a parameter, by default with none, fitted to a part of the table."""
    X, y = (part.head(rows) for part in table(targets))
    values = TREE if estimator is tree else SUM
    return estimator(**({name: values[name]} if name else {})).fit(X[list(columns)], y)


def test_the_values_are_those_of_all_parameters():
    for values, estimator in ((TREE, LocalLinearTreeRegressor), (SUM, BoostedLocalLinearTreeRegressor)):
        defaults = estimator().get_params()
        assert set(values) == set(defaults)
        assert all(values[name] != defaults[name] for name in values)


@pytest.mark.filterwarnings("ignore")
@pytest.mark.parametrize("name", TREE)
def test_a_parameter_of_a_tree_changes_the_fit(name):
    targets = 2 if name == "shared_tree" else 1
    rows = 150 if name == "teach" else 300
    by_default = fitted(tree, inputs(name), targets, rows=rows)
    changed = fitted(tree, inputs(name), targets, name, rows)
    if name == "teach":  # the taught tree is taken where it is better
        assert "teaching" in changed.summary_ and "teaching" not in by_default.summary_
    else:
        assert (changed.to_json() == by_default.to_json()) == (name in WITHOUT_EFFECT)


@pytest.mark.filterwarnings("ignore")
@pytest.mark.parametrize("name", SUM)
def test_a_parameter_of_a_sum_changes_the_fit(name):
    by_default = fitted(BoostedLocalLinearTreeRegressor, "abcd", rows=150).to_json()
    changed = fitted(BoostedLocalLinearTreeRegressor, "abcd", name=name, rows=150).to_json()
    assert (changed == by_default) == (name in WITHOUT_EFFECT)


@pytest.mark.filterwarnings("ignore")
@pytest.mark.parametrize("name", TREE)
def test_beyond_one_memory_a_parameter_means_what_it_means_in_fit(name):
    X, y = table()
    X = X[list(inputs(name))]
    estimator = tree(**{name: TREE[name]})
    try:
        state = distributed.start(list(X.columns), "y", block_rows=120, estimator=estimator)
    except ValueError as refused:
        assert name in str(refused) and "beyond one memory" in str(refused)
        assert name in {"rule", "local_models", "loss", "categorical_features", "monotonic_cst", "readable", "readable_rules", "teach", "time_limit"}
        return
    while distributed.status(state)["step"] != "finished":
        state = distributed.advance(state, distributed.sums(state, X, y))
    assert distributed.estimator(state).to_json() == fitted(tree, inputs(name), name=name).to_json()


@pytest.mark.parametrize("name", TREE)
def test_a_stream_takes_or_refuses_a_parameter(name):
    rows = np.random.default_rng(0).uniform(-1, 1, (6000, 4))
    targets = np.sin(6 * rows[:, 0]) + np.abs(rows[:, 1])
    stream = LocalLinearTreeRegressor(**{name: TREE[name]})
    if name in {"max_leaves", "min_samples_leaf", "validity"}:
        other = LocalLinearTreeRegressor(validity="crisp") if name == "validity" else LocalLinearTreeRegressor()
        assert stream.partial_fit(rows, targets).to_json() != other.partial_fit(rows, targets).to_json()
    elif name in {"select_features", "integer_codes", "random_state", "n_jobs"}:  # streams have nothing of the kind
        stream.partial_fit(rows, targets)
    else:
        with pytest.raises(ValueError, match=f"{name}.* is not for streams"):
            stream.partial_fit(rows, targets)


def test_a_stream_does_not_change_its_parameters():
    rows = np.random.default_rng(0).uniform(-1, 1, (500, 2))
    stream = LocalLinearTreeRegressor().partial_fit(rows, rows[:, 0])
    with pytest.raises(ValueError, match="loss tukey is not for streams|have changed"):
        stream.set_params(loss="tukey").partial_fit(rows, rows[:, 0])
    with pytest.raises(ValueError, match="parameters have changed since the first partial_fit"):
        stream.set_params(loss="squared", max_leaves=3).partial_fit(rows, rows[:, 0])
    stream.set_params(max_leaves=None, validity="crisp").partial_fit(rows, rows[:, 0])


def test_signs_of_nothing_are_no_trend():
    for signs in ({}, {"a": 0}, [0, 0]):
        distributed.start(["a", "b"], "y", estimator=LocalLinearTreeRegressor(monotonic_cst=signs))


def test_folds_that_are_dealt_are_not_contiguous_too():
    X, y = table()
    halves = [(np.arange(120, 240), np.arange(120)), (np.arange(120), np.arange(120, 240))]
    with pytest.raises(ValueError, match="contiguous"):
        LocalLinearTreeRegressor(cv=halves, contiguous=True).fit(X, y)
