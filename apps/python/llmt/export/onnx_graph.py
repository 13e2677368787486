"""A model as a graph of ONNX, of standard operators on doubles.

All nodes of a tree are evaluated at once (see `additive`): gates as a matrix rows x splits, validities rows x nodes,
held deviations rows x nodes x regressors.
"""

from typing import Any

import numpy as np

from .additive import terms
from .model import Input, Partition, Regressor, read
from .needed import needed
from .onnx_operators import Graph, smooth_clamp

_OPSET, _ML_OPSET, _IR = 17, 2, 8


class _Inputs:
    """The inputs as a matrix of doubles of the numbers, and for each category a column of positions of its levels, one
    beyond the last where it is missing."""

    def __init__(self, graph: Graph, inputs: tuple[Input, ...]) -> None:
        self.graph, self.inputs = graph, inputs
        onnx = graph.onnx
        info = onnx.helper.make_tensor_value_info
        self.positions: dict[int, str] = {}
        self.numbers = "X"
        if any(column.levels for column in inputs):
            self.infos: list[Any] = []
            numbers = []
            for column in inputs:
                kind = onnx.TensorProto.STRING if column.levels else onnx.TensorProto.DOUBLE
                self.infos.append(info(column.name, kind, [None, 1]))
                if not column.levels:
                    numbers.append(column.name)
            if numbers:
                self.numbers = graph("Concat", *numbers, axis=1)
            self.at = {j: i for i, j in enumerate(j for j, column in enumerate(inputs) if not column.levels)}
        else:
            self.infos = [info("X", onnx.TensorProto.DOUBLE, [None, len(inputs)])]
            self.at = {j: j for j in range(len(inputs))}
        for j, column in enumerate(inputs):
            if column.levels:
                self.positions[j] = self.position_of_label(column)
            elif column.codes:
                self.positions[j] = self.position_of_code(j, column.codes)

    def position_of_label(self, column: Input) -> str:
        graph = self.graph
        index = graph(
            "LabelEncoder",
            column.name,
            domain="ai.onnx.ml",
            keys_strings=list(column.levels),
            values_int64s=list(range(column.count)),
            default_int64=column.count,
        )
        return graph("Reshape", index, np.array([-1], dtype=np.int64))

    def position_of_code(self, j: int, of_input: tuple[float, ...]) -> str:
        graph = self.graph
        x = self.number(j)
        missing = graph("IsNaN", x)
        codes = np.array(of_input)[None, :]
        is_nearer = graph("Less", graph("Sub", codes[:, 1:], x), graph("Sub", x, codes[:, :-1]))
        count = graph("ReduceSum", graph.double(is_nearer), np.array([1], dtype=np.int64))
        index = graph("Where", missing, np.float64(codes.size), count)
        index = graph("Cast", index, to=graph.onnx.TensorProto.INT64)
        return graph("Reshape", index, np.array([-1], dtype=np.int64))

    def number(self, j: int) -> str:
        return self.graph.columns(self.numbers, [self.at[j]])

    def zeros(self) -> str:
        """A column of zeros, as many as there are rows."""
        if self.positions:
            index = self.graph("Unsqueeze", next(iter(self.positions.values())), np.array([1], dtype=np.int64))
            return self.graph("Mul", self.graph.double(index), np.float64(0.0))
        return self.graph("Mul", self.graph.double(self.graph("IsNaN", self.number(0))), np.float64(0.0))

    def of(self, columns: list[int]) -> str:
        """The numbers of several inputs, rows x inputs."""
        return self.graph.columns(self.numbers, [self.at[j] for j in columns])

    def looked_up(self, j: int, table: np.ndarray) -> str:
        """Rows of a table (levels + 1) x columns, the last for a missing value."""
        return self.graph("Gather", np.asarray(table, dtype=np.float64), self.positions[j], axis=0)


