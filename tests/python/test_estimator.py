"""The estimator: scikit-learn's contract, weights, threads, interrupts, and the bytes of the command line."""

import copy
import hashlib
import multiprocessing
import os
import pickle
import signal
import subprocess
import sys
import threading
import time
from concurrent.futures import ThreadPoolExecutor

import numpy as np
import pytest
from estimators import meet_scikit_learn, stepped

from llmt import LocalLinearTreeRegressor, Model, _core

PROGRAM = os.environ.get("LLMT_PROGRAM", "")


@pytest.fixture(scope="module")
def fitted():
    """By default options, to stepped(300); no test changes it."""
    return LocalLinearTreeRegressor().fit(*stepped(300))


def test_check_estimator():
    meet_scikit_learn(LocalLinearTreeRegressor())


@pytest.mark.parametrize("options", [{}, {"validity": "crisp"}, {"rule": "retis"}, {"local_models": "auto"}, {"loss": "tukey"}])
def test_a_weight_is_a_number_of_copies(options):
    X, y = stepped(200)
    weights = np.random.default_rng(1).integers(0, 4, len(y))
    repeated = LocalLinearTreeRegressor(**options).fit(np.repeat(X, weights, axis=0), np.repeat(y, weights))
    weighted = LocalLinearTreeRegressor(**options).fit(X, y, sample_weight=weights)
    assert weighted.to_json() == repeated.to_json()
    assert weighted.model_.to_dict()["partitions"][0]["nodes"][1:], "the tree has no split: the test would prove little"


def test_same_bytes_for_any_number_of_threads_and_any_order_in_memory():
    X, y = stepped(200)
    orders = [(2, np.asfortranarray(X)), (2, X[:, ::-1][:, ::-1]), (2, X.tolist())]
    texts = {
        LocalLinearTreeRegressor(n_jobs=jobs, cv=3).fit(rows, y).to_json()
        for jobs, rows in [(1, X), (2, X), (5, X), *orders]
    }
    assert len(texts) == 1


@pytest.mark.skipif(not PROGRAM, reason="LLMT_PROGRAM does not name the program llmt")
def test_the_command_line_writes_the_same_bytes(tmp_path):
    pandas = pytest.importorskip("pandas")
    frame = pandas.read_csv(os.path.join(os.path.dirname(__file__), "../../docs/samples/heat_pump.csv")).head(300)
    frame.to_csv(tmp_path / "rows.csv", index=False)
    command = [PROGRAM, "fit", tmp_path / "rows.csv", "--target", "cop", "-o", tmp_path / "model.json", "--readable"]
    subprocess.run(command, check=True, stdout=subprocess.DEVNULL)
    fitted = LocalLinearTreeRegressor(readable=True).fit(frame.drop(columns="cop"), frame["cop"])
    assert fitted.accurate_model_.to_json() == (tmp_path / "model.json").read_text()
    assert fitted.to_json() == (tmp_path / "model.readable.json").read_text()


def test_an_estimator_survives_pickle_copy_and_files(fitted, tmp_path):
    X, _ = stepped(300)
    expected = fitted.predict(X)
    fitted.save(tmp_path / "model.json")
    for again in (
        pickle.loads(pickle.dumps(fitted)),
        copy.deepcopy(fitted),
        LocalLinearTreeRegressor.load(tmp_path / "model.json"),
    ):
        again.__dict__.pop("feature_names_in_", None)
        assert (again.predict(X) == expected).all()
    assert pickle.loads(pickle.dumps(fitted.model_)).to_json() == fitted.to_json()
    with pytest.raises(ValueError, match="model"):
        Model("{}")
    half_made = Model.__new__(Model)
    with pytest.raises(AttributeError):
        half_made.to_json()


def test_intervals_hold_what_they_promise():
    X, y = stepped(1000)
    fitted = LocalLinearTreeRegressor().fit(X, y)
    new, observed = stepped(4000, seed=7)
    ends = fitted.predict_interval(new, coverage=0.9)
    assert ends.shape == (4000, 2)
    inside = ((observed >= ends[:, 0]) & (observed <= ends[:, 1])).mean()
    assert 0.88 < inside < 0.94


def test_contributions_add_up_to_the_prediction(fitted):
    X, _ = stepped(300)
    explanation = fitted.explain(X[:50])
    total = explanation.values.sum(axis=1) + explanation.base_values
    np.testing.assert_allclose(total, fitted.predict(X[:50]), rtol=0, atol=1e-9)


def test_folds_of_a_splitter_and_of_groups():
    X, y = stepped(200)
    folds = [(np.arange(200) % 4 != fold, np.flatnonzero(np.arange(200) % 4 == fold)) for fold in range(4)]
    by_list = LocalLinearTreeRegressor(cv=folds).fit(X, y)
    assert by_list.summary_["partitions"][0]["cv_folds"] == 4
    with pytest.raises(ValueError, match="every row once"):
        LocalLinearTreeRegressor(cv=folds[:3]).fit(X, y)
    by_group = LocalLinearTreeRegressor(cv=4).fit(X, y, groups=[f"run {row % 4}" for row in range(200)])
    assert by_group.summary_["partitions"][0]["cv_folds"] == 4


