"""Contributions of the inputs to predictions."""

from __future__ import annotations

import sys
from collections.abc import Sequence
from typing import Any

import numpy as np

from ._html import bar_rows
from ._tree import level_names, number, shown


class Explanation:
    """How the inputs move each prediction away from a base value.

    For every row and target, `base_values + values.sum(over the inputs) = prediction` (docs/algorithms/explanation.md).

    Of one tree the values are those of the Aumann-Shapley rule along the straight line from the point where every number
    has its mean and every category is missing (integrated gradients): contributions of a path, not the expectations over
    the training rows that tree SHAP computes. In an affine model they are slope times the distance from the mean.

    Of a sum of trees they are Shapley values against rows of a background (interventional SHAP), and the base value is
    the mean prediction of these rows.

    The attributes have the names and shapes of `shap.Explanation`, and where shap has been imported the plots of shap
    take this object as theirs.

    values: (rows, inputs), or (rows, inputs, targets) if there are several targets.
    base_values: (rows,) or (rows, targets).
    data: (rows, inputs), the inputs; of categories the labels, None where they are missing.
    display_data: the same.
    feature_names, output_names: lists; one name where an index took a single input.

    `explanation[3]` is one row, `explanation[:10]` ten, `explanation[..., "force"]` one target of several.
    """

    def __init__(
        self,
        values: np.ndarray,
        base_values: np.ndarray,
        data: np.ndarray,
        feature_names: Sequence[str] | str,
        output_names: Sequence[str],
        codes: np.ndarray | None = None,
    ) -> None:
        """`codes`: `data` as numbers, with positions for labels; by default `data`. Shapes: see above, where a
        dimension that an index took away is missing."""
        self.values = values
        self.base_values = base_values
        self.data = data
        self.feature_names = feature_names if isinstance(feature_names, str) else list(feature_names)
        self.output_names = list(output_names)
        self._codes = data if codes is None else codes

    @property  # type: ignore[misc]
    def __class__(self) -> type:
        # shap.plots ask isinstance(..., shap.Explanation).
        shap = sys.modules.get("shap")
        return getattr(shap, "Explanation", Explanation)

    @property
    def display_data(self) -> np.ndarray:
        return self.data

    @property
    def shape(self) -> tuple[int, ...]:
        return self.values.shape

    def __len__(self) -> int:
        return len(self.values)

    def __getitem__(self, item: Any) -> "Explanation":
        """As of an array of the shape of `values`. An input or a target may be given by its name."""
        rows, inputs, outputs = self._indices(item)
        index = tuple(i for i, present in zip((rows, inputs, outputs), self._axes()) if present)
        has_rows, has_inputs, has_outputs = self._axes()
        base_index = tuple(i for i, present in zip((rows, outputs), (has_rows, has_outputs)) if present)
        data_index = index[: len(index) - 1] if has_outputs else index
        feature_names = np.array(self.feature_names, dtype=object)[inputs] if has_inputs else self.feature_names
        output_names = np.array(self.output_names, dtype=object)[outputs] if has_outputs else self.output_names
        return Explanation(
            self.values[index],
            np.asarray(self.base_values)[base_index],
            self.data[data_index],
            feature_names if isinstance(feature_names, str) else list(feature_names),
            np.atleast_1d(np.asarray(output_names, dtype=object)).tolist(),
            self._codes[data_index],
        )

    def __getattr__(self, name: str) -> Any:
        # What shap's own class has besides (abs, mean, hclust, ...).
        if name.startswith("_") or "shap" not in sys.modules:
            raise AttributeError(f"an Explanation has no attribute {name!r}")
        return getattr(self.to_shap(), name)

    def __reduce__(self) -> Any:
        return _made, (self.values, self.base_values, self.data, self.feature_names, self.output_names, self._codes)

    def to_shap(self) -> Any:
        """A `shap.Explanation`: what all of shap takes. Its `data` are numbers, its `display_data` the labels."""
        try:
            import shap
        except ImportError as error:
            raise ImportError("to_shap() needs shap: pip install shap") from error
        return shap.Explanation(
            values=self.values,
            base_values=self.base_values,
            data=self._codes,
            display_data=self.data,
            feature_names=self.feature_names,
            output_names=self.output_names if self._axes()[2] else None,
        )

    def to_text(self, width: int = 80) -> str:
        """One row as a waterfall, inputs by the size of what they contribute; of several rows the mean sizes."""
        if self._axes() == (False, True, True):
            return "\n".join(f"{shown(name)}\n{self[:, name].to_text(width)}" for name in self.output_names)
        if not self._is_single():
            return self._overview()
        lines, begin = [], float(self.base_values)
        order = self._by_size(np.abs(self.values))
        ends = float(self.base_values) + np.concatenate([[0.0], np.cumsum(self.values[order])])
        low, high = float(ends.min()), float(ends.max())
        names = [f"{shown(self.feature_names[k], 24)} = {_cell(self.data[k])}" for k in order]
        name_width = min(38, max((len(name) for name in names), default=0))
        room = max(10, width - name_width - 14)
        lines.append(f"{'base value':<{name_width}}  {number(begin):>9}")
        for k, name in zip(order, names):
            end = begin + float(self.values[k])
            left, right = (round((x - low) / ((high - low) or 1.0) * room) for x in (min(begin, end), max(begin, end)))
            bar = " " * left + (">" if end >= begin else "<") * max(1, right - left)
            lines.append(f"{shown(name, name_width):<{name_width}}  {_signed(self.values[k]):>9}  {bar}".rstrip())
            begin = end
        return "\n".join([*lines, f"{'prediction':<{name_width}}  {number(begin):>9}"])

    def __repr__(self) -> str:
        return self.to_text()

    def _repr_html_(self) -> str:
        if self._axes() == (False, True, True):
            return "".join(self[:, name]._repr_html_() for name in self.output_names)
        if self._is_single():
            order = self._by_size(np.abs(self.values))
            prediction = float(self.base_values) + float(self.values.sum())
            base = number(float(self.base_values))
            title = f"{shown(self.output_names[0])}: {number(prediction)} = {base} (base) + contributions"
            rows = [
                (f"{shown(self.feature_names[k], 24)} = {shown(_cell(self.data[k]), 24)}", float(self.values[k]))
                for k in order
            ]
            return bar_rows(title, rows, signed=True)
        parts = []
        for name, sizes in self._mean_sizes():
            rows = [(shown(self._names()[k], 40), float(sizes[k])) for k in self._by_size(sizes)]
            parts.append(bar_rows(f"{shown(name)}: mean size of the contributions over {len(self)} rows", rows))
        return "".join(parts)

    def _overview(self) -> str:
        lines = []
        for name, sizes in self._mean_sizes():
            lines.append(f"{shown(name)}: mean size of the contributions over {len(self)} rows")
            for k in self._by_size(sizes)[:20]:
                lines.append(f"  {shown(self._names()[k], 40):<24}  {number(float(sizes[k])):>9}")
        return "\n".join(lines)

    def _mean_sizes(self) -> list[tuple[str, np.ndarray]]:
        has_rows, has_inputs, has_outputs = self._axes()
        sizes = np.abs(self.values) if has_inputs else np.abs(self.values)[..., None]
        sizes = sizes.mean(axis=0) if has_rows else sizes
        return list(zip(self.output_names, sizes.T if has_outputs else [sizes]))

    def _by_size(self, sizes: np.ndarray) -> np.ndarray:
        return np.argsort(-sizes, kind="stable")

    def _names(self) -> list[str]:
        return [self.feature_names] if isinstance(self.feature_names, str) else self.feature_names

    def _is_single(self) -> bool:
        return self._axes() == (False, True, False)

    def _axes(self) -> tuple[bool, bool, bool]:
        """Which of rows, inputs and targets `values` has."""
        has_outputs = np.ndim(self.values) == np.ndim(self.data) + 1
        has_rows = np.ndim(self.base_values) == (2 if has_outputs else 1)
        return has_rows, np.ndim(self.data) == (2 if has_rows else 1), has_outputs

    def _indices(self, item: Any) -> tuple[Any, Any, Any]:
        given = list(item) if isinstance(item, tuple) else [item]
        axes = self._axes()
        if any(i is Ellipsis for i in given):
            at = next(k for k, i in enumerate(given) if i is Ellipsis)
            given[at : at + 1] = [slice(None)] * (sum(axes) - len(given) + 1)
        given += [slice(None)] * (sum(axes) - len(given))
        if len(given) > sum(axes):
            raise IndexError(f"{len(given)} indices for an Explanation of shape {self.shape}")
        every = iter(given)
        rows, inputs, outputs = (next(every) if present else slice(None) for present in axes)
        return rows, _position(inputs, self._names()), _position(outputs, self.output_names)


