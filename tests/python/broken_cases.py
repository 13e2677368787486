"""Arrow data that break the specification, and some at its edge that do not."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np
from arrow_producer import Producer, bits, i32, i64, outcome

from llmt._core import read_arrow

# Of each case what makes the capsules, and what comes of it: (kind, cells, words) or the exception and words of it.
BROKEN: dict[str, tuple[Callable[[Producer], Any], tuple[Any, ...]]] = {}


def add(name: str, expected: tuple[Any, ...]) -> Callable[[Any], Any]:
    def register(make: Callable[[Producer], Any]) -> Callable[[Producer], Any]:
        BROKEN[name] = (make, expected)
        return make

    return register


def one(
    name: str, expected: tuple[Any, ...], format: bytes | None, make: Callable[[Producer], Any], /, **schema: Any
) -> None:
    """A table of one column in one chunk."""
    BROKEN[name] = (lambda p: p.table(p.schema(format, **schema), make(p)), expected)


COLUMN = 'column "c"'
one(
    "numbers, bitmap with an offset",
    ("numbers", [2.0, None, 4.0], None),
    b"i",
    lambda p: p.array(3, [bits(0, 1, 0, 1, 0), i32(1, 2, 3, 4, 5)], offset=1, null_count=1),
)
one(
    "numbers, no bitmap, nulls not counted",
    ("numbers", [1.0], None),
    b"i",
    lambda p: p.array(1, [None, i32(1)], null_count=-1),
)
one(
    "numbers, not aligned",
    ("numbers", [1.0], None),
    b"i",
    lambda p: p.array(1, [None, np.frombuffer(b"\0" + i32(1).tobytes(), dtype=np.uint8)[1:]]),
)
one(
    "booleans, bits with an offset",
    ("numbers", [1.0, 0.0, None], None),
    b"b",
    lambda p: p.array(3, [bits(1, 1, 1, 1, 0), bits(0, 0, 1, 0, 1)], offset=2),
)
one(
    "halves",
    ("numbers", [1.0, -2.0, 2.0**-24, 65504.0, None], None),
    b"e",
    lambda p: p.array(5, [None, np.array([1, -2, 2.0**-24, 65504, np.nan], dtype=np.float16)]),
)
one(
    "texts, offset",
    ("words", ["b", "", "b"], ["b", ""]),
    b"u",
    lambda p: p.array(3, [None, i32(0, 1, 2, 2, 3), b"abb"], offset=1),
)
one("texts, none has characters", ("words", ["", ""], [""]), b"U", lambda p: p.array(2, [None, i64(0, 0, 0), None]))
one(
    "texts that end before they begin",
    ("ValueError", COLUMN, "begins at 2 and ends at 1"),
    b"u",
    lambda p: p.array(2, [None, i32(0, 2, 1), b"ab"]),
)
one(
    "texts that begin below 0",
    ("ValueError", COLUMN, "begins at -5"),
    b"U",
    lambda p: p.array(1, [None, i64(-5, 1), b"ab"]),
)
one(
    "texts without a buffer",
    ("ValueError", COLUMN, "no buffer of characters"),
    b"u",
    lambda p: p.array(1, [None, i32(0, 1), None]),
)
one("texts without offsets", ("ValueError", COLUMN, "no values"), b"u", lambda p: p.array(1, [None, None, b"a"]))
one(
    "a text that is not UTF-8",
    ("ValueError", COLUMN, "not UTF-8"),
    b"u",
    lambda p: p.array(1, [None, i32(0, 2), b"\xff\xfe"]),
)
one(
    "broken texts that are missing",
    ("words", [None], []),
    b"u",
    lambda p: p.array(1, [bits(0), i32(7, 1), None], null_count=1),
)


def view(length: int, buffer: int, offset: int) -> bytes:
    return i32(length, 0, buffer, offset).tobytes()


LONG = b"x" * 20
one(
    "text views",
    ("words", ["ab", "x" * 15], ["ab", "x" * 15]),
    b"vu",
    lambda p: p.array(2, [None, i32(2).tobytes() + b"ab" + b"\0" * 10 + view(15, 0, 5), LONG, i64(20)]),
)
for what, broken in (
    ("a text has the length -1", view(-1, 0, 0)),
    ("in buffer 1 of 1", view(15, 1, 0)),
    ("in buffer -1 of 1", view(15, -1, 0)),
    ("15 bytes at 6 is in a buffer of 20", view(15, 0, 6)),
    ("15 bytes at -1", view(15, 0, -1)),
    ("2147483647 bytes at 2147483647", view(2**31 - 1, 0, 2**31 - 1)),
):
    one(
        f"text views: {what}",
        ("ValueError", COLUMN, what),
        b"vu",
        lambda p, v=broken: p.array(1, [None, v, LONG, i64(20)]),
    )
one(
    "text views without sizes",
    ("ValueError", COLUMN, "no buffer of characters"),
    b"vu",
    lambda p: p.array(1, [None, view(15, 0, 0), LONG, None]),
)
one(
    "text views with two buffers",
    ("ValueError", COLUMN, "2 buffers where 3"),
    b"vu",
    lambda p: p.array(1, [None, view(1, 0, 0)]),
)


def dictionary(
    indices: np.ndarray, format: bytes = b"i", values: bytes = b"u", **other: Any
) -> Callable[[Producer], Any]:
    def make(p: Producer) -> Any:
        texts = p.array(2, [None, i32(0, 1, 2), b"ab"])
        array = p.array(len(indices), [None, indices], dictionary=texts, **other)
        return p.table(p.schema(format, dictionary=p.schema(values)), array)

    return make


BROKEN["dictionary"] = (dictionary(i32(1, 0, 1)), ("words", ["b", "a", "b"], ["b", "a"]))
BROKEN["dictionary, index beyond"] = (dictionary(i32(0, 2)), ("ValueError", COLUMN, "index 2 of a dictionary with 2"))
BROKEN["dictionary, index below 0"] = (dictionary(i32(-1)), ("ValueError", COLUMN, "index -1 of a dictionary"))
BROKEN["dictionary, largest index"] = (
    dictionary(np.array([2**64 - 1], dtype=np.uint64), b"L"),
    ("ValueError", COLUMN, "of a dictionary with 2"),
)
BROKEN["dictionary, indices of floats"] = (dictionary(np.array([0.0]), b"g"), ("ValueError", COLUMN, "whole numbers"))
BROKEN["dictionary of lists"] = (dictionary(i32(0), values=b"+l"), ("TypeError", COLUMN, "a dictionary of lists"))
one(
    "dictionary that the array lacks",
    ("ValueError", COLUMN, "differ in a dictionary"),
    b"i",
    lambda p: p.array(1, [None, i32(0)]),
    dictionary=Producer().schema(b"u"),
)
one(
    "dictionary that the schema lacks",
    ("ValueError", COLUMN, "differ in a dictionary"),
    b"i",
    lambda p: p.array(1, [None, i32(0)], dictionary=p.array(1, [None, i32(0, 1), b"a"])),
)


@add("dictionary of a dictionary", ("TypeError", COLUMN, "a dictionary of a dictionary"))
def _(p: Producer) -> Any:
    return p.table(p.schema(b"i", dictionary=p.schema(b"i", dictionary=p.schema(b"u"))), p.array(1, [None, i32(0)]))


@add("dictionary of negative length", ("ValueError", COLUMN, "length -1"))
def _(p: Producer) -> Any:
    return p.table(
        p.schema(b"i", dictionary=p.schema(b"u")),
        p.array(1, [None, i32(0)], dictionary=p.array(-1, [None, i32(0), b""])),
    )


for what, array in (
    ("has the length -1", lambda p: p.array(-1, [None, i32(0)])),
    ("the offset -1", lambda p: p.array(1, [None, i32(0)], offset=-1)),
    ("has the length 4611686018427387904", lambda p: p.array(2**62, [None, i32(0)])),
    ("1 buffers where 2", lambda p: p.array(1, [None])),
    ("3 buffers where 2", lambda p: p.array(1, [None, i32(0), i32(0)])),
    ("-1 buffers where 2", lambda p: p.array(1, [None, i32(0)], n_buffers=-1)),
    ("no buffers", lambda p: p.array(1, [None, i32(0)], buffers=None)),
    ("has rows and no values", lambda p: p.array(1, [None, None])),
    ("no bitmap says which", lambda p: p.array(1, [None, i32(0)], null_count=1)),
    ("has children", lambda p: p.array(1, [None, i32(0)], [p.array(1, [None, i32(0)])])),
):
    BROKEN[f"array: {what}"] = (lambda p, a=array: p.table(p.schema(b"i"), a(p), rows=1), ("ValueError", COLUMN, what))
BROKEN["array shorter than the table"] = (
    lambda p: p.table(p.schema(b"i"), p.array(1, [None, i32(0)]), rows=2),
    ("ValueError", COLUMN, "has 1 rows where 2"),
)
BROKEN["array that has been released"] = (
    lambda p: p.table(p.schema(b"i"), p.array(1, [None, i32(0)], release=type(p.array(0, []).release)())),
    ("ValueError", COLUMN, "has been released"),
)
BROKEN["rows without end"] = (lambda p: p.table(p.schema(b"n"), p.array(2**50, [])), ("MemoryError",))
BROKEN["rows without end, often"] = (
    lambda p: p.table(p.schema(b"n"), *[p.array(2**56, []) for _ in range(70)]),
    ("ValueError", "too many rows"),
)

for format, words in (
    (b"q", "values of an unknown type"),
    (b"", "values of an unknown type"),
    (b"d:", "values of an unknown type"),
    (b"d:x,y", "unknown"),
    (b"d:10", "unknown"),
    (b"d:10,2,7", "unknown"),
    (b"d:10,2147483647", "unknown"),
    (b"+zz", "nested values"),
    (b"tdX", "values of an unknown type"),
    (b"tsx:", "values of an unknown type"),
    (b"tiM", "calendar intervals"),
    (b"tiD", "calendar intervals"),
):
    one(f"format {format!r}", ("TypeError", COLUMN, words), format, lambda p: p.array(1, [None, i32(0)]))
one("no format", ("ValueError", COLUMN, "no format"), None, lambda p: p.array(1, [None, i32(0)]))
one("no name", ("numbers", [7.0], None), b"i", lambda p: p.array(1, [None, i32(7)]), name=None)
one(
    "name that is not UTF-8",
    ("ValueError", "a name that is not UTF-8"),
    b"i",
    lambda p: p.array(1, [None, i32(0)]),
    name=b"\xff",
)
one(
    "metadata of negative length",
    ("ValueError", "negative length"),
    b"i",
    lambda p: p.array(1, [None, i32(0)]),
    metadata=i32(1, -5).tobytes(),
)
KEY = b"ARROW:extension:name"
one(
    "extension type",
    ("TypeError", COLUMN, "extension type my"),
    b"i",
    lambda p: p.array(1, [None, i32(0)]),
    metadata=i32(1, len(KEY)).tobytes() + KEY + i32(2).tobytes() + b"my",
)


@add("rows of a struct that are missing", ("numbers", [None, 3.0], None))
def _(p: Producer) -> Any:
    column = p.array(4, [None, i32(1, 2, 3, 4)])
    return p.stream(
        p.schema(b"+s", b"", [p.schema(b"i")]),
        [
            p.array(
                2,
                [
                    bits(1, 0, 1),
                ],
                [column],
                offset=1,
                null_count=1,
            )
        ],
    )


@add("a column by itself", ("numbers", [1.0, 2.0], None))
def _(p: Producer) -> Any:
    return p.stream(p.schema(b"i"), [p.array(1, [None, i32(1)]), p.array(0, [None, None]), p.array(1, [None, i32(2)])])


for name, change, words in (
    ("columns that the data lack", {"children": None}, "1 columns where the schema has 1"),
    ("fewer columns than the schema has", {"n_children": 0}, "0 columns where the schema has 1"),
    ("a number of columns below 0", {"n_children": -1}, "-1 columns where the schema has 1"),
    ("a table of negative length", {"length": -1}, "length -1"),
    ("a table of negative offset", {"offset": -1}, "offset -1"),
    ("a table with five buffers", {"n_buffers": 5}, "5 buffers"),
    ("a table without buffers", {"buffers": None}, "1 buffers"),
):
    BROKEN[name] = (
        lambda p, c=change: p.stream(
            p.schema(b"+s", b"", [p.schema(b"i")]), [p.array(1, [None], [p.array(1, [None, i32(0)])], **c)]
        ),
        ("ValueError", words),
    )
BROKEN["schema without its columns"] = (
    lambda p: p.stream(p.schema(b"+s", b"", [], n_children=3, children=None), []),
    ("ValueError", "no columns"),
)
BROKEN["schema that lacks a column"] = (
    lambda p: p.stream(p.schema(b"+s", b"", [None]), []),
    ("ValueError", "lacks a column"),
)
BROKEN["data that lack a column"] = (
    lambda p: p.stream(p.schema(b"+s", b"", [p.schema(b"i")]), [p.array(1, [None], [None])]),
    ("ValueError", COLUMN, "no data"),
)
BROKEN["get_schema fails"] = (lambda p: p.stream(5, [], b"no luck \xff"), ("ValueError", "get_schema: no luck \ufffd"))
BROKEN["get_next fails"] = (
    lambda p: p.stream(p.schema(b"i"), [p.array(1, [None, i32(1)]), 22], b"half way"),
    ("ValueError", "get_next: half way"),
)
BROKEN["get_next fails without a word"] = (lambda p: p.stream(p.schema(b"i"), [22]), ("ValueError", "Invalid argument"))
BROKEN["no chunks"] = (lambda p: p.stream(p.schema(b"i"), []), ("numbers", [], None))


@add("stream that has been read", ("ValueError", "has been read already"))
def _(p: Producer) -> Any:
    capsule = p.stream(p.schema(b"i"), [])
    read_arrow(capsule)
    return capsule


@add("schema and array", ("numbers", [1.0, 2.0], None))
def _(p: Producer) -> Any:
    return p.capsule(p.schema(b"i"), b"arrow_schema"), p.capsule(p.array(2, [None, i32(1, 2)]), b"arrow_array")


@add("schema and a broken array", ("ValueError", "the column", "no values"))
def _(p: Producer) -> Any:
    return p.capsule(p.schema(b"i"), b"arrow_schema"), p.capsule(p.array(2, [None, None]), b"arrow_array")


BROKEN["capsule of something else"] = (
    lambda p: p.capsule(p.schema(b"i"), b"arrow_schema"),
    ("ValueError", "incorrect name"),
)
BROKEN["no capsule"] = (lambda p: 5, ("ValueError", "invalid PyCapsule"))


CASES = {name: (lambda make=make: outcome(make)) for name, (make, _) in BROKEN.items()}
