"""Objects that several threads share: what the guide promises of them (docs/python.md, Threads)."""

import copy
import pickle
import sys
import threading

import numpy as np
import pytest

from llmt import LocalLinearTreeRegressor


@pytest.fixture(autouse=True)
def threads_change_often():
    before = sys.getswitchinterval()
    sys.setswitchinterval(1e-5)
    yield
    sys.setswitchinterval(before)


def table(rows=1500):
    X = np.random.default_rng(1).uniform(0, 1, (rows, 3))
    return X, X[:, 0] * 2 + (X[:, 1] > 0.5)


def together(*calls):
    """Runs the calls in a thread each, begun at the same time, and raises the first error."""
    ready = threading.Barrier(len(calls))
    errors = []

    def run(call):
        ready.wait()
        try:
            call()
        except BaseException as error:
            errors.append(error)

    threads = [threading.Thread(target=run, args=(call,)) for call in calls]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join()
    if errors:
        raise errors[0]


def repeated(times, call):
    return lambda: [call() for _ in range(times)]


def test_an_estimator_learns_from_the_rows_of_all_threads():
    X, y = table()
    model = LocalLinearTreeRegressor()
    copies = []
    together(
        *[repeated(6, lambda: model.partial_fit(X, y))] * 3,
        repeated(10, lambda: hasattr(model, "model_") and copies.append(pickle.loads(pickle.dumps(model)))),
        repeated(10, lambda: hasattr(model, "model_") and model.predict(X)),
        repeated(10, lambda: copy.deepcopy(model)),
    )
    assert model.summary_["rows"] == model._stream.handle.rows() == 3 * 6 * len(X)
    rest = LocalLinearTreeRegressor()  # blocks that are alike may come in any order
    for _ in range(3 * 6):
        rest.partial_fit(X, y)
    assert model.to_json() == rest.to_json()
    for copied in [c for c in copies if c]:
        rows = copied.summary_["rows"]
        assert rows % len(X) == 0 and copied._stream.handle.rows() == rows
        assert copied.model_.to_json() == copied._stream.handle.model(copied._inputs, copied._outputs, "auto")


def test_a_copy_learns_by_itself():
    X, y = table()
    model = LocalLinearTreeRegressor().partial_fit(X, y)
    for other in (copy.copy(model), copy.deepcopy(model), pickle.loads(pickle.dumps(model))):
        other.partial_fit(X, y)
        assert (other.summary_["rows"], model._stream.handle.rows()) == (2 * len(X), len(X))
        assert pickle.loads(pickle.dumps(copy.copy(other))).to_json() == other.to_json()


def test_streams_are_merged_while_they_learn():
    X, y = table(500)
    one, other = LocalLinearTreeRegressor().partial_fit(X, y), LocalLinearTreeRegressor().partial_fit(X, y)
    together(
        repeated(3, lambda: one.merge(other)),  # both ways at once: neither waits for the other for ever
        repeated(3, lambda: other.merge(one)),
        repeated(5, lambda: one.partial_fit(X, y)),
        repeated(5, lambda: other.partial_fit(X, y)),
        repeated(2, lambda: one.merge(one)),
    )
    for model in (one, other):
        assert model.summary_["rows"] == model._stream.handle.rows() >= 6 * len(X)
        assert model.summary_["rows"] % len(X) == 0


def test_fits_and_streams_of_one_estimator_come_one_after_the_other():
    X, y = table(300)
    model = LocalLinearTreeRegressor(cv=2, n_jobs=1)
    together(
        repeated(3, lambda: model.fit(X, y)),
        repeated(3, lambda: LocalLinearTreeRegressor.partial_fit(model.set_params(cv=5), X, y)),
        repeated(5, lambda: pickle.dumps(model)),
    )
    assert np.isfinite(model.predict(X)).all()


def test_the_stream_of_the_extension_takes_one_call_after_the_other():
    X, y = table(2000)
    stream = LocalLinearTreeRegressor().partial_fit(X, y)._stream.handle
    column = y.reshape(-1, 1)
    together(
        *[repeated(8, lambda: stream.add(X, column))] * 3,
        repeated(8, lambda: stream.to_json()),
        repeated(8, lambda: stream.model(["a", "b", "c"], ["y"], "auto")),
        repeated(8, lambda: (stream.rows(), stream.prequential_rmse())),
        repeated(2, lambda: stream.merge(stream)),
    )
    assert stream.rows() >= (1 + 3 * 8) * len(X) and stream.rows() % len(X) == 0
