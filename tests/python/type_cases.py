"""Columns of every type of NumPy, pandas, polars and pyarrow: what is given, and what is to be read."""

from __future__ import annotations

import datetime
import importlib
from collections.abc import Callable
from decimal import Decimal
from types import ModuleType
from typing import Any

import numpy as np

from llmt.tables import read_table


def _imported(name: str) -> ModuleType | None:
    try:
        return importlib.import_module(name)
    except ImportError:
        return None


pd: Any = _imported("pandas")
pl: Any = _imported("polars")
pa: Any = _imported("pyarrow")

# Of each case what makes a table with the one column c, and its values; for a type that cannot be read, words of the
# TypeError.
Case = tuple[Callable[[], Any], "list[Any] | str"]
TYPES: dict[str, Case] = {}

DAY = datetime.date(2024, 2, 29)
NOON = datetime.datetime(2024, 2, 29, 12)
HOUR = datetime.timedelta(hours=1)
NUMBERS = [3.0, None, 1.0]
WORDS = ["b", None, "a"]


def _numpy() -> None:
    for name in ("bool", "int8", "int16", "int32", "int64", "uint8", "uint16", "uint32", "uint64"):
        TYPES[f"numpy {name}"] = (lambda t=name: np.array([[1], [0], [1]], dtype=t), [1.0, 0.0, 1.0])
    for name in ("float16", "float32", "float64", "longdouble", ">f8", ">i4", "<f4"):
        TYPES[f"numpy {name}"] = (lambda t=name: np.array([[1.0], [0.0], [-2.0]], dtype=t), [1.0, 0.0, -2.0])
    for name, cells, expected in (
        ("numbers", [1, 2.5, None, Decimal("0.1"), True, np.int8(4)], [1.0, 2.5, None, 0.1, 1.0, 4.0]),
        ("words", ["b", None, float("nan"), " a ", "", "n/a", "?"], ["b", None, None, "a", None, "n/a", "?"]),
        ("a mix", [1, "a"], "mixes words and numbers"),
        ("dates", [DAY, None], "holds dates"),
        ("datetimes", [NOON, None], "holds dates"),
        ("timedeltas", [HOUR], "holds durations"),
        ("bytes", [b"a"], "holds bytes"),
        ("dicts", [{"a": 1}], "argument must be a string or a number, not 'dict'"),
        ("lists", [[1, 2], None], "argument must be a string or a number, not 'list'"),
    ):
        TYPES[f"numpy object: {name}"] = (lambda c=cells: _objects(c), expected)
    TYPES["numpy str"] = (lambda: np.array([["b"], [""], ["ä"]]), ["b", None, "ä"])
    TYPES["numpy StringDType"] = (lambda: np.array([["b"], ["a"]], dtype=np.dtypes.StringDType()), ["b", "a"])
    TYPES["numpy bytes"] = (lambda: np.array([[b"b"]]), "holds bytes")
    TYPES["numpy datetime64"] = (lambda: np.array([["2024-01-01"]], dtype="datetime64[D]"), "holds dates")
    TYPES["numpy timedelta64"] = (lambda: np.array([[1]], dtype="timedelta64[s]"), "holds durations")
    TYPES["numpy void"] = (lambda: np.zeros((2, 1), dtype="V8"), "holds values")
    TYPES["numpy records"] = (lambda: np.zeros(2, dtype=[("a", "f8")]), "array of records (a)")
    TYPES["numpy masked"] = (lambda: np.ma.array([[1.0], [2.0]], mask=[[False], [True]]), [1.0, None])


def _objects(cells: list[Any]) -> np.ndarray:
    column = np.empty((len(cells), 1), dtype=object)
    for row, cell in enumerate(cells):
        column[row, 0] = cell
    return column


