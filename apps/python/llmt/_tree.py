"""The tree of a model file for people: conditions and equations in the words of `llmt rules`, and what is drawn of it."""

from __future__ import annotations

import json
import math
import unicodedata
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from functools import cached_property
from typing import Any, NamedTuple

import numpy as np

from . import _core
from ._core import decimal as decimal

_ANY_VALUE = float(np.finfo(float).max)  # threshold of a split into rows with and without a value


def number(value: float | None, digits: int = 4) -> str:
    """The number rounded to significant digits; "-" for None and NaN."""
    return "-" if value is None else _core.number(value, digits)


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

    def __init__(
        self, model: dict[str, Any], partition: int = 0, show: Callable[[str], str] = str, handle: Any = None
    ) -> None:
        """`show` makes of a name what stands in the texts. `handle`: the `_core.Model` of the model, if there is one."""
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
        self._words = _core.Words(
            handle or _handle_of(model),
            partition,
            [of["name"] for of in self.inputs],
            [of["levels"] for of in self.inputs],
        )
        self.regressor_names = self._words.regressors()
        self.leaves = [
            self._leaf(node, number, conditions)
            for number, (node, conditions) in enumerate(self._words.leaves(), start=1)
        ]

    @property
    def is_smooth(self) -> bool:
        """Whether a prediction may be a mean of several leaves' equations."""
        return self.partition["validity"]["kind"] != "crisp" and len(self.leaves) > 1

    @cached_property
    def is_short(self) -> bool:
        """True if every number is short, as in a readable tree; then none is rounded."""
        splits = [node["split"] for node in self.nodes if "split" in node]
        thresholds = [split["threshold"] for split in splits if split.get("threshold", _ANY_VALUE) < _ANY_VALUE]
        if any("direction" in split for split in splits) or not all(map(_is_short, thresholds)):
            return False
        for leaf in self.leaves:
            sums = np.abs(leaf.slope) @ np.abs(self.centres)  # whose rounding the intercept has
            if not all(map(_is_short, leaf.slope.ravel())) or not all(map(_is_short, leaf.intercept, sums)):
                return False
        return True

    def condition(self, node: int, left: bool, tolerances: Mapping[int, float] | None = None) -> Condition:
        """The condition of one side of the node's split, in full or as rounded as `threshold_tolerances()` allows."""
        tolerance = None if tolerances is None else tolerances.get(self.nodes[node]["split"]["column"], 0.0)
        return Condition(*self._words.condition(node, left, tolerance))

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
        return self._words.equation(leaf.intercept[output], leaf.slope[output].tolist())

    def short_equation(self, leaf: Leaf, output: int = 0) -> tuple[list[str], int]:
        """The equation for a picture, and how many terms it leaves out: that of a short tree as it is.

        Else every coefficient has the digits that move a prediction by less than 0.1 % of the target's range in
        training; terms that move it by less are left out. The terms stand by the size of what they move.
        """
        if self.is_short:
            return self.equation(leaf, output), 0
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

        Those of least squares over the rows of the leaf, (I.6) of docs/algorithms/intervals.md:
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

    def as_leaf(self, node: int) -> Leaf:
        """An inner node as the leaf that it was before it was split. It has no number."""
        return self._leaf(node, 0, [])

    def _leaf(self, at: int, count: int, conditions: list[str]) -> Leaf:
        node = self.nodes[at]
        slope = np.array(node["slope"], dtype=float).reshape(len(self.targets), len(self.regressors))
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


def trees(model: dict[str, Any], show: Callable[[str], str] = str, handle: Any = None) -> list[Tree]:
    """All partitions of a model."""
    handle = handle or _handle_of(model)
    return [Tree(model, p, show, handle) for p in range(len(model["partitions"]))]


def _handle_of(model: dict[str, Any]) -> _core.Model:
    return _core.Model(json.dumps(model))


EMPTY = "(empty)"
"""What the level of missing values is called."""


def level_names(of: dict[str, Any]) -> list[str]:
    """The names of the levels of an input; empty for numbers."""
    codes = of.get("codes")
    if codes is None or not len(codes):
        return [name or EMPTY for name in of.get("levels") or []]
    has_empty_level = "empty_level" in of or len(of.get("levels") or []) > len(codes)
    return [repr(float(code)).removesuffix(".0") for code in codes] + ([EMPTY] if has_empty_level else [])


def _is_short(value: float, beside: float = 0.0) -> bool:
    """True if six digits give the number, up to the rounding of a sum of it and `beside`."""
    return bool(abs(float(f"{value:.6g}") - value) <= 1e-12 * (abs(value) + beside))


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