def explanation_of(handle: Any, inputs: np.ndarray, *more: Any) -> Explanation:
    """The contributions for rows of inputs (categories as positions of their levels, or codes) to a `_core.Model`, or,
    with the background and the number of threads, to a `_core.BoostedModel`."""
    columns, names = handle.inputs(), handle.outputs()
    contributions, base = handle.attribute(inputs, *more)
    rows = len(inputs)
    values = contributions[0] if len(names) == 1 else np.stack(contributions, axis=2)
    base_values = np.full(rows, base[0]) if len(names) == 1 else np.tile(base, (rows, 1))
    data: np.ndarray = np.array(inputs, dtype=float)
    codes = data
    if any(column["levels"] and not len(column["codes"]) for column in columns):
        data = data.astype(object)
        for k, column in enumerate(columns):
            levels = level_names(column)
            if levels and not len(column["codes"]):
                data[:, k] = [levels[int(x)] if 0 <= x < len(levels) else None for x in codes[:, k]]
    return Explanation(values, base_values, data, [column["name"] for column in columns], names, codes)


def _made(*state: Any) -> Explanation:
    return Explanation(*state)


def _position(index: Any, names: list[str]) -> Any:
    if not isinstance(index, str):
        return index
    if index not in names:
        raise KeyError(f"{index!r} is none of {', '.join(names)}")
    return names.index(index)


def _cell(value: Any) -> str:
    if value is None or (isinstance(value, float) and np.isnan(value)):
        return "missing"
    return str(value) if isinstance(value, str) else number(float(value))


def _signed(value: float) -> str:
    return f"{'+' if value >= 0 else '-'}{number(abs(float(value)))}"
