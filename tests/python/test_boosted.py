"""The estimator of a sum of trees: scikit-learn's contract, tables, weights, interrupts, explanations, files."""

import copy
import itertools
import math
import os
import pickle
import signal
import subprocess
import sys
import time
import warnings

import numpy as np
import pytest
from estimators import meet_scikit_learn, stepped

from llmt import BoostedLocalLinearTreeRegressor, BoostedModel, LocalLinearTreeRegressor, Model, load

PROGRAM = os.environ.get("LLMT_PROGRAM", "")


def quick(**options):
    return BoostedLocalLinearTreeRegressor(max_iter=20, **options)


def test_check_estimator():
    meet_scikit_learn(quick())


@pytest.mark.parametrize("rows", [300, 900])  # with five hold-outs, and with one
def test_a_weight_is_a_number_of_copies(rows):
    X, y = stepped(rows)
    weights = np.random.default_rng(1).integers(0, 4, len(y))
    several = quick().fit(np.repeat(X, weights, axis=0), np.repeat(y, weights))
    weighted = quick().fit(X, y, sample_weight=weights)
    assert weighted.to_json() == several.to_json()
    assert weighted.n_iter_ > 5, "the sum has hardly a tree: the test would prove little"


def test_same_bytes_for_any_number_of_threads_and_any_kind_of_table():
    pandas, polars, pyarrow = (pytest.importorskip(name) for name in ("pandas", "polars", "pyarrow"))
    X, y = stepped(400)
    words = np.where(X[:, 3] > 0, "up", "down")
    columns = {"a": X[:, 0], "b": X[:, 1], "c": X[:, 2], "d": words.tolist()}
    frame = pandas.DataFrame(columns)
    tables = [frame, polars.DataFrame(columns, nan_to_null=True), pyarrow.table(columns)]
    pairs = [(tables[0], 1), (tables[0], 2), (tables[0], 5), (tables[1], 1), (tables[2], 5)]
    texts = {quick(n_jobs=jobs).fit(table, y).to_json() for table, jobs in pairs}
    assert len(texts) == 1
    fitted = quick().fit(frame, y)
    assert fitted.model_.to_dict()["inputs"][3]["levels"] == ["down", "up"]
    predictions = [fitted.predict(table) for table in tables]
    assert all((of == predictions[0]).all() for of in predictions)
    unknown = frame.assign(d="sideways")
    assert np.isfinite(fitted.predict(unknown)).all()
    assert "with a category that training had not" in str(fitted.check(unknown))


@pytest.mark.skipif(not PROGRAM, reason="LLMT_PROGRAM does not name the program llmt")
def test_the_command_line_writes_the_same_bytes(tmp_path):
    pandas = pytest.importorskip("pandas")
    table = os.path.join(os.path.dirname(__file__), "../../docs/samples/heat_pump.csv")
    command = [PROGRAM, "fit", table, "--target", "cop", "--boost", "-o", tmp_path / "model.json"]
    subprocess.run(command, check=True, stdout=subprocess.DEVNULL)
    frame = pandas.read_csv(table)
    fitted = BoostedLocalLinearTreeRegressor().fit(frame.drop(columns="cop"), frame["cop"])
    assert fitted.to_json() == (tmp_path / "model.json").read_text()


def test_seeds_differ_and_repeat():
    X, y = stepped(300)
    assert quick(random_state=5).fit(X, y).to_json() == quick(random_state=5).fit(X, y).to_json()
    assert quick(random_state=5).fit(X, y).to_json() != quick().fit(X, y).to_json()


def test_an_estimator_survives_pickle_copy_and_files(tmp_path):
    X, y = stepped(300)
    fitted = quick().fit(X, y)
    expected = fitted.predict(X)
    fitted.save(tmp_path / "model.json")
    of_file = load(tmp_path / "model.json")
    assert type(of_file) is BoostedLocalLinearTreeRegressor
    for again in (pickle.loads(pickle.dumps(fitted)), copy.deepcopy(fitted), of_file):
        again.__dict__.pop("feature_names_in_", None)
        assert (again.predict(X) == expected).all()
    assert pickle.loads(pickle.dumps(fitted.model_)).to_json() == fitted.to_json()
    assert b"llmt._core" not in pickle.dumps(fitted), "the state is text and arrays"
    with pytest.raises(ValueError, match="summary"):
        of_file.summary()


def test_load_knows_either_kind_of_file_and_names_the_wrong_one(tmp_path):
    X, y = stepped(100)
    LocalLinearTreeRegressor(cv=2).fit(X, y).save(tmp_path / "tree.json")
    quick().fit(X, y).save(tmp_path / "sum.json")
    (tmp_path / "none.json").write_text("a,b\n1,2\n")
    assert type(load(tmp_path / "tree.json")) is LocalLinearTreeRegressor
    with pytest.raises(ValueError, match="sum.json: .*the sum of many trees"):
        Model.load(tmp_path / "sum.json")
    with pytest.raises(ValueError, match="tree.json: .*not a file of a boosted model"):
        BoostedModel.load(tmp_path / "tree.json")
    with pytest.raises(ValueError, match="none.json: no model"):
        load(tmp_path / "none.json")


