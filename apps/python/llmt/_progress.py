"""Temporary."""
from contextlib import contextmanager
from typing import Any, Iterator

@contextmanager
def bar(title: str) -> "Iterator[Any]":
    yield None
