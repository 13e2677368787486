"""The tree of a model file in the words of a person: conditions, equations, numbers with the digits that they need.

The texts are those of `llmt rules`, made from the JSON of a model (docs/file-formats.md).
"""

from __future__ import annotations

import math
import unicodedata
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from typing import Any, NamedTuple

import numpy as np

_MUCH_SHORTER = 4  # a list of the levels that are not meant is shown where it is this many times shorter
_ANY_VALUE = float(np.finfo(float).max)  # threshold of a split into rows with and without a value
_USUAL_DIGITS = 5
_MOST_DIGITS = 12


def decimal(value: float, tolerance: float | None = None) -> str:
    """The number with as few digits as say it to within `tolerance`; without one, up to rounding.

    Numbers that would need more than 12 digits get 5.
    """
    tolerance = 1e-13 * abs(value) if tolerance is None else tolerance
    if not math.isfinite(value):
        return str(value)
    if abs(value) <= tolerance:
        return "0"
    for digits in range(1, _MOST_DIGITS + 1):
        text = _with_digits(value, digits)
        if abs(float(text) - value) <= tolerance:
            return text
    return _with_digits(value, _USUAL_DIGITS)


def _with_digits(value: float, digits: int) -> str:
    magnitude = abs(value)
    if magnitude < 1e-5 or magnitude >= 1e9:
        return f"{value:.{digits}g}"
    before_point = 1 + math.floor(math.log10(magnitude))
    text = f"{value:.{max(0, digits - before_point)}f}"
    return text.rstrip("0").rstrip(".") if "." in text else text


def number(value: float | None, digits: int = 4) -> str:
    """The number rounded to significant digits; "-" for None and NaN."""
    if value is None or math.isnan(value):
        return "-"
    if not math.isfinite(value) or value == 0.0:
        return str(value) if value else "0"
    text = f"{value:.{digits}g}"
    return (
        f"{float(text):.{max(0, digits - 1 - math.floor(math.log10(abs(value))))}f}"
        if 1e-4 <= abs(value) < 1e6
        else text
    )


def shown(name: str, most: int = 60) -> str:
    """A name that can stand inside other text: control characters, among them those that turn the direction of all that
    follows, become "\N{REPLACEMENT CHARACTER}", and what is longer than `most` characters ends in an ellipsis."""
    clean = "".join(
        "\N{REPLACEMENT CHARACTER}" if unicodedata.category(c) in ("Cc", "Cf", "Cs", "Zl", "Zp") else c
        for c in name[: most + 1]
    )
    return clean if len(clean) <= most else clean[: most - 1] + "\N{HORIZONTAL ELLIPSIS}"


class Condition(NamedTuple):
    """One side of a split: what is compared, and how: ("age", "<= 21")."""

    what: str
    how: str

    def __str__(self) -> str:
        return f"{self.what} {self.how}"


@dataclass
class Leaf:
    """A leaf: where it holds and what it says there. Lists have one element for each target of the partition."""

    node: int  # position in the nodes of the partition
    number: int  # from left to right, counted from 1
    conditions: list[str]  # all of them hold; none: everywhere
    rows: int
    rank: int
    rmse: list[float]  # over the training rows
    intercept: list[float]  # of the equation in the inputs themselves
    slope: np.ndarray  # targets x regressors
    mean: np.ndarray = field(repr=False)  # of the regressors over the rows, as deviations from their centres