def _ordered(graph: Graph, parts: list[tuple[list[int], str]], count: int) -> str:
    """Puts parts, each (positions, matrix), side by side in the order of the positions."""
    matrices = [matrix for _, matrix in parts]
    order = [position for positions, _ in parts for position in positions]
    joined = graph("Concat", *matrices, axis=1) if len(matrices) > 1 else matrices[0]
    if order == list(range(count)):
        return joined
    return graph.columns(joined, np.argsort(order))


def _deviations(graph: Graph, inputs: _Inputs, regressors: tuple[Regressor, ...]) -> str:
    parts: list[tuple[list[int], str]] = []
    numbers = [k for k, r in enumerate(regressors) if r.level < 0 and r.second < 0]
    products = [k for k, r in enumerate(regressors) if r.second >= 0]
    centre = np.array([[r.centre for r in regressors]])
    if numbers:
        x = inputs.of([regressors[k].input for k in numbers])
        parts.append((numbers, graph("Sub", x, centre[:, numbers])))
    if products:
        factors = []
        for which in ("input", "second"):
            columns = [getattr(regressors[k], which) for k in products]
            low, high, middle = (
                np.array([[getattr(inputs.inputs[j], name) for j in columns]]) for name in ("low", "high", "centre")
            )
            x = inputs.of(columns)
            held = smooth_clamp(graph, graph("Sub", x, middle), low - middle, high - middle)
            factors.append(graph("Where", graph("IsNaN", x), x, held))
        parts.append((products, graph("Sub", graph("Mul", *factors), centre[:, products])))
    for j, column in enumerate(inputs.inputs):
        indicators = [k for k, r in enumerate(regressors) if r.level >= 0 and r.input == j]
        if indicators:
            table = np.full((column.count + 1, len(indicators)), np.nan)
            for i, k in enumerate(indicators):
                table[:-1, i] = (np.arange(column.count) == regressors[k].level) - regressors[k].centre
            parts.append((indicators, inputs.looked_up(j, table)))
    return _ordered(graph, parts, len(regressors))


def _gates(graph: Graph, inputs: _Inputs, partition: Partition) -> str:
    """The share of the left child at each split, rows x splits, in the order of the nodes."""
    splits = [node for node in partition.nodes if not node.is_leaf]
    parts: list[tuple[list[int], str]] = []
    for j in range(len(inputs.inputs)):
        here = [i for i, node in enumerate(splits) if node.shares and node.input == j]
        if here:
            table = [[*splits[i].shares, splits[i].missing_left] for i in here]
            parts.append((here, inputs.looked_up(j, np.array(table).T)))
    for is_oblique in (False, True):
        here = [i for i, node in enumerate(splits) if not node.shares and bool(node.direction) == is_oblique]
        if not here:
            continue

        def row(name: str, here: list[int] = here) -> np.ndarray:
            return np.array([[float(getattr(splits[i], name)) for i in here]])

        if is_oblique:
            columns = sorted({j for i in here for j, _, _ in splits[i].direction})
            centre = np.array([[inputs.inputs[j].centre for j in columns]])
            weights = np.zeros((len(columns), len(here)))
            for at, i in enumerate(here):
                for j, weight, _ in splits[i].direction:
                    weights[columns.index(j), at] = weight
            x = graph("Sub", inputs.of(columns), centre)
            s = graph("MatMul", graph.zero_where(graph("IsNaN", x), x), weights)
        else:
            s = inputs.of([splits[i].input for i in here])
        share = graph.double(graph("LessOrEqual", s, row("threshold")))
        jumps = row("per_half_width") == 0.0
        if not jumps.all():
            u = graph("Mul", graph("Sub", s, row("threshold")), row("per_half_width"))
            if partition.kind == "logistic":
                smooth = graph("Sigmoid", graph("Neg", u))
            else:
                held = graph("Clip", u, np.float64(-1.0), np.float64(1.0))
                v = graph("Mul", graph("Add", held, np.float64(1.0)), np.float64(0.5))
                slack = graph("Sub", np.float64(3.0), graph("Mul", v, np.float64(2.0)))
                smooth = graph("Sub", np.float64(1.0), graph("Mul", graph("Mul", v, v), slack))
            share = graph("Where", jumps, share, smooth)
        parts.append((here, graph("Where", graph("IsNaN", s), row("missing_left"), share)))
    return _ordered(graph, parts, len(splits))