def _pandas() -> None:
    def add(name: str, make: Callable[[], Any], expected: list[Any] | str) -> None:
        TYPES[f"pandas {name}"] = (lambda: pd.DataFrame({"c": make()}), expected)

    for name in ("bool", "int8", "int16", "int32", "int64", "uint8", "uint16", "uint32", "uint64", "float32"):
        add(name, lambda t=name: np.array([1, 0], dtype=t), [1.0, 0.0])
    add("float64", lambda: [1.5, np.nan], [1.5, None])
    for name in ("Int8", "Int16", "Int32", "Int64", "UInt8", "UInt16", "UInt32", "UInt64", "Float32", "Float64"):
        add(name, lambda t=name: pd.array([3, None, 1], dtype=t), NUMBERS)
    add("boolean", lambda: pd.array([True, None, False], dtype="boolean"), [1.0, None, 0.0])
    add("words as read_csv gives them", lambda: pd.Series(WORDS), WORDS)
    for name in ("string", "object", "category", "string[python]", "string[pyarrow]"):
        add(name, lambda t=name: pd.Series(WORDS, dtype=t), WORDS)
    add("category, unused levels", lambda: pd.Categorical(WORDS, categories=["z", "b", "a"]), WORDS)
    add("category of integers", lambda: pd.Categorical([10, None, 9], categories=[7, 9, 10]), ["10", None, "9"])
    add("category of floats", lambda: pd.Categorical([2.5, 3.0, 2.5]), ["2.5", "3", "2.5"])
    add("category of dates", lambda: pd.Categorical([NOON]), "holds dates")
    add("category of intervals", lambda: pd.cut([1, 2], 2), "holds intervals")
    add("datetime64", lambda: [NOON], "holds dates")
    add("datetime64 with zone", lambda: pd.Series([NOON]).dt.tz_localize("UTC"), "holds dates")
    add("timedelta64", lambda: [HOUR], "holds durations")
    add("period", lambda: pd.period_range("2024", periods=2, freq="D"), "holds periods")
    add("interval", lambda: pd.arrays.IntervalArray.from_breaks([1, 2, 3]), "holds intervals")
    add("complex", lambda: [1j], "holds complex numbers")
    add("sparse", lambda: pd.arrays.SparseArray([0.0, 1.0]), "holds sparse numbers")
    add("object with NA", lambda: pd.Series([1, pd.NA, 2.5], dtype=object), [1.0, None, 2.5])
    add("object with NaT", lambda: pd.Series(["a", pd.NaT], dtype=object), ["a", None])
    if pa is not None:
        for name, (arrow, expected) in _arrow_types().items():
            if not name.startswith("extension"):
                add(f"Arrow {name}", lambda a=arrow: pd.Series(pd.arrays.ArrowExtensionArray(a())), expected)


def _polars() -> None:
    def add(name: str, make: Callable[[], Any], expected: list[Any] | str) -> None:
        TYPES[f"polars {name}"] = (lambda: make().alias("c").to_frame(), expected)

    for name in "Int8 Int16 Int32 Int64 UInt8 UInt16 UInt32 UInt64 Float16 Float32 Float64".split():
        if hasattr(pl, name):
            add(name, lambda t=name: pl.Series([3, None, 1]).cast(getattr(pl, t)), NUMBERS)
    for name in ("Int128", "UInt128"):
        if hasattr(pl, name):
            add(name, lambda t=name: pl.Series([3, None, 1]).cast(getattr(pl, t)), "integers of 128 bits")
    add("Boolean", lambda: pl.Series([True, None, False]), [1.0, None, 0.0])
    add("Decimal", lambda: pl.Series([Decimal("0.1"), None, Decimal("-12.34")]), [0.1, None, -12.34])
    add("Null", lambda: pl.Series([None, None]), [None, None])
    add("String", lambda: pl.Series(WORDS), WORDS)
    add("String, long", lambda: pl.Series(["b" * 40, None, "a" * 40]), ["b" * 40, None, "a" * 40])
    add("Categorical", lambda: pl.Series(WORDS).cast(pl.Categorical), WORDS)
    add("Enum", lambda: pl.Series(WORDS).cast(pl.Enum(["z", "b", "a"])), WORDS)
    for name, make, words in (
        ("Date", lambda: pl.Series([DAY]), "dates"),
        ("Datetime", lambda: pl.Series([NOON]), "holds dates"),
        ("Duration", lambda: pl.Series([HOUR]), "durations"),
        ("Time", lambda: pl.Series([datetime.time(12)]), "times of day"),
        ("Binary", lambda: pl.Series([b"a"]), "bytes"),
        ("List", lambda: pl.Series([[1], [2]]), "lists"),
        ("Array", lambda: pl.Series([[1], [2]], dtype=pl.Array(pl.Int64, 1)), "lists"),
        ("Struct", lambda: pl.Series([{"a": 1}]), "structs"),
        ("Map", lambda: pl.Series([[{"key": "a", "value": 1}]]).cast(pl.Map(pl.String, pl.Int64)), "maps"),
        ("Extension", lambda: pl.Series([1]).ext.to(pl.Extension("my.type", pl.Int64())), "extension type my.type"),
        ("Object", lambda: pl.Series([object()], dtype=pl.Object), "holds bytes"),
    ):
        if hasattr(pl, name):
            add(name, make, words)


