"""Trees that a sum of trees taught."""

import json
import os
import subprocess

import numpy as np
import pytest
from estimators import stepped
from sklearn.model_selection import KFold

from llmt import LocalLinearTreeRegressor

PROGRAM = os.environ.get("LLMT_PROGRAM", "")
SAMPLE = os.path.join(os.path.dirname(__file__), "../../docs/samples/heat_pump.csv")


@pytest.mark.skipif(not PROGRAM, reason="LLMT_PROGRAM does not name the program llmt")
def test_the_command_line_writes_the_same_bytes_and_errors(tmp_path):
    pandas = pytest.importorskip("pandas")
    frame = pandas.read_csv(SAMPLE).head(120)  # of which the taught tree is taken
    frame.to_csv(tmp_path / "rows.csv", index=False)
    options = ["--target", "cop", "--teach", "--readable", "--json", "--cv", "3", "-o", tmp_path / "model.json"]
    command = [PROGRAM, "fit", tmp_path / "rows.csv", *options]
    printed = json.loads(subprocess.run(command, check=True, capture_output=True, text=True).stdout)
    fitted = LocalLinearTreeRegressor(teach=True, readable=True, cv=3).fit(frame.drop(columns="cop"), frame["cop"])
    assert fitted.accurate_model_.to_json() == (tmp_path / "model.json").read_text()
    assert fitted.to_json() == (tmp_path / "model.readable.json").read_text()
    assert fitted.summary_["teaching"] == printed["teaching"]
    assert fitted.summary_["teaching"]["taken"]
    assert fitted.accurate_model_.to_dict()["partitions"][0]["nodes"][1:], "the tree has no split: the test would prove little"


def test_a_weight_is_a_number_of_copies():
    X, y = stepped(120)
    weights = np.random.default_rng(1).integers(0, 4, len(y))
    repeated = LocalLinearTreeRegressor(teach=True, cv=3).fit(np.repeat(X, weights, axis=0), np.repeat(y, weights))
    weighted = LocalLinearTreeRegressor(teach=True, cv=3).fit(X, y, sample_weight=weights)
    assert weighted.to_json() == repeated.to_json()
    assert weighted.summary_["teaching"] == repeated.summary_["teaching"]


def test_folds_of_a_splitter_and_missing_cells():
    X, y = stepped(120)
    X[::9, 1] = np.nan
    fitted = LocalLinearTreeRegressor(teach=True, cv=KFold(4)).fit(X, y)
    (errors,) = fitted.summary_["teaching"]["partitions"]
    assert all(np.isfinite(errors[name]) for name in ("cv_rmse_alone", "cv_rmse_taught", "cv_rmse_sum"))
    assert fitted.summary_["teaching"]["made_rows"] == 480


def test_without_held_out_rows_it_is_refused_by_name():
    with pytest.raises(ValueError, match="teaching does not go with folds.count 0"):
        LocalLinearTreeRegressor(teach=True, cv=0).fit(*stepped(100))
