"""What the results of all tasks have in common."""

from __future__ import annotations

import html
import json
from collections.abc import Mapping, Sequence
from typing import Any


class Result:
    """The text of a task's page, and all that is known as a dict. Its state is plain: it can be copied and pickled."""

    def __init__(self, text: str, data: Mapping[str, Any]) -> None:
        self._text = text
        self._data = dict(data)

    def __str__(self) -> str:
        return self._text

    def __repr__(self) -> str:
        return self._text.rstrip("\n")

    def to_dict(self) -> dict[str, Any]:
        """What ``--json`` of the command prints."""
        copy: dict[str, Any] = json.loads(json.dumps(self._data))
        return copy

    @property
    def summary(self) -> str:
        """The outcome in a sentence or two."""
        return self._text.split("\n", 1)[0]

    def _html_tables(self) -> list[str]:
        return []

    def _repr_html_(self) -> str:
        paragraphs = "".join(f"<p>{html.escape(line)}</p>" for line in self.summary.split("\n") if line.strip())
        return "<div>" + paragraphs + "".join(self._html_tables()) + "</div>"


def shown(value: Any) -> str:
    """A cell for people."""
    if value is None:
        return ""
    return f"{value:.4g}" if isinstance(value, float) else str(value)


def html_table(header: Sequence[str], rows: Sequence[Sequence[Any]]) -> str:
    """A table in HTML; nothing without rows."""
    if not rows:
        return ""
    head = "".join(f"<th>{html.escape(name)}</th>" for name in header)
    body = "".join("<tr>" + "".join(f"<td>{html.escape(shown(cell))}</td>" for cell in row) + "</tr>" for row in rows)
    return f"<table><thead><tr>{head}</tr></thead><tbody>{body}</tbody></table>"


def axes_of(ax: Any) -> Any:
    """The axes that were given, or new ones."""
    if ax is not None:
        return ax
    from matplotlib import pyplot

    return pyplot.subplots()[1]


def number(name: str, value: Any, low: float, high: float, *, whole: bool = False) -> Any:
    """The value, if it is a number from ``low`` to ``high``. Raises TypeError or ValueError that names it."""
    if isinstance(value, bool) or not isinstance(value, (int, float)) or (whole and int(value) != value):
        try:
            value = value.item()  # of NumPy
        except AttributeError:
            raise TypeError(f"{name} is {value!r}, must be a {'whole ' if whole else ''}number") from None
        return number(name, value, low, high, whole=whole)
    if not low <= value <= high:
        raise ValueError(f"{name} is {value}, must be a number from {low:g} to {high:g}")
    return int(value) if whole else float(value)


def names(name: str, value: Any) -> list[str]:
    """A word or several as a list. Raises TypeError that names it."""
    if isinstance(value, str):
        return [value]
    result = list(value)
    if not all(isinstance(word, str) for word in result):
        raise TypeError(f"{name} is {value!r}, must be a list of names")
    return result