class Tree:
    """One partition of a model. Several targets may share it."""

    def __init__(self, model: dict[str, Any], partition: int = 0, show: Callable[[str], str] = str) -> None:
        """`show` makes of a name what stands in the texts."""
        self.inputs: list[dict[str, Any]] = [
            {**of, "name": show(of["name"]), "levels": [show(name) for name in level_names(of)]}
            for of in model["inputs"]
        ]
        self.regressors: list[dict[str, Any]] = model["regressors"]
        self.partition: dict[str, Any] = model["partitions"][partition]
        self.nodes: list[dict[str, Any]] = self.partition["nodes"]
        self.outputs = [
            {**model["outputs"][o], "name": show(model["outputs"][o]["name"])} for o in self.partition["outputs"]
        ]
        self.targets: list[str] = [output["name"] for output in self.outputs]
        self.centres = np.array([regressor["centre"] for regressor in self.regressors], dtype=float)
        self.regressor_names = [self._regressor_name(regressor) for regressor in self.regressors]
        self.leaves = self._leaves()

    @property
    def is_smooth(self) -> bool:
        """Whether a prediction may be a mean of several leaves' equations."""
        return self.partition["validity"]["kind"] != "crisp" and len(self.leaves) > 1

    def condition(self, node: int, left: bool, tolerances: Mapping[int, float] | None = None) -> Condition:
        """The condition of one side of the node's split, in full or as rounded as `threshold_tolerances()` allows."""
        split = self.nodes[node]["split"]
        of = self.inputs[split["column"]]
        if "level_side" in split:
            wanted = -1 if left else 1
            return Condition(
                of["name"], _levels(of, [k for k, side in enumerate(split["level_side"]) if side == wanted])
            )
        sign = "<=" if left else ">"
        if "direction" in split:
            threshold = split["threshold"]
            text = ""
            for weight, other in zip(split["direction"], self.inputs):
                if weight:
                    threshold += weight * other["centre"]
                    joint = ("-" if weight < 0 else "") if not text else " - " if weight < 0 else " + "
                    size = decimal(abs(weight)) if tolerances is None else number(abs(weight), 2)
                    text += f"{joint}{size} {other['name']}"
            return Condition(text, f"{sign} {decimal(threshold) if tolerances is None else number(threshold, 3)}")
        if split["threshold"] >= _ANY_VALUE:
            return Condition(of["name"], "is known" if left else "is missing")
        tolerance = None if tolerances is None else tolerances[split["column"]]
        return Condition(of["name"], f"{sign} {decimal(split['threshold'], tolerance)}")

    def threshold_tolerances(self, drawn_nodes: int) -> dict[int, float]:
        """How far the thresholds of each input may be rounded in a picture of the first nodes: 0.2 % of the input's
        range, and less where two thresholds would look alike."""
        thresholds: dict[int, set[float]] = {}
        for node in self.nodes[:drawn_nodes]:
            split = node.get("split", {})
            if split.get("threshold", _ANY_VALUE) < _ANY_VALUE:
                thresholds.setdefault(split["column"], set()).add(split["threshold"])
        tolerances = {}
        for column, values in thresholds.items():
            gap = min(np.diff(sorted(values)), default=math.inf)
            tolerances[column] = min(2e-3 * (self.inputs[column]["high"] - self.inputs[column]["low"]), 0.2 * gap)
        return tolerances

    def equation(self, leaf: Leaf, output: int = 0) -> list[str]:
        """The terms of the leaf's equation with their signs, in full: "12.3", "+ 0.45 cement", "- 1.2 water"."""
        slopes = leaf.slope[output]
        # The constant was computed from the value at the centres, and has the rounding of that sum.
        magnitude = abs(leaf.intercept[output]) + float(np.abs(slopes * self.centres).sum())
        terms = [decimal(leaf.intercept[output], 1e-13 * magnitude)]
        return terms + [
            f"{'-' if slope < 0 else '+'} {decimal(abs(slope))} {name}"
            for slope, name in zip(slopes.tolist(), self.regressor_names)
            if slope != 0.0
        ]

    def short_equation(self, leaf: Leaf, output: int = 0) -> tuple[list[str], int]:
        """The equation for a picture, and how many terms it leaves out.

        Every coefficient has the digits that move a prediction by less than 0.1 % of the target's range in training;
        terms that move it by less are left out. The terms stand by the size of what they move.
        """
        of = self.outputs[output]
        tolerance = 1e-3 * (of["high"] - of["low"])
        root = self.nodes[0]
        low, high = np.array(root["low"], dtype=float), np.array(root["high"], dtype=float)
        largest = np.maximum(np.abs(self.centres + low), np.abs(self.centres + high))
        node = self.nodes[leaf.node]
        effects = np.abs(leaf.slope[output]) * (
            np.array(node["high"], dtype=float) - np.array(node["low"], dtype=float)
        )
        order = np.argsort(-effects, kind="stable")
        terms, left_out = [decimal(leaf.intercept[output], tolerance)], 0
        for k in order.tolist():
            slope = float(leaf.slope[output, k])
            if slope == 0.0:
                continue
            if abs(slope) * largest[k] <= tolerance or effects[k] <= tolerance:
                left_out += 1
                continue
            size = decimal(abs(slope), tolerance / largest[k])
            term = self.regressor_names[k] if size == "1" else f"{size} {self.regressor_names[k]}"
            terms.append(f"{'-' if slope < 0 else '+'} {term}")
        if terms[0] == "0" and len(terms) > 1:
            terms[:2] = [terms[1].removeprefix("+ ").replace("- ", "-", 1 if terms[1].startswith("-") else 0)]
        return terms, left_out

    def mean_prediction(self, leaf: Leaf, output: int = 0) -> float:
        """What the leaf's equation says at the mean of its rows."""
        return float(self.nodes[leaf.node]["value"][output] + leaf.slope[output] @ leaf.mean)

    def leaves_below(self, node: int) -> int:
        """The number of leaves below a node; 1 for a leaf."""
        count, waiting = 0, [node]
        while waiting:
            split = self.nodes[waiting.pop()].get("split")
            if split is None:
                count += 1
            else:
                waiting += [split["left"], split["right"]]
        return count

    def standard_errors(self, leaf: Leaf, output: int = 0) -> tuple[float, np.ndarray]:
        """Standard errors of the intercept and of the slopes of a leaf.

        Those of least squares over the rows of the leaf, (I.3) of docs/algorithms/intervals.md:
            se_k^2 = RSS_i / (n_i - p_i) (T G_i^-1 T')_kk
        with T the step from the coefficients of deviations to those of the regressors. They take the tree as given.
        NaN where the leaf's rows do not determine the coefficient, where it was not selected, where as many
        coefficients as rows were fitted, and in models without Gram matrices.
        """
        count = len(self.regressors) + 1
        nothing = math.nan, np.full(count - 1, math.nan)
        node = self.nodes[leaf.node]
        if "inverse_gram" not in node or leaf.rows <= leaf.rank:
            return nothing
        lower = np.zeros((count, count))
        lower[np.tril_indices(count)] = node["inverse_gram"]
        inverse = lower + np.tril(lower, -1).T
        transform = np.eye(count)
        transform[0, 1:] = -self.centres
        variance = node["rss"][output] / (leaf.rows - leaf.rank)
        errors = np.sqrt(np.maximum(0.0, variance * np.einsum("ij,jk,ik->i", transform, inverse, transform)))
        root = self.nodes[0]
        scale = np.maximum(1e-300, np.maximum(np.abs(root["low"]), np.abs(root["high"])))
        undetermined = _undetermined(inverse * np.outer(np.r_[1.0, scale], np.r_[1.0, scale]), leaf.rank)
        undetermined[1:] |= leaf.slope[output] == 0.0
        if undetermined[1:][self.centres != 0.0].any() and (np.diag(inverse)[1:] > 0.0)[undetermined[1:]].any():
            undetermined[0] = True  # the value at the centres is determined, that at 0 is not
        errors[undetermined] = math.nan
        return float(errors[0]), errors[1:]

    def _regressor_name(self, regressor: dict[str, Any]) -> str:
        of = self.inputs[regressor["column"]]
        if "second_column" in regressor:
            second = self.inputs[regressor["second_column"]]
            same = regressor["second_column"] == regressor["column"]
            return _factor(of) + "^2" if same else f"{_factor(of)}*{_factor(second)}"
        return f"[{of['name']} = {of['levels'][regressor['level']]}]" if "level" in regressor else of["name"]

    def _leaves(self) -> list[Leaf]:
        leaves: list[Leaf] = []
        waiting: list[tuple[int, dict[int, Any], list[str]]] = [(0, {}, [])]  # node, box, sides of oblique splits
        while waiting:
            at, box, sides = waiting.pop()
            split = self.nodes[at].get("split")
            if split is None:
                leaves.append(self._leaf(at, len(leaves) + 1, box, sides))
                continue
            for left in (False, True):
                child = split["left"] if left else split["right"]
                if "direction" in split:
                    waiting.append((child, box, [*sides, str(self.condition(at, left))]))
                else:
                    waiting.append(
                        (child, {**box, split["column"]: _cut(box.get(split["column"]), split, left)}, sides)
                    )
        return leaves

    def as_leaf(self, node: int) -> Leaf:
        """An inner node as the leaf that it was before it was split. It has no number."""
        return self._leaf(node, 0, {}, [])

    def _leaf(self, at: int, count: int, box: dict[int, Any], sides: list[str]) -> Leaf:
        node = self.nodes[at]
        slope = np.array(node["slope"], dtype=float).reshape(len(self.targets), len(self.regressors))
        conditions = list(sides)
        for column in sorted(box):
            conditions += _box_conditions(self.inputs[column], box[column])
        rows = int(node["samples"])
        return Leaf(
            node=at,
            number=count,
            conditions=conditions,
            rows=rows,
            rank=int(node["rank"]),
            rmse=[math.sqrt(rss / max(rows, 1)) for rss in node["rss"]],
            intercept=(np.array(node["value"], dtype=float) - slope @ self.centres).tolist(),
            slope=slope,
            mean=np.array(node["mean"], dtype=float),
        )


