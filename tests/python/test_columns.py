"""Columns as tables have them: what is left out, and what is warned of."""

import warnings

import numpy as np
import pandas as pd
import pytest

from llmt import LocalLinearTreeRegressor


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


def test_far_values_and_units_are_named():
    X, y = table()
    far = X.assign(x=np.where(np.arange(len(X)) % 7 == 1, -999.0, X["x"]))
    assert "13 of 90 cells are -999, far from all others" in warned(far, y)[1]
    priced = X.assign(price=[f"CHF 1'{200 + k}.5" for k in range(len(X))])
    assert 'column "price" has "CHF" and a number with apostrophes between thousands in every cell' in warned(priced, y)[1]
    numbered = X.assign(order=100001 + np.arange(len(X)))
    assert 'column "order" numbers the rows' in warned(numbered, y)[1]
