"""A model file as plain values, for the writers of this package.

The members are those of docs/file-formats.md, made ready for evaluation as the C++ library does it: shares in place of
sides, 1 / half width in place of the half width, the residual range with its margin, the boxes of Gaussians.
"""

import math
import re
import sys
from collections.abc import Iterable
from dataclasses import dataclass
from typing import Any

Floats = tuple[float, ...]

BLANKS = " \t\r"
"""What is taken off at both ends of a label before it is compared."""

MARKS = ("na", "n/a", "nan", "null", "?")
"""Texts of a missing value in a CSV file, in small letters."""

_NUMBER = re.compile(r"[+-]?([0-9]+\.?[0-9]*|\.[0-9]+)([eE][+-]?[0-9]+)?", re.ASCII)

PRESENCE = sys.float_info.max
"""Threshold of a split into rows with a value (left) and without one (right)."""

MOST_ANCESTORS = 64
"""Ancestors below the root whose slopes take over beyond the range of a leaf (docs/algorithms/guards.md)."""


@dataclass(frozen=True)
class Input:
    name: str
    low: float
    high: float
    centre: float
    levels: tuple[str, ...] = ()  # labels of a category that rows give as text
    codes: Floats = ()  # numbers of a category that rows give as a number
    has_empty_level: bool = False  # whether a missing value is a level, the last one

    @property
    def count(self) -> int:
        """Number of levels; 0 for a number."""
        return len(self.levels) or len(self.codes) + (1 if self.codes and self.has_empty_level else 0)

    @property
    def empty_level(self) -> int | None:
        """The level of a missing value."""
        return self.count - 1 if self.has_empty_level else None

    @property
    def numbers(self) -> dict[float, int]:
        """Levels of the labels that are texts of numbers, by their value; of 3 and 3.0 the shorter."""
        levels: dict[float, int] = {}
        for level, label in sorted(enumerate(self.levels), key=lambda entry: -len(entry[1])):
            if _NUMBER.fullmatch(label):
                levels[float(label)] = level
        return levels


@dataclass(frozen=True)
class Regressor:
    input: int
    level: int  # -1 for a number or a product
    second: int  # second factor of a product, else -1
    centre: float


@dataclass(frozen=True)
class Node:
    left: int  # -1 in a leaf
    right: int
    parent: int  # -1 for the root
    input: int
    threshold: float
    half_width: float
    per_half_width: float  # 0: a jump
    direction: tuple[tuple[int, float, float], ...]  # (input, weight, centre) of an oblique split
    shares: Floats  # of the left child for each level, for a split on a category
    missing_left: float
    value: Floats  # per output
    slope: tuple[Floats, ...]  # outputs x regressors
    mean: Floats
    low: Floats
    high: Floats

    @property
    def is_leaf(self) -> bool:
        return self.left < 0

    @property
    def is_presence(self) -> bool:
        return not self.is_leaf and not self.shares and not self.direction and self.threshold >= PRESENCE


@dataclass(frozen=True)
class Partition:
    outputs: tuple[int, ...]
    kind: str
    nodes: tuple[Node, ...]
    outer: tuple[Floats, ...]  # outputs x regressors: slopes beyond the training extent
    residual_range: tuple[
        tuple[float, float], ...
    ]  # (low, high) per output, with the margin of B.3; empty: no such guard
    output_range: tuple[Floats | None, ...]  # (low, high) or None per output
    gaussians: tuple[
        tuple[int, tuple[tuple[int, float, float], ...]], ...
    ]  # (node, ((input, centre, 1 / sigma), ...)) of each leaf

    def path(self, node: int) -> list[tuple[int, bool]]:
        """The splits above a node from the root down, each as (split, whether the node lies on its left)."""
        path = []
        while self.nodes[node].parent >= 0:
            parent = self.nodes[node].parent
            path.append((parent, self.nodes[parent].left == node))
            node = parent
        return path[::-1]

    def leaves(self) -> list[int]:
        """The leaves from left to right in the tree."""
        leaves, waiting = [], [0]
        while waiting:
            node = waiting.pop()
            if self.nodes[node].is_leaf:
                leaves.append(node)
            else:
                waiting += [self.nodes[node].right, self.nodes[node].left]
        return leaves


@dataclass(frozen=True)
class Model:
    inputs: tuple[Input, ...]
    outputs: tuple[str, ...]  # names
    regressors: tuple[Regressor, ...]
    partitions: tuple[Partition, ...]


def _inverse(value: float) -> float:
    try:
        inverse = 1.0 / value
    except ZeroDivisionError:
        return 0.0
    return inverse if math.isfinite(inverse) else 0.0