def _validities(graph: Graph, inputs: _Inputs, partition: Partition) -> str:
    """The validities of all nodes but the root, rows x nodes - 1."""
    nodes = partition.nodes
    gates = _gates(graph, inputs, partition)
    shares = graph("Concat", gates, graph("Sub", np.float64(1.0), gates), axis=1)
    splits = {i: at for at, i in enumerate(i for i, node in enumerate(nodes) if not node.is_leaf)}
    level = [nodes[0].left, nodes[0].right]
    above: list[int] = []
    validities = ""
    parts: list[tuple[list[int], str]] = []
    while level:
        right = [nodes[nodes[i].parent].right == i for i in level]
        own = graph.columns(
            shares, [splits[nodes[i].parent] + (len(splits) if is_right else 0) for i, is_right in zip(level, right)]
        )
        if above:
            own = graph("Mul", own, graph.columns(validities, [above.index(nodes[i].parent) for i in level]))
        validities, above = own, level
        parts.append(([i - 1 for i in level], validities))
        level = [child for i in level if not nodes[i].is_leaf for child in (nodes[i].left, nodes[i].right)]
    return _ordered(graph, parts, len(nodes) - 1)


def _gaussian_validities(graph: Graph, inputs: _Inputs, partition: Partition) -> str:
    leaves = [i for i, _ in partition.gaussians]
    columns = [j for j, _, _ in partition.gaussians[0][1]]
    centre = np.array([[c for _, c, _ in of_inputs] for _, of_inputs in partition.gaussians])[None]
    per_sigma = np.array([[s for _, _, s in of_inputs] for _, of_inputs in partition.gaussians])[None]
    one, two = np.array([1], dtype=np.int64), np.array([2], dtype=np.int64)
    x = graph("Unsqueeze", inputs.of(columns), one)
    z = graph("Mul", graph("Sub", x, centre), per_sigma)
    z = graph.zero_where(graph("IsNaN", z), z)
    exponent = graph("Mul", graph("ReduceSum", graph("Mul", z, z), two, keepdims=0), np.float64(-0.5))
    exponent = graph("Sub", exponent, graph("ReduceMax", exponent, axes=[1]))
    negligible = graph("Less", exponent, np.float64(-40.0))
    weight = graph.zero_where(negligible, graph("Exp", exponent))
    share = graph("Div", weight, graph("ReduceSum", weight, one))
    below = np.zeros((len(leaves), len(partition.nodes)))
    for at, i in enumerate(leaves):
        below[at, [i] + [a for a, _ in partition.path(i)]] = 1.0
    return graph("MatMul", share, below[:, 1:])


