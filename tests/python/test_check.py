"""Whether a model is still good on new rows."""

import json
import subprocess

import numpy as np
import pandas as pd
import pytest
from fitted_models import PROGRAM

from llmt import BoostedLocalLinearTreeRegressor, LocalLinearTreeRegressor


def table(rows, seed, noise=0.1, shift=0.0, third="auto"):
    random = np.random.default_rng(seed)
    load = random.uniform(0, 9, rows)
    load = np.where(load < 4.5, load, load + 1) + shift  # no row lies near the jump
    power = random.normal(size=rows)
    mode = random.integers(0, 3, rows)
    y = np.where(load < 5, load, 8 - power) + 0.5 * mode + noise * random.normal(size=rows)
    return pd.DataFrame({"load": load, "power": power, "mode": np.array(["eco", "off", third], dtype=object)[mode]}), y


@pytest.mark.parametrize("estimator", [LocalLinearTreeRegressor(n_jobs=1), BoostedLocalLinearTreeRegressor(n_jobs=1)])
def test_verdicts(estimator):
    fitted = estimator.fit(*table(500, 1))
    good = fitted.check(*table(300, 2))
    assert good.verdict == "good" and good.reason is None and good.rmse["y"] == pytest.approx(0.1, abs=0.03)
    assert good.promised["y"] > 0.08
    if isinstance(estimator, LocalLinearTreeRegressor):  # a sum of four fifths of the rows errs more at the jump
        assert good.promised["y"] == pytest.approx(0.1, abs=0.03)
    X, y = table(300, 3, noise=0.3)
    assert fitted.check(X, y).verdict == "no longer good"
    assert fitted.check(X, y, max_error=0.5).verdict == "moved, within limits"
    unnamed = fitted.check(X)
    assert unnamed.verdict == "not evaluated" and not unnamed.rmse
    shifted = fitted.check(*table(300, 4, shift=2.0), max_error=9.0)
    assert shifted.verdict == "moved, within limits"
    assert len(shifted.rows_outside) and shifted.columns[0]["name"] == "load" and shifted.columns[0]["moved"]


def test_words_of_an_unknown_category():
    fitted = LocalLinearTreeRegressor(n_jobs=1).fit(*table(500, 1))
    found = fitted.check(table(300, 5, third="AUTO")[0])
    mode = next(column for column in found.columns if column["name"] == "mode")
    assert mode["unknown_words"] == {"AUTO": mode["unknown"]}
    assert 'mode: AUTO in' in str(found) and 'did you mean "auto"?' in str(found)


def test_the_program_says_the_same(tmp_path):
    if PROGRAM is None:
        pytest.skip("no program")
    fitted = LocalLinearTreeRegressor(n_jobs=1).fit(*table(500, 1))
    fitted.save(tmp_path / "m.json")
    X, y = table(300, 3, noise=0.15, shift=0.5)
    X.assign(y=y).to_csv(tmp_path / "new.csv", index=False)
    ran = subprocess.run([PROGRAM, "check", tmp_path / "m.json", tmp_path / "new.csv", "--json"], capture_output=True, text=True)
    said = json.loads(ran.stdout)
    found = fitted.check(X, y)
    assert said["verdict"] == found.verdict
    assert said["targets"] == found.targets and said["inputs"] == found.inputs


def test_shapes_are_checked():
    X, y = table(100, 1)
    fitted = LocalLinearTreeRegressor(n_jobs=1).fit(X, y)
    with pytest.raises(ValueError, match="y has the shape"):
        fitted.check(X, y[:50])
    with pytest.raises(ValueError, match="level"):
        fitted.check(X, y, level=0.9)
    with pytest.raises(ValueError, match="limits of 1 targets"):
        fitted.check(X, y, max_error=[1.0, 2.0])
