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
    return distributed.start(["a", "b", "c"], "y", branch_rows=branch_rows, block_rows=BLOCK, estimator=estimator)


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
    with pytest.raises(ValueError, match="growth rule"):
        begin(rule="m5")
    with pytest.raises(ValueError, match="monotonic_cst"):
        begin(monotonic_cst={"a": 1})
    with pytest.raises(ValueError, match="cv must be a number"):
        begin(cv=[([0], [1]), ([1], [0])])
    with pytest.raises(ValueError, match="blocks 0 to 1 are missing"):
        distributed.advance(state, distributed.sums(state, X[:99], y[:99], 2))
    with pytest.raises(ValueError, match="row 1 of y"):
        distributed.sums(state, X[:3], np.array([1.0, np.nan, 2.0]))
    with pytest.raises(ValueError, match="has words"):
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


OPTIONS = {"branch_rows": 600, "block_rows": BLOCK, "estimator": LocalLinearTreeRegressor(validity="crisp", max_leaves=6)}


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
    with pytest.raises(ValueError, match=r'partition \d: column "w" has words'):
        llmt_dask.fit(frame.assign(w="low"), "y", **OPTIONS)