def _predictions(graph: Graph, inputs: _Inputs, d: str, partition: Partition) -> str:
    """Rows x outputs of the partition."""
    nodes, outputs = partition.nodes, len(partition.outputs)
    of_outputs = [terms(partition, o) for o in range(outputs)]
    value = np.array([[of_node.value for of_node in of_output] for of_output in of_outputs]).T
    if not d:
        root = graph("Add", inputs.zeros(), value[:1])
    else:
        low, high = np.array([node.low for node in nodes]), np.array([node.high for node in nodes])
        slope = np.array([[of_node.slope for of_node in of_output] for of_output in of_outputs]).transpose(1, 2, 0)
        means = np.array([[of_node.missing for of_node in of_output] for of_output in of_outputs]).transpose(1, 2, 0)
        missing = graph("IsNaN", d)
        held = graph.zero_where(missing, smooth_clamp(graph, d, low[:1], high[:1]))
        is_missing = graph.double(missing)
        root = graph("Add", graph("MatMul", held, slope[0]), graph("MatMul", is_missing, means[0]))
        root = graph("Add", root, value[:1])
        beyond = graph("Sub", graph.zero_where(missing, d), held)
        outer = graph("MatMul", beyond, np.array(partition.outer).T)
    if len(nodes) > 1:
        make = _gaussian_validities if partition.kind == "gaussian" else _validities
        validities = make(graph, inputs, partition)
        result = graph("MatMul", validities, value[1:])
        if d:
            one, two = np.array([1], dtype=np.int64), np.array([2], dtype=np.int64)
            spread = graph("Unsqueeze", validities, two)
            absent = graph("Unsqueeze", missing, one)
            all_held = smooth_clamp(graph, graph("Unsqueeze", d, one), low[None, 1:], high[None, 1:])
            flat = np.array([-1, (len(nodes) - 1) * low.shape[1]], dtype=np.int64)
            for part, weights in (
                (graph("Mul", graph.zero_where(absent, all_held), spread), slope[1:]),
                (graph("Mul", graph("Unsqueeze", is_missing, one), spread), means[1:]),
            ):
                part = graph("MatMul", graph("Reshape", part, flat), weights.reshape(-1, outputs))
                result = graph("Add", result, part)
        if partition.residual_range:
            ends = np.array(partition.residual_range).T
            result = smooth_clamp(graph, result, ends[:1], ends[1:])
        result = graph("Add", root, result)
    elif partition.residual_range:  # one leaf: the root's model plus what 0 is held to
        ends = np.array(partition.residual_range).T
        result = graph("Add", root, smooth_clamp(graph, np.zeros((1, outputs)), ends[:1], ends[1:]))
    else:
        result = root
    if d:
        result = graph("Add", result, outer)
    if partition.output_range:
        limits = np.array([pair or (-np.inf, np.inf) for pair in partition.output_range])
        low, high = limits.T[:, None]
        result = graph("Min", graph("Max", result, low), high)
    return result


def to_onnx(model: dict[str, Any]) -> Any:
    """The model as an `onnx.ModelProto` of standard operators (opset 17, ai.onnx.ml 2), all numbers doubles.

    It says what `llmt predict` says, guards and missing values (NaN) included, but for the rounding of sums. If all
    inputs are numbers it has one input `X`, rows x inputs in the order of the model. If some are categories it has one
    input of shape rows x 1 for each column, under its name: strings for a category, doubles for a number. A label that
    was not in training, such as "", is a missing value. The output `variable` is rows x outputs (`variable_` if an
    input has that name). An infinite value, which `llmt predict` refuses, is taken. Running it needs memory for rows x
    nodes x regressors doubles; run large tables in parts.

    `model` is what `json.loads` makes of the text of a model file. Raises ImportError without the package onnx, and
    ValueError for trees of more than 65 levels.
    """
    onnx = needed("onnx", "to_onnx")
    tree = read(model)
    graph = Graph(onnx)
    inputs = _Inputs(graph, tree.inputs)
    d = _deviations(graph, inputs, tree.regressors) if tree.regressors else ""
    parts = [(list(partition.outputs), _predictions(graph, inputs, d, partition)) for partition in tree.partitions]
    result = _ordered(graph, parts, len(tree.outputs))
    output = "variable"
    while any(column.name == output for column in tree.inputs):
        output += "_"
    graph("Identity", result, output=output)
    info = onnx.helper.make_tensor_value_info
    made = onnx.helper.make_graph(
        graph.nodes,
        "llmt",
        inputs.infos,
        [info(output, onnx.TensorProto.DOUBLE, [None, len(tree.outputs)])],
        graph.constants,
    )
    proto = onnx.helper.make_model(
        made,
        opset_imports=[onnx.helper.make_opsetid("", _OPSET), onnx.helper.make_opsetid("ai.onnx.ml", _ML_OPSET)],
        producer_name="llmt",
    )
    proto.ir_version = _IR
    onnx.checker.check_model(proto)
    return proto