def _arrow_types() -> dict[str, tuple[Callable[[], Any], list[Any] | str]]:
    result: dict[str, tuple[Callable[[], Any], list[Any] | str]] = {}

    def add(name: str, make: Callable[[], Any], expected: list[Any] | str) -> None:
        result[name] = (make, expected)

    for name in "int8 int16 int32 int64 uint8 uint16 uint32 uint64 float16 float32 float64".split():
        add(
            name,
            lambda t=name: pa.array(
                [np.float16(3), None, np.float16(1)] if t == "float16" else [3, None, 1], getattr(pa, t)()
            ),
            NUMBERS,
        )
    add("bool", lambda: pa.array([True, None, False]), [1.0, None, 0.0])
    add("null", lambda: pa.nulls(2), [None, None])
    for bits in (32, 64, 128, 256):
        if hasattr(pa, f"decimal{bits}"):
            cells = [Decimal("0.1"), None, Decimal("-123456.7")]
            add(
                f"decimal{bits}",
                lambda b=bits, c=cells: pa.array(c, getattr(pa, f"decimal{b}")(9, 1)),
                [0.1, None, -123456.7],
            )
    large = [Decimal("-1234567890123456789012345678.901234567"), Decimal("9007199254740993")]
    for bits in (128, 256):
        add(
            f"decimal{bits}, all digits",
            lambda b=bits: pa.array(large, getattr(pa, f"decimal{b}")(38, 9)),
            [float(x) for x in large],
        )
    add("decimal256, most digits", lambda: pa.array([Decimal(-(10**76 - 1))], pa.decimal256(76, 0)), [-1e76])
    add("decimal128, negative scale", lambda: pa.array([Decimal("12e5")], pa.decimal128(5, -5)), [12e5])
    for name in ("string", "large_string", "string_view"):
        add(name, lambda t=name: pa.array(WORDS, getattr(pa, t)()), WORDS)
        add(f"{name}, long", lambda t=name: pa.array(["ä" * 99, "b", None], getattr(pa, t)()), ["ä" * 99, "b", None])
        add(
            f"dictionary of {name}",
            lambda t=name: pa.DictionaryArray.from_arrays(
                pa.array([1, None, 0], pa.int8()), pa.array(["a", "b"], getattr(pa, t)())
            ),
            WORDS,
        )
    for name in "int8 int16 int32 int64 uint8 uint16 uint32 uint64".split():
        add(
            f"dictionary, indices {name}",
            lambda t=name: pa.DictionaryArray.from_arrays(
                pa.array([1, None, 0], getattr(pa, t)()), pa.array(["a", "b", "z"])
            ),
            WORDS,
        )
    add("dictionary of integers", lambda: pa.array([10, None, 9]).dictionary_encode(), ["10", None, "9"])
    add(
        "dictionary with a null",
        lambda: pa.DictionaryArray.from_arrays(pa.array([0, 1]), pa.array(["a", None])),
        ["a", None],
    )
    add("dictionary of dates", lambda: pa.array([DAY]).dictionary_encode(), "holds dates")
    for name, make, words in (
        ("date32", lambda: pa.array([DAY]), "dates"),
        ("date64", lambda: pa.array([DAY], pa.date64()), "dates"),
        ("time32", lambda: pa.array([1], pa.time32("s")), "times of day"),
        ("time64", lambda: pa.array([1], pa.time64("us")), "times of day"),
        ("timestamp", lambda: pa.array([NOON]), "holds dates"),
        ("timestamp with zone", lambda: pa.array([NOON], pa.timestamp("s", "UTC")), "holds dates"),
        ("duration", lambda: pa.array([HOUR]), "durations"),
        ("month_day_nano_interval", lambda: pa.array([(1, 2, 3)], pa.month_day_nano_interval()), "calendar intervals"),
        ("binary", lambda: pa.array([b"a"]), "bytes"),
        ("large_binary", lambda: pa.array([b"a"], pa.large_binary()), "bytes"),
        ("binary_view", lambda: pa.array([b"a"], pa.binary_view()), "bytes"),
        ("fixed_size_binary", lambda: pa.array([b"a"], pa.binary(1)), "bytes"),
        ("list", lambda: pa.array([[1]]), "lists"),
        ("large_list", lambda: pa.array([[1]], pa.large_list(pa.int8())), "lists"),
        ("list_view", lambda: pa.array([[1]], pa.list_view(pa.int8())), "lists"),
        ("large_list_view", lambda: pa.array([[1]], pa.large_list_view(pa.int8())), "lists"),
        ("fixed_size_list", lambda: pa.array([[1]], pa.list_(pa.int8(), 1)), "lists"),
        ("struct", lambda: pa.array([{"a": 1}]), "structs"),
        ("map", lambda: pa.array([[("a", 1)]], pa.map_(pa.string(), pa.int8())), "maps"),
        (
            "dense union",
            lambda: pa.UnionArray.from_dense(pa.array([0], pa.int8()), pa.array([0], pa.int32()), [pa.array([1])]),
            "unions",
        ),
        ("sparse union", lambda: pa.UnionArray.from_sparse(pa.array([0], pa.int8()), [pa.array([1])]), "unions"),
        ("run_end_encoded", lambda: pa.RunEndEncodedArray.from_arrays([2], [1]), "run-end encoded"),
        ("extension uuid", lambda: pa.array([b"0" * 16], pa.uuid()), "extension type arrow.uuid"),
        (
            "extension bool8",
            lambda: pa.ExtensionArray.from_storage(pa.bool8(), pa.array([1], pa.int8())),
            "extension type arrow.bool8",
        ),
    ):
        add(name, make, words)
    return result


