"""Columns as tables have them: what is left out, and what is warned of."""

import datetime
import warnings

import numpy as np
import pandas as pd
import pytest

from llmt import LocalLinearTreeRegressor
from llmt.tables import read_table


def table(rows=90):
    random = np.random.default_rng(2)
    x = random.uniform(size=rows)
    return pd.DataFrame({"x": x}), 3 * x + 0.05 * random.normal(size=rows)


def warned(X, y, **options):
    with warnings.catch_warnings(record=True) as caught:
        warnings.simplefilter("always")
        fitted = LocalLinearTreeRegressor(n_jobs=1, **options).fit(X, y)
    return fitted, " ".join(str(warning.message) for warning in caught)


def test_dates_of_many_days_are_left_out():
    X, y = table()
    dated = X.assign(when=pd.date_range("2024-01-01", periods=len(X)).strftime("%Y-%m-%d"))
    fitted, said = warned(dated, y)
    assert 'column "when" has dates, 90 different ones in 90 rows, and is left out' in said
    plain, _ = warned(X, y)
    new = dated.assign(when="2031-05-05")
    assert fitted.predict(new) == pytest.approx(plain.predict(X), abs=1e-12)
    assert fitted.n_features_in_ == 2
    _, said = warned(dated, y, categorical_features=["when"], cv=0)
    assert "left out" not in said


ZONE = datetime.timezone(datetime.timedelta(hours=5, minutes=30))


def typed_dates(moments):
    """Columns of the same moments as frames have them."""
    yield "datetime64[ns]", pd.Series(pd.DatetimeIndex(moments).as_unit("ns"))
    yield "datetime64[s]", pd.Series(pd.DatetimeIndex(moments).as_unit("s"))
    yield "with a zone", pd.Series(pd.DatetimeIndex(moments)).dt.tz_localize("UTC").dt.tz_convert("Asia/Kolkata")
    yield "objects", pd.Series(moments, dtype=object)
    yield "objects with a zone", pd.Series([m.replace(tzinfo=datetime.timezone.utc).astimezone(ZONE) for m in moments], dtype=object)
    yield "category", pd.Series(pd.Categorical(moments))
    pa = pytest.importorskip("pyarrow")
    for unit in ("s", "us", "ns"):
        yield f"Arrow {unit}", pd.Series(pd.arrays.ArrowExtensionArray(pa.array(moments, pa.timestamp(unit))))


MOMENTS = [datetime.datetime(1968, 2, 28, 12) + datetime.timedelta(hours=36 * k, seconds=k % 3) for k in range(90)]


def test_dates_of_any_type_are_left_out_with_the_words_of_dates_as_text():
    X, y = table()
    as_text = X.assign(when=[str(moment) for moment in MOMENTS])
    expected = warned(as_text, y)[1]
    assert 'column "when" has dates, 90 different ones in 90 rows, and is left out; give a number, as days' in expected
    plain = warned(X, y)[0].predict(X)
    for kind, column in typed_dates(MOMENTS):
        dated = X.assign(when=column)
        fitted, said = warned(dated, y)
        assert said == expected, kind
        assert fitted.predict(dated) == pytest.approx(plain, abs=1e-12), kind
    pa = pytest.importorskip("pyarrow")
    dated = pa.table({**{name: X[name].to_numpy() for name in X}, "when": pa.array(MOMENTS)})
    fitted, said = warned(dated, y)
    assert said == expected
    assert fitted.predict(dated) == pytest.approx(plain, abs=1e-12)
    pl = pytest.importorskip("polars")
    assert warned(pl.from_arrow(dated), y)[1] == expected


def test_texts_of_dates_are_those_of_python():
    """Midnights are dates alone."""
    parts = [datetime.timedelta(0), datetime.timedelta(microseconds=250000), datetime.timedelta(hours=-5, microseconds=1)]
    moments = [datetime.datetime(1600 + 37 * k, 1 + k % 12, 1 + k % 28) + parts[k % 3] for k in range(20)] + [None]
    for kind, column in {
        "microseconds": pd.Series(pd.array(moments, dtype="datetime64[us]")),
        "objects": pd.Series(moments, dtype=object),
    }.items():
        read = read_table(pd.DataFrame({"c": column}), dates=True)
        texts = [None if np.isnan(cell) else read.levels[0][int(cell)] for cell in read.values[:, 0]]
        expected = [str(moment) if moment else None for moment in moments]
        trimmed = [text and (text.rstrip("0") if "." in text else text.removesuffix(" 00:00:00")) for text in expected]
        assert texts == trimmed, kind


def test_dates_that_cannot_be_left_out():
    X, y = table()
    few = X.assign(day=[datetime.date(2024, 1, 1 + k % 3) for k in range(len(X))])
    fitted, said = warned(few, y)
    assert "looks like a date and is taken for categories" in said
    assert fitted._levels[1] == ["2024-01-01", "2024-01-02", "2024-01-03"]
    assert "left out" not in warned(X.assign(when=MOMENTS), y, categorical_features=["when"], cv=0)[1]
    alone = warned(pd.DataFrame({"when": MOMENTS}), y, cv=0)[1]
    assert "taken for categories" in alone and "left out" not in alone
    plain, _ = warned(X, y)
    with pytest.raises(TypeError, match="\"x\" holds dates .* in training it held numbers"):
        plain.predict(X.assign(x=MOMENTS))
    for targets in (pd.Series(MOMENTS), pd.DataFrame({"t": MOMENTS})):
        with pytest.raises(TypeError, match="holds dates"):
            LocalLinearTreeRegressor().fit(X, targets)


def test_columns_of_more_words_than_can_be_learnt():
    rows = 20010
    X = pd.DataFrame({"x": np.arange(rows) % 7, "word": [f"w{k}" for k in range(rows)]})
    y = 2.0 * X["x"]
    fitted, said = warned(X, y, cv=0)
    assert 'column "word" has words, 20010 different ones in 20010 rows, and is left out' in said
    assert fitted.predict(X) == pytest.approx(y, abs=1e-9)
    with pytest.raises(ValueError, match='"word" has 10005 categories; at most 10000'):
        LocalLinearTreeRegressor(cv=0).fit(X.assign(word=[f"w{k // 2}" for k in range(rows)]), y)
    with pytest.raises(ValueError, match='"word" has 20010 categories; at most 10000'):
        LocalLinearTreeRegressor(cv=0, categorical_features=["word"]).fit(X, y)


def test_far_values_and_units_are_named():
    X, y = table()
    far = X.assign(x=np.where(np.arange(len(X)) % 7 == 1, -999.0, X["x"]))
    assert "13 of 90 cells are -999, far from all others" in warned(far, y)[1]
    priced = X.assign(price=[f"CHF 1'{200 + k}.5" for k in range(len(X))])
    assert 'column "price" has "CHF" and a number with apostrophes between thousands in every cell' in warned(priced, y)[1]
    numbered = X.assign(order=100001 + np.arange(len(X)))
    assert 'column "order" numbers the rows' in warned(numbered, y)[1]