def test_monotonic_by_name_and_position(fitted):
    pandas = pytest.importorskip("pandas")
    X, y = stepped(300)
    frame = pandas.DataFrame(X, columns=list("abcd"))
    falling = LocalLinearTreeRegressor(monotonic_cst={"b": -1}, cv=3).fit(frame, y)
    line = np.repeat([[0.6, 0.0, 0.0, 0.0]], 200, axis=0)  # where y rises with b
    line[:, 1] = np.linspace(-1, 1, 200)
    assert np.ptp(fitted.predict(line)) > 1
    assert (np.diff(falling.predict(pandas.DataFrame(line, columns=list("abcd")))) <= 0).all()
    with pytest.raises(ValueError, match="'z'"):
        LocalLinearTreeRegressor(monotonic_cst={"z": 1}).fit(frame, y)
    with pytest.raises(ValueError, match="3 entries for 4 columns"):
        LocalLinearTreeRegressor(monotonic_cst=[1, 0, 0]).fit(X, y)


@pytest.mark.parametrize(
    ("options", "words"),
    [
        ({"rule": "best"}, "rd, retis"),
        ({"max_leaves": -1}, "max_leaves"),
        ({"max_leaves": 2.5}, "max_leaves"),
        ({"cv": 1}, "fold"),
        ({"readable": True, "cv": 0}, "readable"),
        ({"validity": 3}, "validity"),
    ],
)
def test_a_wrong_parameter_is_named(options, words):
    X, y = stepped(100)
    with pytest.raises((ValueError, TypeError), match=words):
        LocalLinearTreeRegressor(**options).fit(X, y)


def test_several_targets():
    X, y = stepped(200)
    both = np.column_stack([y, -2 * y])
    fitted = LocalLinearTreeRegressor(cv=3).fit(X, both)
    assert fitted.predict(X).shape == (200, 2)
    assert fitted.predict_interval(X).shape == (200, 2, 2)
    assert LocalLinearTreeRegressor(cv=3).fit(X, y.reshape(-1, 1)).predict(X).shape == (200, 1)


def test_partial_fit_goes_on_where_it_stopped():
    X, y = stepped(3000)
    whole = LocalLinearTreeRegressor().partial_fit(X, y)
    pieces = LocalLinearTreeRegressor()
    for first in range(0, 3000, 1000):
        pieces = pickle.loads(pickle.dumps(pieces.partial_fit(X[first : first + 1000], y[first : first + 1000])))
    assert pieces.to_json() == whole.to_json()
    assert np.sqrt(np.mean((whole.predict(X) - y) ** 2)) < 0.5 * y.std()


def test_shards_learned_apart_are_merged():
    X, y = stepped(6000)
    first = LocalLinearTreeRegressor().partial_fit(X[:3000], y[:3000])
    second = pickle.loads(pickle.dumps(LocalLinearTreeRegressor().partial_fit(X[3000:], y[3000:])))
    before = second.to_json()
    assert first.merge(second) is first
    assert first.summary_["rows"] == 6000
    assert second.to_json() == before
    assert np.sqrt(np.mean((first.predict(X) - y) ** 2)) < 0.5 * y.std()
    goes_on = pickle.loads(pickle.dumps(first))
    assert first.partial_fit(X[:100], y[:100]).to_json() == goes_on.partial_fit(X[:100], y[:100]).to_json()


def test_only_streams_of_the_same_columns_are_merged(fitted):
    X, y = stepped(400)
    stream = LocalLinearTreeRegressor().partial_fit(X, y)
    with pytest.raises(ValueError, match="merge needs two estimators that have learned by partial_fit"):
        stream.merge(fitted)
    with pytest.raises(ValueError, match=r"columns \['x0', .* do not go with"):
        stream.merge(LocalLinearTreeRegressor().partial_fit(X[:, :1], y))
    with pytest.raises(ValueError, match="the streams have different options"):
        stream.merge(LocalLinearTreeRegressor(max_leaves=3).partial_fit(X, y))


def test_fits_in_threads_give_the_same_bytes():
    X, y = stepped(200)
    expected = LocalLinearTreeRegressor(n_jobs=1, cv=3).fit(X, y).to_json()
    with ThreadPoolExecutor(4) as pool:
        texts = list(pool.map(lambda _: LocalLinearTreeRegressor(n_jobs=1, cv=3).fit(X, y).to_json(), range(8)))
    assert set(texts) == {expected}


def _digest(seed):
    X, y = stepped(200, seed)
    return hashlib.sha256(LocalLinearTreeRegressor(cv=3).fit(X, y).to_json().encode()).hexdigest()


