"""Parts of a table, as frames or files of Parquet: how many rows they have, their words, and their sums.

`source` is a frame or the path of a file, which is read piece by piece; `name` stands for it in messages.
"""

from collections.abc import Iterator
from typing import Any

import numpy as np

from . import _core, distributed
from .tables import read_table

_blocks_at_once = 4


def open_parquet(path: str) -> Any:
    from pyarrow import ArrowException
    from pyarrow.parquet import ParquetFile

    try:
        return ParquetFile(path)
    except (ArrowException, OSError) as error:
        raise type(error)(f"{path}: {error}") from None


def columns_of(path: str) -> list[str]:
    """The columns of a file without those that pandas wrote for its index."""
    schema = open_parquet(path).schema_arrow
    index = (schema.pandas_metadata or {}).get("index_columns", [])
    return [name for name in schema.names if name not in index]


def count_rows(source: Any, name: str) -> int:
    return open_parquet(source).metadata.num_rows if isinstance(source, str) else len(source)


def words_of(source: Any, name: str, columns: list[str]) -> dict[str, list[str]]:
    """The different words of each column of a partition that has some."""
    words: dict[str, set[str]] = {}
    if isinstance(source, str):  # what holds no words is not read
        columns = [column for column in columns if _may_have_words(source, column)]
    for frame in _frames(source, name, columns) if columns else ():
        for column in columns:
            if column in frame and len(frame) and not (_is_numeric(frame[column]) or is_of_dates(frame[column].dtype)):
                try:
                    words.setdefault(column, set()).update(read_table(frame[[column]]).levels[0])
                except (TypeError, ValueError) as error:
                    raise type(error)(f"{name}: {error}") from None
    return {column: sorted(levels) for column, levels in words.items()}


def dates_of(path: str) -> list[str]:
    """The columns of dates and moments of a file."""
    from pyarrow import types

    schema = open_parquet(path).schema_arrow
    return [field.name for field in schema if types.is_date(field.type) or types.is_timestamp(field.type)]


def is_of_dates(dtype: Any) -> bool:
    """Whether a type of a column of pandas is one of dates or moments."""
    return getattr(dtype, "kind", "O") == "M" or str(getattr(dtype, "pyarrow_dtype", "")).startswith("date")


def _may_have_words(file: str, column: str) -> bool:
    from pyarrow import types

    schema = open_parquet(file).schema_arrow
    if column not in schema.names:
        return True
    kind = schema.field(column).type
    return bool(types.is_string(kind) or types.is_large_string(kind) or types.is_dictionary(kind))


def _is_numeric(column: Any) -> bool:
    return getattr(column.dtype, "kind", "O") in "biuf"


def sum_rows(
    source: Any,
    name: str,
    state: bytes,
    columns: list[str],
    weighted: bool,
    block_rows: int,
    first_block: int,
    rows: int,
) -> bytes:
    """The sums of a partition, which has `rows` rows. `columns`: inputs, target, and the weight."""
    sums = []
    begin = 0
    levels = _core.distributed_levels(state)
    inputs = len(levels)
    for piece in _pieces(source, name, columns, levels, _blocks_at_once * block_rows):
        block = first_block + begin // block_rows
        weights = piece[:, inputs + 1] if weighted else None
        try:
            sums.append(_core.distributed_sums(state, piece[:, :inputs], piece[:, inputs], block, 1, weights))
        except ValueError as error:
            raise ValueError(f"{name}, rows from {begin}: {error}") from None
        begin += len(piece)
    if begin != rows:
        raise ValueError(f"{name}: has {begin} rows, and had {rows}: the table changed")
    return distributed.merge(sums)


def _frames(source: Any, name: str, columns: list[str]) -> Iterator[Any]:
    """A partition as frames, which are small where it is a file."""
    if not isinstance(source, str):
        yield source
        return
    file = open_parquet(source)
    for column in columns:
        if column not in file.schema_arrow.names:
            raise ValueError(f'{name}: column "{column}" is missing')
    for batch in file.iter_batches(columns=columns):
        yield batch.to_pandas()


def _pieces(
    source: Any, name: str, columns: list[str], levels: list[list[str]], rows: int
) -> Iterator[np.ndarray]:
    """The columns as numbers, `rows` rows at a time."""
    held: list[np.ndarray] = []
    for frame in _frames(source, name, columns):
        held.append(_numbers(frame, name, columns, levels))
        while sum(map(len, held)) >= rows:
            values = np.concatenate(held) if len(held) > 1 else held[0]
            yield values[:rows]
            held = [values[rows:]]
    if held and sum(map(len, held)):
        yield np.concatenate(held)


def _numbers(frame: Any, name: str, columns: list[str], levels: list[list[str]]) -> np.ndarray:
    """A category is its place among the levels of its column; the last columns, target and weight, have none."""
    values = np.empty((len(frame), len(columns)), order="F")
    for position, column in enumerate(columns):
        if len(frame) and position < len(levels) and levels[position]:
            if column not in frame:
                raise ValueError(f'{name}: column "{column}" is missing')
            values[:, position] = _places(frame[column], name, column, levels[position])
            continue
        if column in frame and is_of_dates(frame[column].dtype):
            raise ValueError(f'{name}: column "{column}" holds dates: convert it to numbers, such as days, or leave it out')
        try:
            values[:, position] = frame[column].to_numpy(dtype=float, na_value=np.nan)
        except (KeyError, TypeError, ValueError):
            what = "has words or other cells that are no numbers" if column in frame else "is missing"
            raise ValueError(f'{name}: column "{column}" {what}') from None
    return values


def _places(cells: Any, name: str, column: str, levels: list[str]) -> np.ndarray:
    if _is_numeric(cells) and cells.notna().any():
        raise ValueError(f'{name}: column "{column}" has numbers, and words in other partitions')
    return read_table(cells.to_frame(), levels=[levels]).values[:, 0]
