"""Other learners on the table of large.py, within a limit of memory; each returns its model's predictions."""

import resource
from collections.abc import Iterator
from pathlib import Path

import numpy as np
import pyarrow as pa


def limit_memory(limit: int) -> None:
    """Allocations beyond the limit fail; pages of mapped files do not count, as they can be dropped."""
    resource.setrlimit(resource.RLIMIT_DATA, (limit, limit))


def pieces(table: Path) -> Iterator[np.ndarray]:
    """The table as 32-bit numbers, batch after batch; the last column is the output."""
    with pa.memory_map(str(table)) as source, pa.ipc.open_file(source) as reader:
        for number in range(reader.num_record_batches):
            batch = reader.get_batch(number)
            yield np.column_stack([column.to_numpy().astype(np.float32) for column in batch.columns])


def in_memory(table: Path, rows: int, inputs: int) -> tuple[np.ndarray, np.ndarray]:
    x = np.empty((rows, inputs), np.float32)
    y = np.empty(rows, np.float32)
    at = 0
    for piece in pieces(table):
        x[at : at + len(piece)] = piece[:, :-1]
        y[at : at + len(piece)] = piece[:, -1]
        at += len(piece)
    return x, y


def histgradient(table: Path, rows: int, asked: np.ndarray, rounds: int, threads: int) -> np.ndarray:
    from sklearn.ensemble import HistGradientBoostingRegressor
    from threadpoolctl import threadpool_limits

    with threadpool_limits(threads):
        model = HistGradientBoostingRegressor(max_iter=rounds, early_stopping=False)
        return model.fit(*in_memory(table, rows, asked.shape[1])).predict(asked)


def lightgbm(table: Path, rows: int, asked: np.ndarray, rounds: int, threads: int) -> np.ndarray:
    from lightgbm import LGBMRegressor

    model = LGBMRegressor(n_estimators=rounds, n_jobs=threads, verbose=-1)
    return model.fit(*in_memory(table, rows, asked.shape[1])).predict(asked)


def lightgbm_sequence(table: Path, rows: int, asked: np.ndarray, rounds: int, threads: int) -> np.ndarray:
    """Its way for tables beyond memory: rows are asked for in batches, and bins of one byte are kept."""
    import lightgbm

    class Batches(lightgbm.Sequence):
        batch_size = 1 << 16

        def __init__(self, reader: pa.RecordBatchFileReader, number: int) -> None:
            self.reader = reader
            self.number = number
            self.held: np.ndarray | None = None

        def __len__(self) -> int:
            return self.reader.get_batch(self.number).num_rows

        def __getitem__(self, index: int | slice | list[int]) -> np.ndarray:
            columns = self.reader.get_batch(self.number).columns[:-1]
            return np.stack([column.to_numpy()[index] for column in columns], axis=-1)  # one row: no matrix

    with pa.memory_map(str(table)) as source, pa.ipc.open_file(source) as reader:
        y = np.concatenate(
            [reader.get_batch(k).columns[-1] for k in range(reader.num_record_batches)], dtype=np.float32
        )
        batches = [Batches(reader, number) for number in range(reader.num_record_batches)]
        options = {"objective": "regression", "num_threads": threads, "verbose": -1, "force_col_wise": True}  # one copy
        return lightgbm.train(options, lightgbm.Dataset(batches, y), rounds).predict(asked)


def xgboost(table: Path, rows: int, asked: np.ndarray, rounds: int, threads: int) -> np.ndarray:
    """Its way for tables beyond memory: pages of bins in files beside the table."""
    import xgboost as xgb

    class Batches(xgb.DataIter):
        def __init__(self) -> None:
            self.left = pieces(table)
            super().__init__(cache_prefix=str(table.parent / "xgboost"), release_data=True)

        def next(self, input_data) -> bool:
            piece = next(self.left, None)
            if piece is not None:
                input_data(data=piece[:, :-1], label=piece[:, -1])
            return piece is not None

        def reset(self) -> None:
            self.left = pieces(table)

    options = {"tree_method": "hist", "nthread": threads, "max_bin": 256}
    matrix = xgb.ExtMemQuantileDMatrix(Batches(), max_bin=256, nthread=threads)
    return xgb.train(options, matrix, rounds).predict(xgb.DMatrix(asked))


RIVALS = {
    "histgradient": histgradient,
    "lightgbm": lightgbm,
    "lightgbm-sequence": lightgbm_sequence,
    "xgboost": xgboost,
}
