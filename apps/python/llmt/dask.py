"""Fits and predictions of Dask DataFrames and of folders of Parquet files, on as many machines as Dask has.

>>> from llmt import dask as llmt_dask
>>> model = llmt_dask.fit("measurements/", "y")             # doctest: +SKIP
>>> predicted = llmt_dask.predict(model, "measurements/")   # doctest: +SKIP

A pass over the table is one graph of Dask: a task for each partition, which reads and sums its rows, and a tree of
tasks that merge the sums. Nothing lives between tasks. A partition whose worker died is therefore computed again by
Dask itself, and the model has the same bytes with any number of workers, whatever died on the way. It depends on the
order and sizes of the partitions. Branches of the tree are fitted in the process that calls.
"""

import os
import warnings
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from . import _core, distributed
from ._estimator import LocalLinearTreeRegressor
from ._files import write_bytes
from ._shards import columns_of, count_rows, dates_of, is_of_dates, sum_rows, words_of

__all__ = ["fit", "predict"]

_merged_at_once = 8


def fit(
    table: Any,
    target: str,
    *,
    inputs: Sequence[str] | None = None,
    weight: str | None = None,
    estimator: LocalLinearTreeRegressor | None = None,
    branch_rows: int = 4_000_000,
    sample_rows: int = 131_072,
    block_rows: int = 65_536,
    client: Any = None,
    timeout: float = 3600.0,
    checkpoint: "str | os.PathLike[str] | None" = None,
    resume: bool = False,
) -> LocalLinearTreeRegressor:
    """Learns from a table that need not fit into one memory.

    Parameters
    ----------
    table : dask.dataframe.DataFrame, or path of a folder
        Target and weight hold numbers, inputs numbers or words, of which at most 255 may differ. A folder stands for
        its files ``*.parquet`` in the order of their names; each is read piece by piece, and may be larger than a
        worker's memory. A partition of a frame must fit.
    target : str
        The column to predict.
    inputs : sequence of str, optional
        Columns to predict from; by default all others.
    weight : str, optional
        The column of the rows' weights, as ``sample_weight`` of `LocalLinearTreeRegressor.fit`.
    estimator, branch_rows, sample_rows, block_rows
        As for :func:`llmt.distributed.start`. Partitions of a multiple of ``block_rows`` rows are summed fastest.
    client : distributed.Client, optional
        By default the current one. Where there is none, the scheduler of `dask.config` computes in this process.
    timeout : float
        Seconds after which a pass that a client computes is given up.
    checkpoint : path, optional
        A file to which the state is written after every pass.
    resume : bool
        Go on from the file of `checkpoint` if there is one. The model has the same bytes as without a break.

    Returns
    -------
    LocalLinearTreeRegressor
        Fitted, as `LocalLinearTreeRegressor.load` gives it.

    Raises
    ------
    ValueError, FileNotFoundError, TimeoutError
        Naming the partition or file, its row and column, or the pass. No model is left half done.
    """
    parts, columns, dates = _partitions(table)
    if inputs is None:
        chosen = [name for name in columns if name not in (target, weight) and name not in dates]
        for name in dates:
            if name not in (target, weight):
                warnings.warn(f'column "{name}" has dates, and is left out; give a number, as days', stacklevel=2)
    else:
        chosen = list(inputs)
    named = [*chosen, target] if weight is None else [*chosen, target, weight]
    for name in named:
        if name not in columns:
            raise ValueError(f'there is no column "{name}"; the columns are {", ".join(columns)}')
    run = _Engine(client, timeout)
    found = run(_gathered([_task(words_of, part, chosen) for part in parts]), "looking for words")
    words = {name: sorted({word for of_part in found for word in of_part.get(name, [])}) for name in chosen}
    state = distributed.start(
        chosen,
        target,
        branch_rows=branch_rows,
        sample_rows=sample_rows,
        block_rows=block_rows,
        levels={name: levels for name, levels in words.items() if levels},
        weighted=weight is not None,
        estimator=estimator,
    )
    if resume:
        if checkpoint is None:
            raise ValueError("resume goes on from the file of checkpoint, which is not given")
        state = _saved(checkpoint, state)
    rows: list[int] = run(_gathered([_task(count_rows, part) for part in parts]), "counting rows")
    blocks = [-(-count // block_rows) for count in rows]
    first = [sum(blocks[:position]) for position in range(len(blocks))]
    if not any(rows):
        raise ValueError("the table has no rows")
    while (now := distributed.status(state))["step"] != "finished":
        shared = _constant(state)
        sums = [
            _task(sum_rows, part, shared, named, weight is not None, block_rows, begin, count)
            for part, begin, count in zip(parts, first, rows, strict=True)
            if count
        ]
        total = run(_merged(sums), f"pass {now['passes'] + 1} ({now['step']})")
        state = distributed.advance(state, total)
        if checkpoint is not None:
            write_bytes(checkpoint, state)
    return distributed.estimator(state)


def predict(model: LocalLinearTreeRegressor, table: Any) -> Any:
    """Predictions of a fitted estimator, as a Dask Series of the table's partitions that is computed when asked for.

    `table` is a Dask DataFrame or the path of a folder with Parquet files, and has the columns of the fit.
    """
    if isinstance(table, (str, os.PathLike)):
        from dask.dataframe import read_parquet

        _parquet_files(table)
        table = read_parquet(os.fspath(table))
    name = f"{model._outputs[0]}_pred"
    return table.map_partitions(_predict_rows, model, name, meta=(name, "f8"))


@dataclass(frozen=True)
class _Partition:
    """Rows of a table, and their name in messages. `source`: a frame, or the path of a file."""

    source: Any
    name: str


def _partitions(table: Any) -> tuple[list[_Partition], list[str], list[str]]:
    """The partitions of a table, its columns, and those that hold dates."""
    if isinstance(table, (str, os.PathLike)):
        files = _parquet_files(table)
        return [_Partition(file, file) for file in files], columns_of(files[0]), dates_of(files[0])
    if not hasattr(table, "to_delayed"):
        raise TypeError(f"a table is a Dask DataFrame or the path of a folder, not {type(table).__name__}")
    frames = enumerate(table.to_delayed())
    dates = [str(name) for name, dtype in table.dtypes.items() if is_of_dates(dtype)]
    parts = [_Partition(frame, f"partition {number}") for number, frame in frames]
    return parts, [str(name) for name in table.columns], dates


def _parquet_files(folder: "str | os.PathLike[str]") -> list[str]:
    path = Path(folder)
    if not path.is_dir():
        raise FileNotFoundError(f"{path}: there is no such folder")
    files = sorted(str(file) for file in path.glob("*.parquet"))
    if not files:
        raise FileNotFoundError(f"{path}: the folder has no file *.parquet")
    return files


def _saved(checkpoint: "str | os.PathLike[str]", first: bytes) -> bytes:
    """The state of a file; `first` where there is none."""
    path = Path(checkpoint)
    if not path.exists():
        return first
    state = path.read_bytes()
    try:
        continues = _core.distributed_continues(state, first)
    except ValueError as error:
        raise ValueError(f"{path}: {error}") from None
    if not continues:
        raise ValueError(f"{path}: is of a fit of other columns or with other parameters")
    return state


# Graphs of Dask.


def _predict_rows(frame: Any, model: LocalLinearTreeRegressor, name: str) -> Any:
    from pandas import Series

    values = model.predict(frame[model._inputs]) if len(frame) else np.empty(0)
    return Series(values, index=frame.index, name=name, dtype="f8")


def _constant(value: Any) -> Any:
    from dask import delayed

    return delayed(value, pure=True)


def _task(function: Callable[..., Any], part: _Partition, *rest: Any) -> Any:
    from dask import delayed

    return delayed(function, pure=False)(part.source, part.name, *rest)


def _gathered(tasks: list[Any]) -> Any:
    from dask import delayed

    return delayed(list, pure=False)(tasks)


def _merged(sums: list[Any]) -> Any:
    """A tree of merges."""
    from dask import delayed

    merge = delayed(distributed.merge, pure=False)
    while len(sums) > 1:
        sums = [merge(sums[begin : begin + _merged_at_once]) for begin in range(0, len(sums), _merged_at_once)]
    return sums[0]


class _Engine:
    """Computes graphs, by a client or in this process."""

    def __init__(self, client: Any, timeout: float) -> None:
        if not timeout > 0.0:
            raise ValueError(f"timeout is {timeout!r}; it must be a number of seconds above 0")
        self._client = client if client is not None else _current_client()
        self._timeout = timeout

    def __call__(self, graph: Any, what: str) -> Any:
        if self._client is None:
            return graph.compute()
        future = self._client.compute(graph)
        try:
            return future.result(timeout=self._timeout)
        except TimeoutError:
            raise TimeoutError(f"{what} took longer than {self._timeout:g} s, and was given up") from None
        finally:
            future.cancel()


def _current_client() -> Any:
    import sys

    if "distributed" not in sys.modules:
        return None
    from distributed import default_client

    try:
        return default_client()
    except ValueError:
        return None