def _pyarrow() -> None:
    def add(name: str, make: Callable[[], Any], expected: list[Any] | str) -> None:
        TYPES[f"pyarrow {name}"] = (make, expected)

    for name, (make, expected) in _arrow_types().items():
        add(name, lambda m=make: pa.table({"c": m()}), expected)
    for name in ("int64", "bool", "string", "large_string", "string_view", "dictionary of string", "decimal128"):
        make, expected = _arrow_types()[name]
        assert isinstance(expected, list)
        sliced = lambda m=make: pa.concat_arrays([m().slice(0, 1)] * 9 + [m(), m()]).slice(9, 4)  # noqa: E731
        add(f"{name}, sliced", lambda s=sliced: pa.table({"c": s()}), [*expected, expected[0]])
        add(f"{name}, record batch", lambda m=make: pa.record_batch({"c": m()}).slice(1), expected[1:])
        add(
            f"{name}, chunks",
            lambda m=make: pa.table({"c": pa.chunked_array([m(), m().slice(0, 0), m().slice(1)])}),
            expected + expected[1:],
        )
    other = lambda *words: pa.array(words).dictionary_encode()  # noqa: E731
    add(
        "dictionaries that differ",
        lambda: pa.table({"c": pa.chunked_array([other("b", "a"), other("c", "b")])}),
        ["b", "a", "c", "b"],
    )


_numpy()
if pd is not None:
    _pandas()
if pl is not None:
    _polars()
if pa is not None:
    _pyarrow()


def read_values(table: Any) -> list[Any]:
    """The cells of the only column, as they are read."""
    read = read_table(table)
    levels = read.levels[0]
    assert levels == sorted(set(levels), key=str.encode)
    assert read.values.shape == (len(read.values), 1) and read.unknown == [0]
    cells = [None if np.isnan(value) else float(value) for value in read.values[:, 0]]
    return [None if cell is None else levels[int(cell)] for cell in cells] if levels else cells


CASES = {name: (lambda make=make: read_values(make())) for name, (make, _) in TYPES.items()}
