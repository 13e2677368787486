"""The rules of a model as LaTeX."""

import math
from typing import Any

from .equations import equation
from .model import Model, Node, Partition, read

_ESCAPES = {
    "\\": r"\backslash{}",
    "{": r"\{",
    "}": r"\}",
    "_": r"\_",
    "^": r"\hat{}",
    "#": r"\#",
    "%": r"\%",
    "&": r"\&",
    "$": r"\$",
    "~": r"\sim{}",
}


def _text(words: str) -> str:
    """Words in formulas, as \\text; backslash, ^ and ~ are mathematics, for \\text has no letters for them."""
    pieces: list[str] = []
    plain = ""
    for letter in words:
        if letter in "\\^~":
            pieces += [plain, f"}}{_ESCAPES[letter]}\\text{{"]
            plain = ""
        else:
            plain += _ESCAPES.get(letter, " " if letter in "\r\n\t" else letter)
    return "\\text{" + "".join(pieces) + plain + "}"


def _name(words: str) -> str:
    return words if len(words) == 1 and words.isascii() and words.isalpha() else _text(words)


def _number(value: float, digits: int) -> str:
    mantissa, _, exponent = f"{value:.{digits}g}".partition("e")
    return f"{mantissa} \\times 10^{{{int(exponent)}}}" if exponent else mantissa


class _Writer:
    def __init__(self, model: Model, digits: int) -> None:
        self.model, self.digits = model, digits

    def number(self, value: float) -> str:
        return _number(value, self.digits)

    def deviation(self, j: int, centre: float) -> str:
        name = _name(self.model.inputs[j].name)
        if float(f"{centre:.{self.digits}g}") == 0.0:
            return name
        sign = "-" if centre > 0.0 else "+"
        return f"({name} {sign} {self.number(abs(centre))})"

    def level(self, j: int, level: int) -> str:
        column = self.model.inputs[j]
        return self.number(column.codes[level]) if column.codes else _text(column.levels[level])

    def regressor(self, k: int) -> str:
        r = self.model.regressors[k]
        if r.second >= 0:
            first = self.deviation(r.input, self.model.inputs[r.input].centre)
            second = self.deviation(r.second, self.model.inputs[r.second].centre)
            return f"{first}^2" if r.input == r.second else f"{first} \\, {second}"
        name = _name(self.model.inputs[r.input].name)
        return f"[{name} = {self.level(r.input, r.level)}]" if r.level >= 0 else name

    def equation(self, node: Node, o: int) -> str:
        constant, slopes = equation(self.model, node, o)
        text = self.number(constant) if constant != 0.0 or not slopes else ""
        for t in slopes:
            sign = "-" if t.slope < 0.0 else "+" if text else ""
            text += f" {sign} {self.number(abs(t.slope))} \\, {self.regressor(t.regressor)}"
        return text.strip()

    def oblique(self, node: Node) -> str:
        text = ""
        for j, weight, centre in node.direction:
            sign = "-" if weight < 0.0 else "+" if text else ""
            text += f" {sign} {self.number(abs(weight))} \\, {self.deviation(j, centre)}"
        return text.strip()

    def conditions(self, partition: Partition, leaf: int) -> str:
        """Where a leaf holds: an interval or a set for each input, and sides of oblique splits."""
        low: dict[int, float] = {}
        high: dict[int, float] = {}
        levels: dict[int, set[int]] = {}
        others: list[str] = []
        for a, is_left in partition.path(leaf):
            node = partition.nodes[a]
            j = node.input
            name = _name(self.model.inputs[j].name)
            if node.shares:
                side = {i for i, share in enumerate(node.shares) if share == (1.0 if is_left else 0.0)}
                levels[j] = levels.get(j, side) & side
            elif node.is_presence:
                others.append(f"{name} \\text{{ is {'present' if is_left else 'missing'}}}")
            elif node.direction:
                relation = "\\le" if is_left else ">"
                others.append(f"{self.oblique(node)} {relation} {self.number(node.threshold)}")
            elif is_left:
                high[j] = min(high.get(j, math.inf), node.threshold)
            else:
                low[j] = max(low.get(j, -math.inf), node.threshold)
        parts = []
        for j, column in enumerate(self.model.inputs):
            name = _name(column.name)
            if j in low and j in high:
                parts.append(f"{self.number(low[j])} < {name} \\le {self.number(high[j])}")
            elif j in high:
                parts.append(f"{name} \\le {self.number(high[j])}")
            elif j in low:
                parts.append(f"{name} > {self.number(low[j])}")
            if j in levels:
                of_set = ", ".join(self.level(j, level) for level in sorted(levels[j]))
                parts.append(f"{name} \\in \\{{{of_set}\\}}")
        return ",\\ ".join(parts + others)

    def output(self, partition: Partition, o: int, name: str) -> str:
        """name = cases; one leaf is one equation."""
        leaves = partition.leaves()
        name = _name(name)
        if len(leaves) == 1:
            return f"{name} = {self.equation(partition.nodes[leaves[0]], o)}"
        rows = [
            f"{self.equation(partition.nodes[leaf], o)} & \\text{{if }} {self.conditions(partition, leaf)}"
            for leaf in leaves
        ]
        text = f"{name} = \\begin{{cases}}\n" + " \\\\\n".join(rows) + "\n\\end{cases}"
        notes = {
            "blend": "neighbouring rules hand over smoothly around their thresholds",
            "gaussian": "neighbouring rules are averaged by Gaussian weights",
            "logistic": "neighbouring rules hand over by logistic gates",
        }
        if partition.kind in notes:
            text += f" \\quad \\text{{({notes[partition.kind]})}}"
        return text


def to_latex(model: dict[str, Any], digits: int = 6) -> str:
    """The rules and equations of the model as LaTeX, one `cases` for each output, for `amsmath`, KaTeX or MathJax.

    Numbers have at most `digits` significant digits, so the text is for reading; a readable model has no more digits
    than that. An indicator is written [column = label]. Of models that are not crisp the equations of the leaves are
    written, and in words how they are joined; for the exact formula see `to_sympy`. The equations are what the model
    says within the ranges of its leaves. The guards beyond them, the range of the outputs and the treatment of missing
    values are left out (docs/algorithms/guards.md).

    `model` is what `json.loads` makes of the text of a model file. Raises ValueError if it is not, or if `digits` is
    not 1 ... 17.
    """
    if digits not in range(1, 18):
        raise ValueError(f"digits is {digits!r}, it must be a whole number from 1 to 17")
    tree = read(model)
    writer = _Writer(tree, digits)
    formulas = [""] * len(tree.outputs)
    for partition in tree.partitions:
        for o, column in enumerate(partition.outputs):
            formulas[column] = writer.output(partition, o, tree.outputs[column])
    return "\n\n".join(formulas)