@pytest.mark.parametrize(("start", "processes"), [("fork", 2), ("spawn", 1)])  # a new interpreter imports all once more
def test_fits_in_processes_give_the_same_bytes(start, processes):
    expected = _digest(3)  # before the fork, so that the parent has threads
    with multiprocessing.get_context(start).Pool(processes) as pool:
        assert pool.map_async(_digest, [3, 3, 3]).get(timeout=120) == [expected] * 3


INTERRUPTED = """
import signal, threading, time, numpy as np
from llmt import LocalLinearTreeRegressor
X = np.random.default_rng(0).normal(size=(200000, 10)); y = np.sin(X[:, 0] * 3) + X[:, 1] * X[:, 2]
for _ in range(2):
    try:
        print("ready", flush=True)
        LocalLinearTreeRegressor().fit(X, y)
    except KeyboardInterrupt:
        print("interrupted", sum(t.name != "MainThread" for t in threading.enumerate()), flush=True)
"""


def test_ctrl_c_ends_a_fit_early_and_late_and_a_second_fit_of_the_same_process():
    child = subprocess.Popen([sys.executable, "-c", INTERRUPTED], stdout=subprocess.PIPE, text=True)
    for after in (0.3, 1.5):
        assert child.stdout.readline() == "ready\n"
        time.sleep(after)
        sent = time.monotonic()
        child.send_signal(signal.SIGINT)
        assert child.stdout.readline() == "interrupted 0\n"
        print(f"interrupted after {time.monotonic() - sent:.2f} s")
    output, _ = child.communicate(timeout=60)
    assert (output, child.returncode) == ("", 0)


@pytest.mark.parametrize(
    ("call", "rows"), [("predict", 30000), ("extrapolation", 30000), ("intervals", 3000), ("attribute", 15)]
)
def test_calls_of_many_rows_look_for_ctrl_c_between_blocks(fitted, call, rows):
    X, _ = stepped(300)
    handle = fitted.model_.handle
    before = _core.looks_for_signals()
    getattr(handle, call)(np.resize(X, (rows, X.shape[1])), *([0.9] if call == "intervals" else []))
    assert _core.looks_for_signals() - before == 3


def test_nothing_is_printed_and_no_file_is_written(tmp_path, capfd, monkeypatch):
    monkeypatch.chdir(tmp_path)
    X, y = stepped(200)
    LocalLinearTreeRegressor(cv=3).fit(X, y).predict(X)
    assert capfd.readouterr() == ("", "")
    assert os.listdir(tmp_path) == []
    assert threading.active_count() >= 1


def test_the_model_can_be_taken_elsewhere():
    X, y = stepped(300)
    fitted = LocalLinearTreeRegressor(validity="crisp", cv=3).fit(X, y)
    names = {}
    exec(fitted.to_python("predict"), names)
    np.testing.assert_array_equal(np.ravel([names["predict"](row) for row in X[:50]]), fitted.predict(X[:50]))
    assert "SELECT" in fitted.to_sql("data").upper()
    source, header = fitted.to_c("model")
    assert "model_predict" in source and "model_predict" in header


def test_rows_of_eval_set_choose_and_do_not_enter():
    X, y = stepped(600)
    judges, observed = stepped(300, seed=5)
    is_complete = ~np.isnan(judges).any(axis=1)  # in the error of the summary incomplete rows have weights of their own
    judges, observed = judges[is_complete], observed[is_complete]
    fitted = LocalLinearTreeRegressor(validity="crisp").fit(X, y, eval_set=(judges, observed))
    predicted = fitted.predict(judges)
    rmse = np.sqrt(np.mean((predicted - observed) ** 2))
    assert fitted.summary_["partitions"][0]["cv_rmse"] == pytest.approx(rmse, rel=1e-9)
    again = LocalLinearTreeRegressor(validity="crisp").fit(X, y, eval_set=[(judges, observed + 1e-9)])
    nodes = [model.model_.to_dict()["partitions"][0]["nodes"] for model in (fitted, again)]
    assert nodes[0] == nodes[1]
    assert 0.85 < np.mean((lambda ends: (ends[:, 0] <= observed) & (observed <= ends[:, 1]))(fitted.predict_interval(judges))) < 0.95
    with pytest.raises(ValueError, match="groups"):
        LocalLinearTreeRegressor().fit(X, y, groups=np.arange(600) // 10, eval_set=(judges, observed))
    with pytest.raises(ValueError, match="3 features"):
        LocalLinearTreeRegressor().fit(X, y, eval_set=(judges[:, :3], observed))


def test_the_tree_is_drawn_with_its_error_and_its_coverage():
    X, y = stepped(400)
    fitted = LocalLinearTreeRegressor(validity="crisp").fit(X, y)
    for shown in (str(fitted), fitted._repr_html_()):
        assert "ntervals hold" in shown and "least squares" in shown and "x0" in shown