def trees(model: dict[str, Any], show: Callable[[str], str] = str) -> list[Tree]:
    """All partitions of a model."""
    return [Tree(model, p, show) for p in range(len(model["partitions"]))]


def level_names(of: dict[str, Any]) -> list[str]:
    """The names of the levels of an input; empty for numbers."""
    codes = of.get("codes") or []
    return [repr(float(code)).removesuffix(".0") for code in codes] if len(codes) else list(of.get("levels") or [])


def _cut(side: Any, split: dict[str, Any], left: bool) -> Any:
    """The part of a node's box along the split input that a child has: (low, high), or the list of levels."""
    if "level_side" in split:
        kept = range(len(split["level_side"])) if side is None else side
        return [level for level in kept if split["level_side"][level] == (-1 if left else 1)]
    low, high = side or (-math.inf, math.inf)
    return (low, min(high, split["threshold"])) if left else (max(low, split["threshold"]), high)


def _box_conditions(of: dict[str, Any], side: Any) -> list[str]:
    name = of["name"]
    if isinstance(side, list):
        return [f"{name} {_levels(of, side)}"]
    low, high = side
    if low >= _ANY_VALUE:
        return [f"{name} is missing"]
    parts = [f"{name} is known"] if high == _ANY_VALUE else []
    below, above = high < _ANY_VALUE, math.isfinite(low)
    if below and above:
        parts.append(f"{decimal(low)} < {name} <= {decimal(high)}")
    elif below:
        parts.append(f"{name} <= {decimal(high)}")
    elif above:
        parts.append(f"{name} > {decimal(low)}")
    return parts


