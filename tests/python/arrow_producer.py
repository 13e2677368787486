"""A producer of Arrow streams that breaks what it is told to break, by ctypes."""

from __future__ import annotations

import ctypes
from collections.abc import Callable, Sequence
from typing import Any

import numpy as np

from llmt._core import read_arrow

P = ctypes.POINTER


class Schema(ctypes.Structure):
    pass


class Array(ctypes.Structure):
    pass


class Stream(ctypes.Structure):
    pass


def _release_of(kind: type) -> Any:
    return ctypes.CFUNCTYPE(None, P(kind))


Schema._fields_ = [
    ("format", ctypes.c_char_p),
    ("name", ctypes.c_char_p),
    ("metadata", ctypes.c_char_p),
    ("flags", ctypes.c_int64),
    ("n_children", ctypes.c_int64),
    ("children", P(P(Schema))),
    ("dictionary", P(Schema)),
    ("release", _release_of(Schema)),
    ("private_data", ctypes.c_void_p),
]
Array._fields_ = [
    ("length", ctypes.c_int64),
    ("null_count", ctypes.c_int64),
    ("offset", ctypes.c_int64),
    ("n_buffers", ctypes.c_int64),
    ("n_children", ctypes.c_int64),
    ("buffers", P(ctypes.c_void_p)),
    ("children", P(P(Array))),
    ("dictionary", P(Array)),
    ("release", _release_of(Array)),
    ("private_data", ctypes.c_void_p),
]
GetSchema = ctypes.CFUNCTYPE(ctypes.c_int, P(Stream), P(Schema))
GetNext = ctypes.CFUNCTYPE(ctypes.c_int, P(Stream), P(Array))
GetLastError = ctypes.CFUNCTYPE(ctypes.c_void_p, P(Stream))
Stream._fields_ = [
    ("get_schema", GetSchema),
    ("get_next", GetNext),
    ("get_last_error", GetLastError),
    ("release", _release_of(Stream)),
    ("private_data", ctypes.c_void_p),
]

_new_capsule = ctypes.pythonapi.PyCapsule_New
_new_capsule.restype = ctypes.py_object
_new_capsule.argtypes = [ctypes.c_void_p, ctypes.c_char_p, ctypes.c_void_p]


class Producer:
    """Makes the structures, keeps their memory, and counts what is released."""

    def __init__(self) -> None:
        self.kept: list[Any] = []
        self.made = {"schema": 0, "array": 0, "stream": 0}
        self.released = {"schema": 0, "array": 0, "stream": 0, "of a part": 0}

    def _keep(self, thing: Any) -> Any:
        self.kept.append(thing)
        return thing

    def _release(self, kind: type, what: str) -> Any:
        def release(pointer: Any) -> None:
            self.released[what] += 1
            pointer.contents.release = type(pointer.contents.release)()

        return self._keep(_release_of(kind)(release))

    def _pointers(self, kind: type, things: Sequence[Any]) -> Any:
        array = self._keep((P(kind) * max(len(things), 1))())
        for k, thing in enumerate(things):
            array[k] = ctypes.pointer(thing) if thing is not None else P(kind)()
        return ctypes.cast(array, P(P(kind)))

    def schema(
        self, format: bytes | None, name: bytes | None = b"c", children: Sequence[Any] = (), /, **other: Any
    ) -> Schema:
        schema = self._keep(Schema(format=format, name=name, n_children=len(children)))
        schema.children = self._pointers(Schema, children)
        schema.release = self._release(Schema, "of a part")
        for key, value in other.items():
            setattr(schema, key, self._pointer(value))
        return schema

    def array(self, length: int, buffers: Sequence[Any], children: Sequence[Any] = (), /, **other: Any) -> Array:
        array = self._keep(Array(length=length, n_buffers=len(buffers), n_children=len(children)))
        addresses = self._keep((ctypes.c_void_p * max(len(buffers), 1))())
        for k, buffer in enumerate(buffers):
            if buffer is not None:
                held = self._keep(buffer if isinstance(buffer, np.ndarray) else np.frombuffer(buffer, dtype=np.uint8))
                addresses[k] = held.ctypes.data
        array.buffers = ctypes.cast(addresses, P(ctypes.c_void_p))
        array.children = self._pointers(Array, children)
        array.release = self._release(Array, "of a part")
        for key, value in other.items():
            setattr(array, key, self._pointer(value))
        return array

    @staticmethod
    def _pointer(value: Any) -> Any:
        return ctypes.pointer(value) if isinstance(value, ctypes.Structure) else value

    def stream(self, schema: Schema | int, chunks: Sequence[Array | int], error: bytes | None = None) -> Any:
        """A capsule. A number in place of a structure is the error that its call returns."""
        coming = iter(chunks)
        text = None if error is None else self._keep(ctypes.create_string_buffer(error))

        def give(out: Any, thing: Any, what: str) -> int:
            if isinstance(thing, int):
                return thing
            ctypes.memmove(out, ctypes.byref(thing), ctypes.sizeof(thing))
            self.made[what] += 1
            out.contents.release = self._release(type(thing), what)
            return 0

        def get_next(_: Any, out: Any) -> int:
            chunk = next(coming, None)
            if chunk is None:
                out.contents.release = type(out.contents.release)()
                return 0
            return give(out, chunk, "array")

        stream = self._keep(Stream())
        stream.get_schema = self._keep(GetSchema(lambda _, out: give(out, schema, "schema")))
        stream.get_next = self._keep(GetNext(get_next))
        stream.get_last_error = self._keep(GetLastError(lambda _: None if text is None else ctypes.addressof(text)))
        stream.release = self._release(Stream, "stream")
        self.made["stream"] += 1
        return _new_capsule(ctypes.addressof(stream), b"arrow_array_stream", None)

    def table(self, schema: Schema, *columns: Array, rows: int | None = None) -> Any:
        """A capsule with one column in chunks, which are the arrays."""
        chunks = [self.array(c.length if rows is None else rows, [None], [c]) for c in columns]
        return self.stream(self.schema(b"+s", b"", [schema]), chunks)

    def capsule(self, thing: Any, name: bytes) -> Any:
        """A capsule with a structure of its own, counted."""
        what = name.decode().removeprefix("arrow_").replace("array_stream", "stream")
        thing.release = self._release(type(thing), what)
        self.made[what] += 1
        return _new_capsule(ctypes.addressof(thing), name, None)


def i32(*numbers: int) -> np.ndarray:
    return np.array(numbers, dtype=np.int32)


def i64(*numbers: int) -> np.ndarray:
    return np.array(numbers, dtype=np.int64)


def bits(*flags: int) -> np.ndarray:
    return np.packbits(np.array(flags, dtype=np.uint8), bitorder="little")


def outcome(make: Callable[[Producer], Any]) -> list[Any]:
    """What comes of it, and what was made and released."""
    producer = Producer()
    capsules = make(producer)
    try:
        values, columns, _ = read_arrow(*(capsules if isinstance(capsules, tuple) else (capsules,)))
        _, kind, words = columns[0]
        cells = [None if np.isnan(value) else float(value) for value in values[:, 0]]
        found = [kind, [cell if cell is None or words is None else words[int(cell)] for cell in cells], words]
    except Exception as error:
        found = [type(error).__name__, str(error)]
    return [found, producer.made, producer.released]
