"""A model as an expression of sympy, or as the text of one."""

from collections.abc import Mapping
from typing import Any

from .equations import equation
from .model import Model, Node, Partition, read
from .needed import needed


def number(value: float) -> str:
    """Digits that read back the number, without the last one where that is rounding."""
    short = f"{value:.15g}"
    text = short if float(short) == value or _digits(short) < 14 else repr(value)
    return f"({text})" if text.startswith("-") else text


def _digits(text: str) -> int:
    return len(text.split("e")[0].replace(".", "").replace("-", "").strip("0"))


class _Writer:
    """Texts of expressions; `names` are those of the inputs' symbols, (input, level) those of the indicators."""

    def __init__(self, model: Model, names: Mapping[Any, str]) -> None:
        self.model, self.names = model, names

    def is_level(self, j: int, levels: list[int]) -> str:
        """Condition that a category has one of the levels."""
        column = self.model.inputs[j]
        if column.codes:
            same = [f"Eq({self.names[j]}, {number(column.codes[level])})" for level in levels]
        else:
            same = [f"({self.names[j, level]} > 0.5)" for level in levels]
        return "Or(" + ", ".join(same) + ")" if len(same) != 1 else same[0]

    def regressor(self, k: int) -> str:
        r = self.model.regressors[k]
        if r.second >= 0:
            first, second = self.factor(r.input), self.factor(r.second)
            return f"{first}**2" if r.input == r.second else f"{first}*{second}"
        if r.level < 0:
            return self.names[r.input]
        if self.model.inputs[r.input].codes:
            return f"Piecewise((1, {self.is_level(r.input, [r.level])}), (0, True))"
        return self.names[r.input, r.level]

    def factor(self, j: int) -> str:
        return self.minus(j, self.model.inputs[j].centre)

    def local_model(self, node: Node, o: int) -> str:
        constant, slopes = equation(self.model, node, o)
        text = number(constant).strip("()") if constant != 0.0 or not slopes else ""
        for t in slopes:
            sign = " - " if t.slope < 0.0 else " + "
            size = "" if abs(t.slope) == 1.0 else f"{number(abs(t.slope))}*"
            text += (sign if text else sign.strip(" +")) + size + self.regressor(t.regressor)
        return text

    def compared(self, node: Node) -> str:
        if not node.direction:
            return self.names[node.input]
        return "(" + " + ".join(f"{number(w)}*{self.minus(j, c)}" for j, w, c in node.direction) + ")"

    def minus(self, j: int, centre: float) -> str:
        return self.names[j] if centre == 0.0 else f"({self.names[j]} - {number(centre)})"

    def below(self, partition: Partition, i: int, o: int) -> str:
        """What the tree says from node i on."""
        node = partition.nodes[i]
        if node.is_leaf:
            return self.local_model(node, o)
        left, right = self.below(partition, node.left, o), self.below(partition, node.right, o)
        if node.is_presence:
            return left
        if node.shares:
            levels = [i for i, share in enumerate(node.shares) if share == 1.0]
            return f"Piecewise(({left}, {self.is_level(node.input, levels)}), ({right}, True))"
        s = self.compared(node)
        if node.per_half_width == 0.0:
            return f"Piecewise(({left}, {s} <= {number(node.threshold)}), ({right}, True))"
        if partition.kind == "logistic":
            u = f"({s} - {number(node.threshold)})/{number(node.half_width)}"
            return f"({left})/(1 + exp({u})) + ({right})/(1 + exp(-{u}))"
        begin, width = number(node.threshold - node.half_width), number(2.0 * node.half_width)
        v = f"Min(1, Max(0, ({s} - {begin})/{width}))"
        return f"({left})*(1 - {v}**2*(3 - 2*{v})) + ({right})*{v}**2*(3 - 2*{v})"

    def gaussians(self, partition: Partition, o: int) -> str:
        if len(partition.nodes) == 1:
            return self.local_model(partition.nodes[0], o)
        weights = []
        for _, of_inputs in partition.gaussians:
            squares = [f"({number(s)}*{self.minus(j, c)})**2" for j, c, s in of_inputs if s != 0.0]
            weights.append("exp(-0.5*(" + " + ".join(squares or ["0"]) + "))")
        models = [self.local_model(partition.nodes[i], o) for i, _ in partition.gaussians]
        total = " + ".join(f"{weight}*({model})" for weight, model in zip(weights, models))
        return f"({total})/({' + '.join(weights)})"

    def outputs(self) -> list[str]:
        texts = [""] * len(self.model.outputs)
        for partition in self.model.partitions:
            for o, column in enumerate(partition.outputs):
                is_gaussian = partition.kind == "gaussian"
                text = self.gaussians(partition, o) if is_gaussian else self.below(partition, 0, o)
                if ends := partition.output_range and partition.output_range[o]:
                    low, high = ends
                    text = f"Min({number(high)}, Max({number(low)}, {text}))"
                texts[column] = text
        return texts


def texts(model: Model, names: Mapping[Any, str]) -> list[str]:
    """The expressions of a `model.Model`, one for each output, as texts that sympy reads."""
    return _Writer(model, names).outputs()


def to_sympy(model: dict[str, Any]) -> Any:
    """The model as an expression of sympy; of several outputs a list of expressions.

    Crisp splits are a Piecewise, transitions of blends Min and Max, logistic gates and Gaussians exp. Symbols are real
    and have the names of the inputs. A category has a symbol of 0 or 1 for each level, "column=label"; a number that is
    a code is compared with its codes.

    The expression is what `llmt predict` says where a row lies within the ranges of its leaves. The guards beyond them
    and the treatment of missing values are left out (docs/algorithms/guards.md), but for the range of the outputs.

    `model` is what `json.loads` makes of the text of a model file. Raises ImportError without the package sympy.
    """
    sympy = needed("sympy", "to_sympy")
    tree = read(model)
    names: dict[Any, str] = {}
    symbols: dict[str, Any] = {}
    for j, column in enumerate(tree.inputs):
        if column.levels:
            for level, label in enumerate(column.levels):
                names[j, level] = f"llmt_{j}_{level}"
                symbols[names[j, level]] = sympy.Symbol(f"{column.name}={label}", real=True)
        else:
            names[j] = f"llmt_{j}"
            symbols[names[j]] = sympy.Symbol(column.name, real=True)
    expressions = [sympy.parse_expr(text, local_dict=symbols) for text in texts(tree, names)]
    return expressions[0] if len(expressions) == 1 else expressions
