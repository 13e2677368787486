"""Fits of Spark DataFrames, by Spark in this process."""

import itertools

import numpy as np
import pytest

from llmt import LocalLinearTreeRegressor, distributed

BLOCK = 128
OPTIONS = {"branch_rows": 600, "sample_rows": 600, "block_rows": BLOCK}


@pytest.fixture(scope="module")
def session():
    sql = pytest.importorskip("pyspark.sql")
    builder = sql.SparkSession.builder.master("local[2]").config("spark.ui.enabled", "false")
    try:
        made = builder.config("spark.driver.bindAddress", "127.0.0.1").getOrCreate()
    except Exception as error:  # pyspark's own type differs with what is missing
        pytest.skip(f"Spark does not start: {error}")
    yield made
    made.stop()


def test_spark_gives_the_bytes_of_one_process(session):
    from llmt import spark as llmt_spark

    rng = np.random.default_rng(1)
    X = rng.uniform(-1, 1, (1500, 3))
    y = np.where(X[:, 0] > 0, 4 * X[:, 1], np.abs(X[:, 2])) + 0.05 * rng.normal(size=1500)
    estimator = LocalLinearTreeRegressor(validity="crisp", max_leaves=6)
    rows = session.sparkContext.parallelize(np.column_stack([X, y]).tolist(), 4)
    model = llmt_spark.fit(rows.toDF(["a", "b", "c", "y"]), "y", estimator=estimator, **OPTIONS)

    starts = np.cumsum([0, *rows.mapPartitions(lambda part: [len(list(part))]).collect()])
    state = distributed.start(["a", "b", "c"], "y", estimator=estimator, **OPTIONS)
    while distributed.status(state)["step"] != "finished":
        parts, block = [], 0
        for begin, end in itertools.pairwise(starts):
            parts.append(distributed.sums(state, X[begin:end], y[begin:end], block))
            block += -(-(end - begin) // BLOCK)
        state = distributed.advance(state, distributed.merge(parts))
    assert distributed.status(state)["passes"] > 2
    assert model.to_json() == distributed.estimator(state).to_json()