def test_several_targets_and_rows_that_judge():
    X, y = stepped(300)
    both = np.column_stack([y, -2 * y])
    fitted = quick().fit(X, both)
    assert fitted.predict(X).shape == (300, 2) and fitted.n_iter_.shape == (2,)
    judges, observed = stepped(100, seed=5)
    judged = quick().fit(X, y, eval_set=(judges, observed))
    rmse = np.sqrt(np.mean((judged.predict(judges) - observed) ** 2))
    assert judged.summary_["sums"][0]["held_out_rmse"] == pytest.approx(rmse, rel=1e-4)
    grouped = quick().fit(X, y, groups=[f"run {row % 9}" for row in range(300)])
    assert grouped.summary_["sums"][0]["rows"] == 300


def test_contributions_are_shapley_values_against_the_background():
    X, y = stepped(300)
    fitted = quick().fit(X, y)
    background = X[:6]
    explanation = fitted.explain(X[50:53], background=background)
    assert explanation.base_values[0] == pytest.approx(fitted.predict(background).mean(), abs=1e-12)
    inputs = range(4)
    for row, values in zip(X[50:53], explanation.values):
        worth = {}
        for size in range(5):
            for members in itertools.combinations(inputs, size):
                mixed = background.copy()
                mixed[:, list(members)] = row[list(members)]
                worth[frozenset(members)] = fitted.predict(mixed).mean()
        for i in inputs:
            share = sum(
                math.factorial(len(s)) * math.factorial(3 - len(s)) / 24 * (worth[s | {i}] - worth[s])
                for s in worth
                if i not in s
            )
            assert values[i] == pytest.approx(share, abs=1e-12)
    by_default = fitted.explain(X[:5])
    np.testing.assert_allclose(by_default.values.sum(axis=1) + by_default.base_values, fitted.predict(X[:5]), atol=1e-12)
    assert fitted.feature_importances_.sum() == pytest.approx(1.0)
    assert fitted.feature_importances_.argmin() == 3


def test_what_needs_rows_says_so_where_there_are_none(tmp_path):
    X, y = stepped(100)
    quick().fit(X, y).save(tmp_path / "m.json")
    of_file = load(tmp_path / "m.json")
    for call, words in (
        (lambda: of_file.explain(X), "give them as background"),
        (lambda: of_file.partial_dependence(0), "give them as X"),
        (lambda: of_file.feature_importances_, "background"),
    ):
        with pytest.raises(ValueError, match=words):
            call()
    assert of_file.explain(X[:2], background=X).values.shape == (2, 4)


def test_partial_dependence_is_a_mean_of_predictions():
    pandas = pytest.importorskip("pandas")
    X, y = stepped(200)
    frame = pandas.DataFrame(X, columns=list("abcd")).assign(d=np.where(X[:, 3] > 0, "up", "down"))
    fitted = quick().fit(frame, y)
    values, means = fitted.partial_dependence("d")
    assert values.tolist() == ["down", "up"]
    assert means[1] == pytest.approx(fitted.predict(frame.assign(d="up")).mean(), abs=1e-12)
    values, means = fitted.partial_dependence("a", at=[0.5], X=frame)
    assert means[0] == pytest.approx(fitted.predict(frame.assign(a=0.5)).mean(), abs=1e-12)
    with pytest.raises(ValueError, match="'z'"):
        fitted.partial_dependence("z")
    with pytest.raises(ValueError, match="'sideways' is no category"):
        fitted.partial_dependence("d", at=["sideways"])


@pytest.mark.parametrize(
    ("call", "words"),
    [
        (lambda X, y: quick(learning_rate=0.0).fit(X, y), "learning_rate is 0.0"),
        (lambda X, y: BoostedLocalLinearTreeRegressor(max_iter=0).fit(X, y), "max_iter is 0"),
        (lambda X, y: quick(n_jobs=-3).fit(X, y), "n_jobs is -3"),
        (lambda X, y: quick().fit(X, y).predict(X[:, :3]), "BoostedLocalLinearTreeRegressor is expecting 4 features"),
        (lambda X, y: quick().fit(X, y).to_onnx(), r"a sum of \d+ trees with \d+ leaves .* to_c\(\) writes it"),
        (lambda X, y: quick().fit(X, y).to_sql(), r"to_sql\(\): a sum of"),
    ],
)
def test_what_is_wrong_is_named(call, words):
    X, y = stepped(100)
    with pytest.raises(ValueError, match=words):
        call(X, y)


def test_of_too_few_rows_the_mean_is_the_model():
    X, y = stepped(8)
    with pytest.warns(UserWarning, match="the model is the mean of y"):
        fitted = quick().fit(np.repeat(X, 5, axis=0), np.repeat(y, 5))
    assert fitted.predict(X) == pytest.approx(np.full(8, y.mean()))
    assert fitted.n_iter_ == 0 and fitted.summary_["sums"][0]["held_out_rmse"] is None
    with pytest.raises(ValueError, match="this model has none"):
        fitted.predict_interval(X)


