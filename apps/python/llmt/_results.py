"""What the results of all tasks have in common."""

from __future__ import annotations

import html
import json
from collections.abc import Mapping, Sequence
from typing import Any

from llmt._frames import table_of


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


class Findings(Result):
    """What a search for missing effects found: the verdict, effects with their values, the error before and after."""

    _of_effect: tuple[str, ...]  # keys of an effect that stand before those of its values in the table ``effects``
    _sizes: tuple[str, ...]  # those that stand after them
    _titles: Mapping[str, str]  # of the columns of the table in a notebook that say which effect it is, by their keys

    @property
    def verdict(self) -> str:
        """``nothing missing``, ``named``, ``named, indistinguishable`` or ``unknown effect``."""
        verdict: str = self._data["verdict"]
        return verdict

    @property
    def effects(self) -> Any:
        """What was found: a row for each value (coefficient, constant) of an effect, with its standard error."""
        rows = [
            {key: effect[key] for key in self._of_effect}
            | _value(value, "parameter")
            | {key: effect[key] for key in self._sizes}
            | {"rivals": ", ".join(effect["rivals"])}
            for effect in self._data["effects"]
            for value in effect["parameters"]
        ]
        return table_of(rows, [*self._of_effect, "parameter", *_of_value, *self._sizes, "rivals"])

    @property
    def gap(self) -> dict[str, Any]:
        """The error before and after on rows that took no part, and where it was."""
        gap: dict[str, Any] = self._data["gap"]
        return gap

    def _effects_html(self) -> str:
        rows = [
            [*(effect[key] for key in self._titles), *_value(value, "parameter").values()]
            for effect in self._data["effects"]
            for value in effect["parameters"]
        ]
        return html_table([*self._titles.values(), "parameter", "value", "standard error", "unit"], rows)


_of_value = ("value", "standard_error", "unit")


def _value(of: Mapping[str, Any], name: str) -> dict[str, Any]:
    return {name: of["name"], "value": of["value"], "standard_error": of["std_error"], "unit": of["unit"]}


def values_table(values: Sequence[Mapping[str, Any]]) -> Any:
    """``name``, ``value``, ``standard_error`` and ``unit`` of fitted parameters."""
    return table_of([_value(value, "name") for value in values], ["name", *_of_value])


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


def document_tables(document: Mapping[str, Any]) -> list[str]:
    """The tables of a page in HTML, each below its title; of a picture the table that a terminal shows in its place."""
    tables = []
    for section in document["sections"]:
        for block in section["blocks"]:
            table = block.get("in_words", block)
            if table["kind"] == "table":
                title = html.escape(table["title"] or section["title"])
                tables.append(f"<p>{title}</p>" + html_table(table["header"], table["rows"]))
    return tables


def axes_of(ax: Any) -> Any:
    """The axes that were given, or new ones."""
    if ax is not None:
        return ax
    from llmt._plots import pyplot_of

    return pyplot_of().subplots()[1]


def draw_points(
    ax: Any, places: Any, values: Mapping[str, Any], *, x: str, y: str, title: str = "", lines: Mapping[str, float] = {}
) -> Any:
    """Draws the values of every label as points and ``lines`` as horizontal lines. Returns the axes of matplotlib."""
    ax = axes_of(ax)
    for label, of in values.items():
        ax.plot(places, of, ".", label=label)
    for label, level in lines.items():
        ax.axhline(level, linestyle="--", label=label)
    ax.set_xlabel(x)
    ax.set_ylabel(y)
    ax.set_title(title)
    ax.xaxis.get_major_locator().set_params(integer=True)
    ax.legend()
    return ax


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
