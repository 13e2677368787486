"""What a calibration or discovery was made from: the record in the description that it writes."""

from __future__ import annotations

import datetime
import hashlib
import inspect
import json
import os
from collections.abc import Callable, Mapping
from typing import Any

from llmt.robotics._csv import Source

# What changes no result, or stands in the record as a file or a field of its own.
_WITHOUT_EFFECT = {"report", "progress", "threads", "quality", "instrument", "serial_number"}
_FILES = {"robot", "measured", "test", "columns", "catalogue"}


def _today() -> str:
    """The day in UTC, or that of SOURCE_DATE_EPOCH."""
    epoch = os.environ.get("SOURCE_DATE_EPOCH")
    utc = datetime.timezone.utc
    now = datetime.datetime.fromtimestamp(int(epoch), utc) if epoch else datetime.datetime.now(utc)
    return now.strftime("%Y-%m-%d")


def _digest(path: str, text: str | None) -> str:
    if text is not None:
        return hashlib.sha256(text.encode()).hexdigest()
    if not os.path.isfile(path):
        return "not known: no regular file"
    with open(path, "rb") as file:
        return hashlib.sha256(file.read()).hexdigest()


def source_of_columns(columns: Any) -> Source | None:
    """A column map or catalogue: a path, or a dict as JSON text."""
    if columns is None:
        return None
    if isinstance(columns, Mapping):
        return "<dict>", json.dumps(columns)
    return os.fspath(columns), None


def record_of(task: Callable[..., Any], given: Mapping[str, Any], sources: Mapping[str, Source | None]) -> str:
    """The record of a call of ``task`` with the arguments ``given``, as JSON. ``sources``: role and table; a table in
    memory has the digest of its CSV text."""
    from llmt import __version__

    options = [
        f"{name}={given[name]!r}"
        for name, parameter in inspect.signature(task).parameters.items()
        if name not in _WITHOUT_EFFECT | _FILES and given[name] != parameter.default
    ]
    files = [
        {"role": role, "name": os.path.basename(source[0]), "sha256": _digest(*source)}
        for role, source in sources.items()
        if source is not None
    ]
    return json.dumps(
        {
            "program": f"llmt.robotics {__version__}",
            "date": _today(),
            "files": files,
            "options": options,
            "instrument": str(given["instrument"] or ""),
            "serial_number": str(given["serial_number"] or ""),
        }
    )
