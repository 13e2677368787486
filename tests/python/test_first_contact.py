"""First contact: tables as people have them, no extra argument. Prints a line for each case:

    pytest -s tests/python/test_first_contact.py
"""

import warnings

import numpy as np
import pytest

from llmt import LocalLinearTreeRegressor

pandas = pytest.importorskip("pandas")
polars = pytest.importorskip("polars")
pyarrow = pytest.importorskip("pyarrow")

ROWS = 300
RNG = np.random.default_rng(0)
NUMBERS = RNG.uniform(-1, 1, (ROWS, 4))
WORDS = np.asarray(["red", "green", "größe <m>"])[RNG.integers(0, 3, ROWS)]
NAMES = ["a", "b", "c", "d"]
Y = np.where(WORDS == "red", 2 * NUMBERS[:, 0], -NUMBERS[:, 1]) + 0.05 * RNG.normal(size=ROWS)


def frame(**columns):
    return pandas.DataFrame({**dict(zip(NAMES, NUMBERS.T)), **columns})


def r2(X, new=None, y=Y):
    """R2 of a fit on X, predicted for X or for `new`, the same rows in another form."""
    predicted = LocalLinearTreeRegressor(cv=3).fit(X, y).predict(X if new is None else new)
    return 1 - np.sum((predicted - y) ** 2) / np.sum((y - y.mean()) ** 2)


def taken(X, new=None):
    """The words explain most of y: without them R2 is below 0.9."""
    score = r2(X, new)
    assert score > 0.9, score
    return f"taken, R2 {score:.3f}"


def refused(error, words, call):
    with pytest.raises(error, match=words) as caught:
        call()
    return f"{type(caught.value).__name__}: {str(caught.value).splitlines()[0][:70]}"


def numbers_with_nan():
    X = NUMBERS.copy()
    X[3, 1] = np.nan
    assert r2(X) > 0.3
    return "taken"


def unseen_category():
    fitted = LocalLinearTreeRegressor(cv=3).fit(frame(s=WORDS), Y)
    new = frame(s=np.where(np.arange(ROWS) == 5, "blue", WORDS))
    assert np.isfinite(fitted.predict(new)).all()
    assert fitted.check(new).columns[-1]["unknown"] == 1
    return "counts as missing; check() says so"


def other_codes():
    ordered = pandas.Categorical(WORDS, categories=["red", "green", "größe <m>"])
    reordered = pandas.Categorical(WORDS, categories=["größe <m>", "red", "green"])
    fitted = LocalLinearTreeRegressor(cv=3).fit(frame(s=ordered), Y)
    assert (fitted.predict(frame(s=ordered)) == fitted.predict(frame(s=reordered))).all()
    return "same answer"


def nullable():
    numbers = pandas.array([None if row % 50 == 0 else row % 7 for row in range(ROWS)], dtype="Int64")
    return taken(frame(s=WORDS, n=numbers, t=NUMBERS[:, 0] > 0))


def polars_frame(words):
    return polars.DataFrame({**dict(zip(NAMES, NUMBERS.T)), "s": words})


def polars_numbers():
    X = polars.DataFrame({"a": [None, *NUMBERS[1:, 0]], "b": NUMBERS[:, 1]})
    assert r2(X, y=polars.Series("y", Y).to_numpy()) > 0.3
    LocalLinearTreeRegressor(cv=3).fit(X, polars.Series("y", Y))
    return "taken"


def shuffled_columns():
    fitted = LocalLinearTreeRegressor(cv=3).fit(frame(), Y)
    return refused(ValueError, "same order", lambda: fitted.predict(frame()[["b", "a", "c", "d"]]))


def renamed_column():
    fitted = LocalLinearTreeRegressor(cv=3).fit(frame(), Y)
    return refused(ValueError, "unseen at fit time", lambda: fitted.predict(frame().rename(columns={"a": "z"})))


def extra_column():
    fitted = LocalLinearTreeRegressor(cv=3).fit(frame(), Y)
    return refused(ValueError, "unseen at fit time", lambda: fitted.predict(frame(e=1.0)))


def strange_names():
    names = ["x[1]", "größe <m>", '"q", {d}:', "e\u202e"]
    fitted = LocalLinearTreeRegressor(cv=3).fit(pandas.DataFrame(NUMBERS, columns=names), Y)
    assert fitted.model_.handle.inputs()[1]["name"] == "größe <m>"
    return "taken"


def two_targets():
    fitted = LocalLinearTreeRegressor(cv=3).fit(NUMBERS, np.column_stack([Y, -Y]))
    assert fitted.predict(NUMBERS).shape == (ROWS, 2)
    return "taken"


def weights():
    k = np.random.default_rng(1).integers(0, 4, ROWS)
    weighted = LocalLinearTreeRegressor(cv=3).fit(NUMBERS, Y, sample_weight=k).predict(NUMBERS)
    repeated = LocalLinearTreeRegressor(cv=3).fit(np.repeat(NUMBERS, k, axis=0), np.repeat(Y, k)).predict(NUMBERS)
    assert (weighted == repeated).all()
    return "difference 0"


def with_value(array, value):
    changed = np.array(array)
    changed.flat[7] = value
    return changed


def too_few_columns():
    fitted = LocalLinearTreeRegressor(cv=3).fit(NUMBERS, Y)
    return refused(ValueError, "3 features", lambda: fitted.predict(NUMBERS[:, :3]))


CASES = {
    "NaN in X": numbers_with_nan,
    "pandas category": lambda: taken(frame(s=pandas.Categorical(WORDS))),
    "pandas str": lambda: taken(frame(s=pandas.Series(WORDS))),
    "pandas object": lambda: taken(frame(s=pandas.Series(WORDS, dtype=object))),
    "nullable Int64 with NA + bool": nullable,
    "unseen category at predict": unseen_category,
    "same labels, other codes at predict": other_codes,
    "polars numbers, null, y Series": polars_numbers,
    "polars String": lambda: taken(polars_frame(polars.Series(WORDS))),
    "polars Categorical": lambda: taken(polars_frame(polars.Series(WORDS).cast(polars.Categorical))),
    "pyarrow Table numbers": lambda: f"taken, R2 {r2(pyarrow.table(dict(zip(NAMES, NUMBERS.T)))):.3f}",
    "pyarrow dictionary": lambda: taken(
        pyarrow.table({**dict(zip(NAMES, NUMBERS.T)), "s": pyarrow.array(WORDS).dictionary_encode()})
    ),
    "inf in X": lambda: refused(ValueError, "infinity", lambda: r2(with_value(NUMBERS, np.inf))),
    "NaN in y": lambda: refused(ValueError, "NaN", lambda: r2(NUMBERS, y=with_value(Y, np.nan))),
    "numpy with a column too few": too_few_columns,
    "columns in another order": shuffled_columns,
    "a column renamed": renamed_column,
    "an extra column": extra_column,
    "strange names": strange_names,
    "y with two columns": two_targets,
    "weight k against k copies": weights,
}


@pytest.mark.parametrize("case", CASES)
def test_first_contact(case):
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        print(f"\n| {case} | {CASES[case]()} |", end="")