def test_intervals_hold_about_what_they_promise():
    X, y = stepped(1000)
    fitted = BoostedLocalLinearTreeRegressor().fit(X, y)
    new, observed = stepped(4000, seed=7)
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")  # some rows lie outside
        ends = fitted.predict_interval(new, coverage=0.9)
        quantiles = fitted.predict_quantiles(new, [0.05, 0.4, 0.5, 0.95])
    np.testing.assert_array_equal(quantiles[:, [0, 3]], ends)
    np.testing.assert_array_equal(quantiles[:, 2], fitted.predict(new))
    assert (np.diff(quantiles, axis=1) >= 0).all()
    np.testing.assert_allclose(ends.mean(axis=1), fitted.predict(new), atol=1e-12)
    # 1000 residuals, and as many new rows
    assert 0.84 < ((observed >= ends[:, 0]) & (observed <= ends[:, 1])).mean() < 0.96
    with pytest.raises(ValueError, match="needs at least 1999 held-out rows"):
        fitted.predict_interval(X, coverage=0.9995)


def test_gross_errors_are_told_with_what_helps():
    X, y = stepped(200)
    y[7] = 1e4
    with pytest.warns(UserWarning, match=r'LocalLinearTreeRegressor\(loss="tukey"\)'):
        quick().fit(X, y)


def test_source_in_c_and_texts():
    X, y = stepped(200)
    fitted = quick().fit(X, y)
    source, header = fitted.to_c("heat")
    assert "heat_predict" in source and "heat_predict" in header
    assert f"the sum of {fitted.n_iter_} trees" in str(fitted)
    assert "RMSE held out" in fitted.summary()
    assert repr(quick()) == "BoostedLocalLinearTreeRegressor(max_iter=20)"


INTERRUPTED = """
import signal, threading, time, numpy as np
from llmt import BoostedLocalLinearTreeRegressor
X = np.random.default_rng(0).normal(size=(200000, 10)); y = np.sin(X[:, 0] * 3) + X[:, 1] * X[:, 2]
print("ready", flush=True)
try:
    BoostedLocalLinearTreeRegressor().fit(X, y)
except KeyboardInterrupt:
    print("interrupted", sum(t.name != "MainThread" for t in threading.enumerate()), flush=True)
"""


def test_ctrl_c_ends_a_fit():
    child = subprocess.Popen([sys.executable, "-c", INTERRUPTED], stdout=subprocess.PIPE, text=True)
    assert child.stdout.readline() == "ready\n"
    time.sleep(0.8)
    child.send_signal(signal.SIGINT)
    output, _ = child.communicate(timeout=60)
    assert output == "interrupted 0\n"


# One row against 1000 others: 300 leaves at whose limits 12 inputs meet, which are tried some 1000 times for each of them.
EXPLAINED = """
import json, sys, threading, numpy as np, llmt
n = 12
leaf = [0.0, -0.01, 0.01] + [number for j in range(n) for number in (j, 1.0 if j % 2 else -1.0)]
inputs = [{"name": f"i{j}", "low": 0.0, "high": 1.0, "centre": 0.5, "deviation": 0.3} for j in range(n)]
model = {"format": "llmt-boosted-model", "version": 1, "inputs": inputs,
         "outputs": [{"name": "y", "low": 0.0, "high": 1.0}],
         "sums": [{"base": 0.5, "rate": 0.1, "features": [{"column": j} for j in range(n)],
                   "trees": [{"splits": [], "leaves": [leaf]}] * 300}]}
open(sys.argv[1], "w").write(json.dumps(model))
X = np.random.default_rng(0).uniform(size=(1000, n))
model = llmt.load(sys.argv[1])  # imports what it needs: Python ends by SIGINT where one came during an import, caught or not
try:
    print("ready", flush=True)
    model.explain(X[:1], X)
except KeyboardInterrupt:
    print("interrupted", sum(t.name != "MainThread" for t in threading.enumerate()), flush=True)
"""


def test_ctrl_c_ends_an_explanation_of_one_row(tmp_path):
    command = [sys.executable, "-c", EXPLAINED, str(tmp_path / "m.json")]
    child = subprocess.Popen(command, stdout=subprocess.PIPE, text=True)
    assert child.stdout.readline() == "ready\n"
    time.sleep(0.5)
    sent = time.monotonic()
    child.send_signal(signal.SIGINT)
    assert child.stdout.readline() == "interrupted 0\n"
    print(f"interrupted after {time.monotonic() - sent:.2f} s")
    assert child.wait(timeout=60) == 0


def test_progress_is_reported():
    from llmt import _core

    X, y = stepped(600)
    seen = []
    options = {"max_rounds": 200}
    _core.boost(
        X, y.reshape(-1, 1), options, input_names=list("abcd"), output_names=["y"], levels=[[]] * 4,
        report=lambda done, total, step: seen.append(done / total),
    )
    assert seen and seen == sorted(seen) and seen[-1] <= 1.0
