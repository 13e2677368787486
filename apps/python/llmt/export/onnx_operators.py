"""Operators and constants of a graph of ONNX."""

from typing import Any

import numpy as np


class Graph:
    """Operators and constants in the order in which they are added; names are made."""

    def __init__(self, onnx: Any) -> None:
        self.onnx = onnx
        self.nodes: list[Any] = []
        self.constants: list[Any] = []
        self.values: dict[Any, str] = {}

    def constant(self, value: Any) -> str:
        value = np.asarray(value)
        key = (value.dtype.str, value.shape, value.tobytes())
        if key not in self.values:
            self.values[key] = f"llmt/c{len(self.values)}"
            self.constants.append(self.onnx.numpy_helper.from_array(value, self.values[key]))
        return self.values[key]

    def __call__(self, operator: str, *inputs: Any, domain: str = "", output: str = "", **attributes: Any) -> str:
        names = [value if isinstance(value, str) else self.constant(value) for value in inputs]
        output = output or f"llmt/{len(self.nodes)}"
        self.nodes.append(self.onnx.helper.make_node(operator, names, [output], domain=domain, **attributes))
        return output

    def columns(self, x: str, which: Any) -> str:
        return self("Gather", x, np.array(which, dtype=np.int64), axis=1)

    def double(self, x: str) -> str:
        return self("Cast", x, to=self.onnx.TensorProto.DOUBLE)

    def zero_where(self, condition: str, x: str) -> str:
        return self("Where", condition, np.float64(0.0), x)


def smooth_clamp(graph: Graph, x: Any, low: np.ndarray, high: np.ndarray) -> str:
    """The function (B.1) with arrays of ends."""
    r = 0.1 * (high - low)
    per_two_r = np.divide(0.5, r, out=np.zeros_like(r), where=r != 0.0)
    zero = np.float64(0.0)
    near = graph("Min", graph("Max", x, low - r), high + r)
    above = graph("Max", graph("Sub", near, high), zero)
    below = graph("Max", graph("Sub", low, near), zero)
    squares = graph("Sub", graph("Mul", above, above), graph("Mul", below, below))
    # Inside the range r may be 0 where low is high; `near` is then already that number.
    return graph("Sub", near, graph("Mul", squares, per_two_r))
