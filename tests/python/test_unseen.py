"""What training has not shown, and what says that nothing is there."""

import json
import warnings

import numpy as np
import pandas as pd
import pytest

from llmt import BoostedLocalLinearTreeRegressor, LocalLinearTreeRegressor
from llmt.export import to_python, to_sql

ESTIMATORS = [
    LocalLinearTreeRegressor(n_jobs=1),
    LocalLinearTreeRegressor(validity="crisp", n_jobs=1),
    BoostedLocalLinearTreeRegressor(n_jobs=1),
]


def countries(nothing):
    """y = 0, 1 and 5 in DE, FR and where nothing is said, a fourth of the rows, + 2 x."""
    random = np.random.default_rng(3)
    x = random.uniform(size=240)
    kind = np.where(np.arange(240) % 4 == 3, 2, np.arange(240) % 2)
    country = np.array(["DE", "FR", nothing], dtype=object)[kind]
    y = np.array([0.0, 1.0, 5.0])[kind] + 2.0 * x + 0.05 * random.normal(size=240)
    return pd.DataFrame({"country": country, "x": x}), y


def asked(*words):
    return pd.DataFrame({"country": pd.Series(words, dtype=object), "x": 0.5})


@pytest.mark.parametrize("estimator", ESTIMATORS)
@pytest.mark.parametrize("nothing", [None, float("nan"), ""])
def test_a_missing_word_is_a_level(estimator, nothing):
    X, y = countries(nothing)
    fitted = estimator.fit(X, y)
    assert fitted.predict(asked("DE", "FR", None)) == pytest.approx([1.0, 2.0, 6.0], abs=0.1)
    assert not any(column["unknown"] for column in fitted.check(asked("DE", None)).columns)


@pytest.mark.parametrize("estimator", ESTIMATORS)
@pytest.mark.parametrize("word", ["NA", "null", "nan", "?", "n/a"])
def test_a_word_is_a_word(estimator, word):
    X, y = countries(word)
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        fitted = estimator.fit(X, y)
    assert fitted.predict(asked("DE", "FR", word)) == pytest.approx([1.0, 2.0, 6.0], abs=0.1)
    # None was not there: between the countries, whose mean is 1.625.
    assert fitted.predict(asked(None))[0] == pytest.approx(2.65, abs=0.4)


@pytest.mark.parametrize("numbers", [[0, 1], [0.5, None], [True, False]])
def test_numbers_are_no_words(numbers):
    fitted = ESTIMATORS[1].fit(*countries("SE"))
    message = r'column "country" holds numbers \((0|1|0.5) in row 0\); in training it held words'
    with pytest.raises(TypeError, match=message):
        fitted.predict(pd.DataFrame({"country": numbers, "x": 0.5}))
    # Nothing but missing cells is no type.
    assert np.isfinite(fitted.predict(pd.DataFrame({"country": [None, None], "x": 0.5}))).all()


@pytest.mark.parametrize("estimator", ESTIMATORS)
def test_intervals_of_what_was_not_there_are_called_too_narrow(estimator):
    X, y = countries("SE")
    fitted = estimator.fit(X, y)
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        fitted.predict_interval(asked("DE", "SE"))
    with pytest.warns(UserWarning, match="2 of 3 rows have a missing cell or an unknown category.* first is row 1: .*narrow"):
        fitted.predict_interval(asked("DE", "NO", None))
    assert fitted.predict(asked("NO", None)) == pytest.approx([2.65, 2.65], abs=0.4)


def test_exports_know_the_level_of_a_missing_word():
    X, y = countries(None)
    fitted = LocalLinearTreeRegressor(n_jobs=1).fit(X, y)
    rows = asked("DE", "FR", None, "NO", "")
    expected = fitted.predict(rows)
    model = json.loads(fitted.to_json())
    assert model["version"] == 5 and model["inputs"][0]["levels"] == ["DE", "FR", ""]
    scope = {}
    exec(to_python(model, "say"), scope)
    assert [scope["say"](row) for row in rows.to_dict("records")] == list(expected)
    sqlite3 = pytest.importorskip("sqlite3")
    with sqlite3.connect(":memory:") as base:
        base.execute("CREATE TABLE t (country TEXT, x REAL, k INTEGER)")
        words = [*rows["country"], "na"]  # as llmt predict reads a cell
        base.executemany("INSERT INTO t VALUES (?, 0.5, ?)", [(word, k) for k, word in enumerate(words)])
        found = dict(base.execute(to_sql(model, "t", "sqlite", keep=["k"])).fetchall())
    assert [found[k] for k in range(6)] == pytest.approx([*expected, expected[2]], abs=1e-12)


def test_onnx_knows_the_level_of_a_missing_word(tmp_path):
    pytest.importorskip("onnx")
    runtime = pytest.importorskip("onnxruntime")
    from llmt.export import to_onnx

    X, y = countries(None)
    fitted = LocalLinearTreeRegressor(n_jobs=1).fit(X, y)
    session = runtime.InferenceSession(to_onnx(json.loads(fitted.to_json())).SerializeToString())
    words = np.array([["DE"], ["FR"], [""], ["NO"]], dtype=object)
    found = session.run(None, {"country": words, "x": np.full((4, 1), 0.5)})[0]
    assert found[:, 0] == pytest.approx(fitted.predict(asked("DE", "FR", None, "NO")), abs=1e-12)


def test_a_saved_model_reads_missing_words(tmp_path):
    X, y = countries(None)
    for estimator in ESTIMATORS:
        estimator.fit(X, y).save(tmp_path / "m.json")
        again = type(estimator).load(tmp_path / "m.json")
        rows = asked("DE", None, "", "NO")
        assert again.predict(rows).tolist() == estimator.predict(rows).tolist()
        assert sum(column["unknown"] for column in again.check(rows).columns) == 1


def test_many_categories_are_fitted_by_a_sum():
    random = np.random.default_rng(1)
    shop = np.arange(60 * 4) % 60
    X = pd.DataFrame({"shop": [f"s{k}" for k in shop], "x": random.uniform(size=len(shop))})
    y = shop % 7 + X["x"].to_numpy()
    fitted = BoostedLocalLinearTreeRegressor(n_jobs=1).fit(X, y)
    assert fitted.summary_["sums"][0]["held_out_rmse"] < 0.3
