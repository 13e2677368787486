"""Fits by sums: the functions over bytes, and what Dask does with them."""

import itertools
import json
import pickle

import numpy as np
import pytest

from llmt import LocalLinearTreeRegressor, distributed

BLOCK = 128
NOISE = 0.05


def table(rows=1500):
    rng = np.random.default_rng(1)
    X = rng.uniform(-1, 1, (rows, 3))
    return X, np.where(X[:, 0] > 0, 4 * X[:, 1], np.abs(X[:, 2])) + NOISE * rng.normal(size=rows)


def begin(**options):
    return distributed.start(["a", "b", "c"], "y", block_rows=BLOCK, estimator=LocalLinearTreeRegressor(**options))


def run(shards, state):
    """`shards`: pairs of first row and row behind the last."""
    X, y = table()
    while distributed.status(state)["step"] != "finished":
        parts = [distributed.sums(state, X[a:b], y[a:b], a // BLOCK) for a, b in shards]
        state = distributed.advance(state, distributed.merge(parts))
    return state


def started(branch_rows):
    estimator = LocalLinearTreeRegressor(validity="crisp", max_leaves=6)
    memory = {"branch_rows": branch_rows, "sample_rows": min(branch_rows, 600)}
    return distributed.start(["a", "b", "c"], "y", **memory, block_rows=BLOCK, estimator=estimator)


def test_the_same_bytes_for_any_shards_in_any_order():
    whole = run([(0, 1500)], started(600))
    cut = run([(1024, 1500), (0, 512), (512, 1024), (0, 0)], started(600))
    assert cut == whole
    status = distributed.status(whole)
    assert status["step"] == "finished" and status["rows"] == 1500 and status["branches_done"] >= 2
    X, y = table()
    predicted = distributed.estimator(whole).predict(X)
    assert np.sqrt(np.mean((predicted - y) ** 2)) < 2 * NOISE


def test_a_table_that_fits_becomes_the_model_of_fit():
    pandas = pytest.importorskip("pandas")
    X, y = table()
    state = run([(0, 1500)], started(1500))
    expected = LocalLinearTreeRegressor(validity="crisp", max_leaves=6).fit(
        pandas.DataFrame(X, columns=["a", "b", "c"]), pandas.Series(y, name="y")
    )
    assert distributed.estimator(state).to_json() == expected.to_json()


def test_what_does_not_go_is_named():
    X, y = table()
    state = started(600)
    with pytest.raises(ValueError, match="rule m5 is not possible beyond one memory; take rd"):
        begin(rule="m5")
    with pytest.raises(ValueError, match="monotonic_cst"):
        begin(monotonic_cst={"a": 1})
    with pytest.raises(ValueError, match="cv must be a number"):
        begin(cv=[([0], [1]), ([1], [0])])
    with pytest.raises(ValueError, match="blocks 0 to 1 are missing"):
        distributed.advance(state, distributed.sums(state, X[:99], y[:99], 2))
    with pytest.raises(ValueError, match="row 1 of y"):
        distributed.sums(state, X[:3], np.array([1.0, np.nan, 2.0]))
    with pytest.raises(ValueError, match="has words, and start was not given"):
        distributed.sums(state, np.array([["a", "b", "c"]], dtype=object), y[:1])
    with pytest.raises(ValueError, match="there is one target"):
        distributed.sums(state, X, np.column_stack([y, y]))
    with pytest.raises(ValueError, match="state"):
        distributed.status(state[:-1])


# Dask


@pytest.fixture
def frames(tmp_path):
    """A frame of Dask with a partition that has no rows, and the partitions' limits."""
    dask = pytest.importorskip("dask")
    pandas = pytest.importorskip("pandas")
    frame = pytest.importorskip("dask.dataframe")
    X, y = table()
    all_ = pandas.DataFrame(X, columns=["a", "b", "c"]).assign(y=y)
    limits = [0, 300, 300, 812, 1400, 1500]
    parts = [dask.delayed(all_.iloc[a:b]) for a, b in itertools.pairwise(limits)]
    with dask.config.set(scheduler="threads", num_workers=2):
        yield frame.from_delayed(parts, meta=all_.iloc[:0]), limits


def by_hand(limits, state):
    """The same without Dask: every partition begins a block."""
    X, y = table()
    while distributed.status(state)["step"] != "finished":
        parts, block = [], 0
        for a, b in itertools.pairwise(limits):
            parts.append(distributed.sums(state, X[a:b], y[a:b], block))
            block += -(-(b - a) // BLOCK)
        state = distributed.advance(state, distributed.merge(parts))
    return distributed.estimator(state).to_json()


OPTIONS = {
    "branch_rows": 600,
    "sample_rows": 600,
    "block_rows": BLOCK,
    "estimator": LocalLinearTreeRegressor(validity="crisp", max_leaves=6),
}


def test_dask_gives_the_bytes_of_one_process(frames, tmp_path):
    from llmt import dask as llmt_dask

    frame, limits = frames
    model = llmt_dask.fit(frame, "y", **OPTIONS)
    assert model.to_json() == by_hand(limits, started(600))
    predicted = llmt_dask.predict(model, frame).compute()
    assert predicted.name == "y_pred"
    np.testing.assert_array_equal(predicted.to_numpy(), model.predict(table()[0]))


def test_graphs_go_to_other_processes(frames):
    from llmt import dask as llmt_dask

    merged = llmt_dask._merged([llmt_dask._constant(distributed.sums(started(600), *table(99)))] * 9)
    with pytest.raises(ValueError, match="block 0 is in both"):
        pickle.loads(pickle.dumps(merged)).compute()


def test_dask_reads_a_folder_of_parquet_files_piece_by_piece(frames, tmp_path):
    pytest.importorskip("pyarrow")
    from llmt import dask as llmt_dask

    frame, limits = frames
    for number, (a, b) in enumerate(itertools.pairwise(limits)):
        part = frame.compute().iloc[a:b]
        part.to_parquet(tmp_path / f"{number}.parquet", row_group_size=70)
    model = llmt_dask.fit(tmp_path, "y", inputs=["a", "b", "c"], **OPTIONS)
    assert model.to_json() == by_hand(limits, started(600))
    assert len(llmt_dask.predict(model, tmp_path).compute()) == 1500
    (tmp_path / "2.parquet").unlink()
    files = sorted(tmp_path.glob("*.parquet"))
    files[0].write_bytes(files[0].read_bytes()[:-9])
    with pytest.raises((ValueError, OSError), match="0.parquet"):
        llmt_dask.fit(tmp_path, "y", **OPTIONS)
    with pytest.raises(FileNotFoundError, match="nowhere"):
        llmt_dask.fit(tmp_path / "nowhere", "y")


def test_dask_goes_on_from_a_checkpoint_and_names_what_is_wrong(frames, tmp_path, monkeypatch):
    from llmt import dask as llmt_dask

    frame, limits = frames
    expected = llmt_dask.fit(frame, "y", **OPTIONS).to_json()
    checkpoint = tmp_path / "state"

    class Died(Exception):
        pass

    passes = []
    whole = distributed.advance

    def dies(state, sums):
        if len(passes) == 2:
            raise Died
        passes.append(distributed.status(state)["step"])
        return whole(state, sums)

    monkeypatch.setattr(distributed, "advance", dies)
    with pytest.raises(Died):
        llmt_dask.fit(frame, "y", checkpoint=checkpoint, **OPTIONS)
    monkeypatch.setattr(distributed, "advance", whole)
    assert passes == ["describe", "grow"] and distributed.status(checkpoint.read_bytes())["passes"] == 2
    assert llmt_dask.fit(frame, "y", checkpoint=checkpoint, resume=True, **OPTIONS).to_json() == expected
    assert json.loads(expected)["format"]
    with pytest.raises(ValueError, match="other columns or with other parameters"):
        llmt_dask.fit(frame, "y", inputs=["a"], checkpoint=checkpoint, resume=True, **OPTIONS)
    with pytest.raises(ValueError, match='no column "z"'):
        llmt_dask.fit(frame, "z", **OPTIONS)
    broken = frame.assign(y=frame.y.where(frame.a < 0.99))
    with pytest.raises(ValueError, match=r'partition \d, rows from 0: row \d+, column "y" is nan'):
        llmt_dask.fit(broken, "y", **OPTIONS)
    with pytest.raises(ValueError, match='no column "w"'):
        llmt_dask.fit(frame, "y", weight="w", **OPTIONS)


def mixed(rows=1500):
    """A table with words, weights 0 to 3, and a column for the words' places."""
    pandas = pytest.importorskip("pandas")
    rng = np.random.default_rng(3)
    words = np.array(["high", "low", "mid"])
    place = rng.integers(0, 3, rows)
    a = rng.uniform(-1, 1, rows)
    y = np.array([3.0, -3.0, 0.0])[place] + np.abs(a) * 2 + NOISE * rng.normal(size=rows)
    return pandas.DataFrame({"a": a, "w": words[place], "k": rng.integers(0, 4, rows), "y": y})


def test_words_and_weights_by_any_shards():
    rows = mixed()
    first = distributed.start(
        ["a", "w"],
        "y",
        branch_rows=500,
        sample_rows=500,
        block_rows=BLOCK,
        levels={"w": ["high", "low", "mid"]},
        weighted=True,
        estimator=LocalLinearTreeRegressor(validity="crisp", max_leaves=6),
    )
    results = []
    for limits in ([0, 1500], [0, 128, 1024, 1500]):
        state = first
        while distributed.status(state)["step"] != "finished":
            parts = [
                distributed.sums(state, of[["a", "w"]], of["y"], begin // BLOCK, sample_weight=of["k"])
                for begin, end in itertools.pairwise(limits)
                for of in [rows.iloc[begin:end]]
            ]
            state = distributed.advance(state, distributed.merge(parts))
        results.append(state)
    assert results[0] == results[1]
    model = distributed.estimator(results[0])
    errors = model.predict(rows[["a", "w"]]) - rows["y"]
    assert np.sqrt(np.average(errors**2, weights=rows["k"])) < 2 * NOISE
    with pytest.raises(ValueError, match='column "w" has 1 cells with a word that is none of the levels'):
        distributed.sums(first, rows[["a", "w"]].head(1).assign(w="none"), rows["y"].head(1))
    with pytest.raises(ValueError, match="0 weights of 1 rows"):
        distributed.sums(first, rows[["a", "w"]].head(1), rows["y"].head(1))
    with pytest.raises(ValueError, match='levels has "z", which is no input'):
        distributed.start(["a", "w"], "y", levels={"z": ["low"]})


@pytest.mark.parametrize("kind", ["frame", "category", "folder"])
def test_dask_finds_words_and_takes_weights(tmp_path, kind):
    dask = pytest.importorskip("dask")
    frames = pytest.importorskip("dask.dataframe")
    from llmt import dask as llmt_dask

    rows = mixed()
    # The first partition lacks a word that the others have, and one has no rows.
    parts = [rows[:700][rows.w[:700] != "mid"], rows[:0], rows[700:]]
    kept = rows.loc[[index for part in parts for index in part.index]]
    if kind == "category":
        parts = [part.astype({"w": "category"}) for part in parts]
    expected = LocalLinearTreeRegressor(validity="crisp", max_leaves=6).fit(
        kept[["a", "w"]], kept["y"], sample_weight=kept["k"].to_numpy(float)
    )
    with dask.config.set(scheduler="threads", num_workers=2):
        if kind == "folder":
            pytest.importorskip("pyarrow")
            for number, part in enumerate(parts):
                part.to_parquet(tmp_path / f"{number}.parquet")
            table = tmp_path
        else:
            table = frames.from_delayed([dask.delayed(part) for part in parts], meta=parts[0].iloc[:0], verify_meta=False)
        options = {"estimator": LocalLinearTreeRegressor(validity="crisp", max_leaves=6), "weight": "k"}
        whole = llmt_dask.fit(table, "y", **options)
        assert whole.to_json() == expected.to_json()
        large = llmt_dask.fit(table, "y", branch_rows=400, sample_rows=400, block_rows=BLOCK, **options)
        predicted = llmt_dask.predict(large, table).compute().to_numpy()
    assert np.sqrt(np.average((predicted - kept["y"]) ** 2, weights=kept["k"])) < 2 * NOISE


@pytest.mark.parametrize("kind", ["datetime64", "Arrow", "folder"])
def test_dask_leaves_dates_out(tmp_path, kind):
    """Before, they were numbers: microseconds since 1970."""
    dask = pytest.importorskip("dask")
    frames = pytest.importorskip("dask.dataframe")
    pa = pytest.importorskip("pyarrow")
    pd = pytest.importorskip("pandas")
    from llmt import dask as llmt_dask

    rows = mixed()
    dated = rows.assign(when=pd.date_range("2024-01-01", periods=len(rows), freq="h"))
    if kind == "Arrow":
        dated["when"] = dated["when"].astype(pd.ArrowDtype(pa.date32()))
    options = {"estimator": LocalLinearTreeRegressor(validity="crisp", max_leaves=6), "weight": "k"}
    with dask.config.set(scheduler="synchronous"):
        if kind == "folder":
            dated.to_parquet(tmp_path / "0.parquet")
            table = tmp_path
        else:
            table = frames.from_pandas(dated, npartitions=2)
        with pytest.warns(UserWarning, match='column "when" has dates, and is left out; give a number, as days'):
            model = llmt_dask.fit(table, "y", **options)
        plain = llmt_dask.fit(frames.from_pandas(rows, npartitions=2), "y", **options)
        assert model.to_json() == plain.to_json()
        assert len(llmt_dask.predict(model, table).compute()) == len(rows)
        with pytest.raises(ValueError, match='column "when" holds dates'):
            llmt_dask.fit(table, "y", inputs=["a", "when"], **options)


def test_partitions_of_other_kinds_are_named(tmp_path):
    dask = pytest.importorskip("dask")
    frames = pytest.importorskip("dask.dataframe")
    from llmt import dask as llmt_dask

    rows = mixed(300)

    def refused(second, match):
        parts = [dask.delayed(rows[:150]), dask.delayed(second)]
        table = frames.from_delayed(parts, meta=rows.iloc[:0], verify_meta=False)
        with pytest.raises((TypeError, ValueError), match=match), dask.config.set(scheduler="threads"):
            llmt_dask.fit(table, "y", **OPTIONS)

    refused(rows[150:].drop(columns="a"), 'partition 1: column "a" is missing')
    refused(rows[150:].drop(columns="w"), 'partition 1: column "w" is missing')
    refused(rows[150:].assign(w=1.0), 'partition 1: column "w" has numbers, and words in other partitions')
    refused(rows[150:].assign(a="many"), 'partition 0: column "a" has numbers, and words in other partitions')
    refused(rows[150:].assign(y="many"), 'partition 1: column "y" has words')
    refused(rows[150:].assign(y=np.inf), r'partition 1, rows from 0: row 0, column "y" is inf')
    refused(rows[150:].assign(a=-np.inf), r'partition 1, rows from 0: row 0, column "a" is -inf')
    with pytest.raises(ValueError, match="no rows"), dask.config.set(scheduler="threads"):
        llmt_dask.fit(frames.from_delayed([dask.delayed(rows[:0])], meta=rows.iloc[:0]), "y")
