"""Fits of Spark DataFrames.

>>> from llmt import spark as llmt_spark
>>> model = llmt_spark.fit(session.read.parquet("measurements/"), "y")    # doctest: +SKIP

A pass over the table is one `treeReduce` of the partitions' sums. Nothing lives between tasks, so Spark computes those
of a lost executor again. The model depends on the order and sizes of the partitions, and on nothing else of the cluster.
Columns are numbers; executors need the package.
"""

from collections.abc import Iterator, Sequence
from itertools import accumulate, islice
from typing import Any

import numpy as np

from . import distributed
from ._estimator import LocalLinearTreeRegressor

__all__ = ["fit"]

_blocks_at_once = 4


def fit(
    frame: Any, target: str, *, inputs: Sequence[str] | None = None, block_rows: int = 65_536, **options: Any
) -> LocalLinearTreeRegressor:
    """Learns from a Spark DataFrame. `options`: as for :func:`llmt.distributed.start`; branches are fitted here.

    Every pass asks for the partitions again: ``frame.persist()`` keeps them where memory allows.
    """
    chosen = [name for name in frame.columns if name != target] if inputs is None else list(inputs)
    state = distributed.start(chosen, target, block_rows=block_rows, **options)
    rows = frame.select(*chosen, target).rdd
    counts = rows.mapPartitions(lambda part: [sum(1 for _ in part)]).collect()
    first = [0, *accumulate(-(-count // block_rows) for count in counts)]
    while distributed.status(state)["step"] != "finished":
        shared = rows.context.broadcast(state)

        def summed(number: int, part: Iterator[Any], shared: Any = shared) -> Iterator[bytes]:
            block = first[number]
            while piece := list(islice(part, _blocks_at_once * block_rows)):
                values = np.array(piece, dtype=float)
                yield distributed.sums(shared.value, values[:, :-1], values[:, -1], block)
                block += _blocks_at_once

        total = rows.mapPartitionsWithIndex(summed).treeReduce(lambda a, b: distributed.merge([a, b]))
        state = distributed.advance(state, total)
        shared.unpersist()
    return distributed.estimator(state)