def _floats(values: Iterable[Any]) -> Floats:
    return tuple(float(value) for value in values)


def _node(data: dict[str, Any], parent: int, inputs: tuple[Input, ...]) -> Node:
    split = data.get("split")
    fields: dict[str, Any] = dict(
        left=-1, right=-1, input=-1, threshold=0.0, half_width=0.0, direction=(), shares=(), missing_left=0.5
    )
    if split is not None:
        missing = float(split["missing_left"])
        share = {-1: 1.0, 0: missing, 1: 0.0}
        fields = dict(
            left=split["left"],
            right=split["right"],
            input=split["column"],
            threshold=float(split.get("threshold", 0.0)),
            half_width=float(split.get("half_width", 0.0)),
            direction=tuple(
                (j, float(weight), inputs[j].centre) for j, weight in enumerate(split.get("direction", [])) if weight
            ),
            shares=tuple(share[side] for side in split.get("level_side", [])),
            missing_left=missing,
        )
    return Node(
        parent=parent,
        per_half_width=_inverse(fields["half_width"]),
        value=_floats(data["value"]),
        slope=tuple(_floats(row) for row in data["slope"]),
        mean=_floats(data["mean"]),
        low=_floats(data["low"]),
        high=_floats(data["high"]),
        **fields,
    )


def _gaussians(nodes: tuple[Node, ...], width: float, inputs: tuple[Input, ...]) -> Any:
    """Middles and reciprocal widths of the leaves' boxes in the inputs that splits use (V.5)."""
    low = [[column.low for column in inputs]]
    high = [[column.high for column in inputs]]
    low += [[]] * (len(nodes) - 1)
    high += [[]] * (len(nodes) - 1)
    used: set[int] = set()
    for i, node in enumerate(nodes):
        if node.is_leaf:
            continue
        for child in (node.left, node.right):
            low[child], high[child] = list(low[i]), list(high[i])
        if node.shares or node.is_presence:
            continue
        j = node.input
        used.add(j)
        if not node.direction:
            high[node.left][j] = min(high[i][j], node.threshold)
            low[node.right][j] = max(low[i][j], node.threshold)
    return tuple(
        (
            i,
            tuple(
                (j, 0.5 * (low[i][j] + high[i][j]), _inverse(width * (high[i][j] - low[i][j]))) for j in sorted(used)
            ),
        )
        for i, node in enumerate(nodes)
        if node.is_leaf
    )


def _partition(data: dict[str, Any], inputs: tuple[Input, ...]) -> Partition:
    parents = [-1] * len(data["nodes"])
    for i, node in enumerate(data["nodes"]):
        if "split" in node:
            parents[node["split"]["left"]] = parents[node["split"]["right"]] = i
    nodes = tuple(_node(node, parents[i], inputs) for i, node in enumerate(data["nodes"]))
    residual_range = []
    for low, high in data.get("residual_range", []):
        margin = 0.1 * (high - low)
        residual_range.append((low - margin, high + margin))
    output_range = tuple(_floats(pair) if pair else None for pair in data.get("output_range", []))
    kind = data["validity"]["kind"]
    return Partition(
        outputs=tuple(int(output) for output in data["outputs"]),
        kind=kind,
        nodes=nodes,
        outer=tuple(_floats(row) for row in data.get("outer_slope", [])) or nodes[0].slope,
        residual_range=tuple(residual_range),
        output_range=output_range if any(output_range) else (),
        gaussians=_gaussians(nodes, float(data["validity"]["width"]), inputs) if kind == "gaussian" else (),
    )


def read(model: dict[str, Any]) -> Model:
    """The values of a model file.

    `model` is what `json.loads` makes of the file's text. Raises ValueError if it is not such a model.
    """
    if not isinstance(model, dict) or model.get("format") != "llmt-model":
        raise ValueError('the model is not the content of a model file: its member "format" is not "llmt-model"')
    if model.get("version") not in (2, 3, 4, 5):
        raise ValueError(f"the model file has the format version {model.get('version')!r}; versions 2 to 5 can be read")
    inputs = tuple(
        Input(
            column["name"],
            float(column["low"]),
            float(column["high"]),
            float(column["centre"]),
            tuple(column.get("levels", [])),
            _floats(column.get("codes", [])),
            "empty_level" in column or column.get("levels", [" "])[-1] == "",
        )
        for column in model["inputs"]
    )
    regressors = tuple(
        Regressor(entry["column"], entry.get("level", -1), entry.get("second_column", -1), float(entry["centre"]))
        for entry in model["regressors"]
    )
    return Model(
        inputs,
        tuple(column["name"] for column in model["outputs"]),
        regressors,
        tuple(_partition(partition, inputs) for partition in model["partitions"]),
    )