def _levels(of: dict[str, Any], levels: list[int]) -> str:
    others = [level for level in range(len(of["levels"])) if level not in levels]
    by_others = bool(others) and _MUCH_SHORTER * len(others) <= len(levels)
    names = ", ".join(_quoted(of["levels"][level]) for level in (others if by_others else levels))
    return f"{'not in' if by_others else 'in'} {{{names}}}"


def _quoted(name: str) -> str:
    """The name as a field of CSV."""
    return '"' + name.replace('"', '""') + '"' if any(c in name for c in '",\r\n') else name


def _factor(of: dict[str, Any]) -> str:
    if of["centre"] == 0.0:
        return str(of["name"])
    return f"({of['name']} {'+' if of['centre'] < 0 else '-'} {decimal(abs(of['centre']))})"


def _undetermined(scaled: np.ndarray, rank: int) -> np.ndarray:
    """Which coefficients the rows do not determine: those in the directions of the largest elements of the inverse of
    the scaled Gram matrix, beyond its rank."""
    present = np.diag(scaled) > 0.0  # a sparse model has the rows and columns of its regressors only
    missing = int(present.sum()) - rank
    result = np.zeros(len(scaled), dtype=bool)
    if missing > 0:
        vectors = np.linalg.eigh(scaled[np.ix_(present, present)])[1]
        result[present] = (vectors[:, -missing:] ** 2).sum(axis=1) > 1e-6
    return result
