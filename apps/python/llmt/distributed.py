"""Fits of more rows than one memory holds, by functions over bytes that any engine can call.

A pass over the table is one call of `sums` for each shard of the rows, merges in any order, and one `advance`. States
and sums are bytes, so that nothing lives between two calls: a shard whose worker died is summed again, and the state
after a pass is a checkpoint. :mod:`llmt.dask` does all this with Dask.

>>> import numpy as np
>>> from llmt import distributed
>>> X = np.random.default_rng(0).uniform(-1, 1, (600, 2))
>>> y = np.where(X[:, 0] > 0, 3 * X[:, 1], 1.0)
>>> state = distributed.start(["a", "b"], "y", branch_rows=400, sample_rows=400, block_rows=100)
>>> while distributed.status(state)["step"] != "finished":
...     later = distributed.sums(state, X[200:], y[200:], first_block=2)
...     earlier = distributed.sums(state, X[:200], y[:200], first_block=0)
...     state = distributed.advance(state, distributed.merge([later, earlier]))
>>> distributed.estimator(state).predict([[0.5, 0.5]]).round(1)
array([1.5])

What cannot be done beyond one memory is refused by its name: docs/algorithms/distributed.md.
"""

from collections.abc import Iterable, Mapping, Sequence
from typing import Any

import numpy as np

from . import _core
from ._estimator import LocalLinearTreeRegressor
from ._model import Model
from ._progress import Bar
from .tables import read_table, read_targets

__all__ = ["advance", "estimator", "merge", "start", "status", "sums"]


def start(
    inputs: Sequence[str],
    target: str,
    *,
    branch_rows: int = 4_000_000,
    sample_rows: int = 131_072,
    block_rows: int = 65_536,
    levels: Mapping[str, Sequence[str]] | None = None,
    weighted: bool = False,
    estimator: LocalLinearTreeRegressor | None = None,
) -> bytes:
    """The state before the first pass.

    Parameters
    ----------
    inputs : sequence of str
        Names of the inputs.
    target : str
    branch_rows : int
        Branches of the tree with at most this number of rows are brought into one memory and fitted there. A table
        that has no more rows becomes the model of `LocalLinearTreeRegressor.fit`, to the byte. No fewer than
        `sample_rows`. In larger tables no number is taken for a code, and only the tree of the sample leaves out
        inputs; its folds are random.
    sample_rows : int
        Rows of the sample that the first pass brings into one memory: a first tree is grown from it.
    block_rows : int
        Rows of a block, of which sums are made.
    levels : mapping of str to sequence of str, optional
        The categories of the inputs that hold words, at most 255 of each: all that occur in the table.
    weighted : bool
        Whether rows have weights.
    estimator : LocalLinearTreeRegressor, optional
        Its parameters are those of the fit, but for `n_jobs`: `sums` and `advance` have threads of their own.

    Raises
    ------
    ValueError
        For parameters that are not possible beyond one memory, by their names.
    """
    given = LocalLinearTreeRegressor() if estimator is None else estimator
    if len(given.categorical_features):
        raise ValueError("categorical_features is not possible beyond one memory; name their categories by levels")
    given._refuse_others("is not possible beyond one memory; fit a sample that fits into memory")
    names = [inputs] if isinstance(inputs, str) else [str(name) for name in inputs]
    by_name = {str(name): [str(level) for level in of_input] for name, of_input in (levels or {}).items()}
    for name in by_name:
        if name not in names:
            raise ValueError(f'levels has "{name}", which is no input; the inputs are {", ".join(names)}')
    of_inputs = [by_name.get(name, []) for name in names]
    memory = (branch_rows, sample_rows, block_rows)
    codes = bool(given.integer_codes)
    return _core.distributed_start(names, str(target), *memory, weighted, of_inputs, codes, given._options())


def sums(
    state: bytes, X: Any, y: Any, first_block: int = 0, *, sample_weight: Any = None, max_threads: int = 1
) -> bytes:
    """What `state` asks of some rows.

    Parameters
    ----------
    X : table, (rows, inputs)
        Columns in the order of `start`: words where `start` was given levels, else numbers.
    y : array, (rows,)
    first_block : int
        The rows make the blocks ``first_block``, ``first_block + 1``, ... of ``block_rows`` rows each; the last one may
        have fewer. All blocks 0, 1, 2, ... of the table take part in every pass, each once; which of them are summed
        together, and where, changes no byte. A shard without rows has no block.
    sample_weight : array, (rows,), optional
        As for `LocalLinearTreeRegressor.fit`, if `start` was told of weights. A row of weight 0 takes no part.
    max_threads : int
        0: all that the process may use.

    Raises
    ------
    ValueError
        Naming row and column of what cannot be learned from.
    """
    weights = None if sample_weight is None else np.asarray(sample_weight, dtype=float)
    if len(X) == 0:
        return _core.distributed_sums(state, np.empty(np.shape(X)), np.empty(0), first_block, max_threads, weights)
    levels = _core.distributed_levels(state)
    table = read_table(X, levels=levels) if any(levels) else read_table(X)
    for position, unknown in enumerate(table.unknown):
        name = position if table.names is None else table.names[position]
        if table.levels[position] and not levels[position]:
            raise ValueError(f'column "{name}" has words, and start was not given their levels')
        if unknown:
            raise ValueError(f'column "{name}" has {unknown} cells with a word that is none of the levels of start')
    output, _ = read_targets(y)
    if output.ndim != 1:
        raise ValueError("y has several columns; beyond one memory there is one target")
    return _core.distributed_sums(state, table.values, output, first_block, max_threads, weights)


def merge(parts: Iterable[bytes]) -> bytes:
    """The sums over the blocks of all parts, the same bytes in whatever order and groups they are merged."""
    return _core.distributed_merge(list(parts))


def advance(state: bytes, sums: bytes, *, max_threads: int = 0) -> bytes:
    """The state after a pass. `sums`: over all blocks.

    Raises
    ------
    ValueError
        Naming the blocks that are missing; for sums that another state asked for, and if the table has changed.
    """
    with Bar() as bar:
        return _core.distributed_advance(state, sums, max_threads, bar)


def status(state: bytes) -> dict[str, Any]:
    """How far a fit is.

    Returns
    -------
    dict
        ``step``: what the next pass does, "describe", "grow", "gather" or "blend", or "finished"; ``passes`` so far;
        ``rows`` of the table, 0 before the first pass; ``top_leaves`` of the top of the tree; ``branches`` among them
        that are fitted in memory, and ``branches_done``; ``rows_to_come``, which the next pass brings together;
        ``is_of_sample``, whether the model is the tree of the sample in place of top and branches; and
        ``held_out_rmse`` of the finished model.
    """
    result: dict[str, Any] = _core.distributed_status(state)
    return result


def estimator(state: bytes) -> LocalLinearTreeRegressor:
    """The fitted estimator of a finished state, as `LocalLinearTreeRegressor.load` gives it."""
    regressor = LocalLinearTreeRegressor()
    regressor._take_model(Model(_core.distributed_model(state)))
    return regressor
