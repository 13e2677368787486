"""A model as the source text of a Python function that needs nothing but the module `math`."""

import ast
import builtins
import keyword
import re
import unicodedata
from collections.abc import Iterable
from typing import Any

from .model import BLANKS, MOST_ANCESTORS, Input, Node, Partition, read

_RUNTIME = '''
def @_hold(x, low, high):
    """x within low ... high; a parabola and then a constant beyond."""
    rounding = 0.1 * (high - low)
    if x > high:
        beyond = x - high
        return high + 0.5 * rounding if beyond >= rounding else x - 0.5 * beyond * beyond / rounding
    if x < low:
        beyond = low - x
        return low - 0.5 * rounding if beyond >= rounding else x + 0.5 * beyond * beyond / rounding
    return x


def @_numbers(row):
    """The row as numbers: categories as positions, missing values as NaN."""
    if hasattr(row, "keys"):
        row = [row[column[0]] for column in @_INPUTS]
    elif len(row) != len(@_INPUTS):
        raise ValueError("the row has %d values, the model has %d inputs" % (len(row), len(@_INPUTS)))
    x = []
    for value, (name, _, _, _, levels, codes, empty) in zip(row, @_INPUTS):
        if value is None or value != value:
            x.append(math.nan if empty is None else float(empty))
        elif levels:
            x.append(float(levels.get(value.strip(BLANKS) if isinstance(value, str) else value, math.nan)))
        else:
            value = float(value)
            if math.isinf(value):
                raise ValueError("the value of %r is infinite" % name)
            if codes:
                above = 0
                while above < len(codes) and codes[above] < value:
                    above += 1
                if above == len(codes) or (above > 0 and not codes[above] - value < value - codes[above - 1]):
                    above -= 1
                value = float(above)
            x.append(value)
    return x


def @_factor(x, column):
    _, low, high, centre, _, _, _ = column
    return @_hold(x - centre, low - centre, high - centre)


def @_deviations(x):
    d = []
    for column, level, second, centre in @_REGRESSORS:
        value = x[column]
        if second >= 0:
            d.append(@_factor(value, @_INPUTS[column]) * @_factor(x[second], @_INPUTS[second]) - centre)
        elif level < 0 or value != value:
            d.append(value - centre)
        else:
            d.append((1.0 if value == level else 0.0) - centre)
    return d


def @_logistic(u):
    """1 / (1 + exp(u)) by the sums and products of the library, to have its bits."""
    if u <= -37.0 or u >= 37.0:
        return 1.0 if u < 0.0 else 0.0
    shift = 6755399441055744.0
    k = (u * 1.4426950408889634 + shift) - shift
    r = (u - k * 6.93147180369123816490e-01) - k * 1.90821492927058770002e-10
    total = 1.0 / 6227020800.0
    for factorial in (479001600.0, 39916800.0, 3628800.0, 362880.0, 40320.0, 5040.0, 720.0, 120.0, 24.0, 6.0, 2.0, 1.0):
        total = total * r + 1.0 / factorial
    total = total * r + 1.0
    return 1.0 / (1.0 + total * math.ldexp(1.0, int(k)))


def @_left_share(branch, x, is_logistic):
    _, _, column, threshold, per_half_width, direction, shares, missing_left = branch
    if direction:
        s = 0.0
        for j, weight, centre in direction:
            s += weight * (x[j] - centre) if x[j] == x[j] else 0.0
    else:
        s = x[column]
    if s != s:
        return missing_left
    if shares:
        return shares[int(s)]
    if per_half_width == 0.0:
        return 1.0 if s <= threshold else 0.0
    u = (s - threshold) * per_half_width
    if is_logistic:
        return @_logistic(u)
    v = 0.5 * ((-1.0 if u < -1.0 else 1.0 if u > 1.0 else u) + 1.0)
    share = 1.0 - v * v * (3.0 - 2.0 * v)
    return 0.0 if share < 0.0 else 1.0 if share > 1.0 else share


def @_sum(s):
    return (s[0] + s[2]) + (s[1] + s[3])


def @_local_model(nodes, node, output, d):
    """The local model of a node: its slopes within its range, beyond it those of its ancestors."""
    s = [0.0, 0.0, 0.0, 0.0]
    _, value, slope, mean, low, high = nodes[node]
    for k, dk in enumerate(d):
        held = mean[k] if dk != dk else @_hold(dk, low[k], high[k])
        s[k % 4] += slope[output][k] * held
        at = nodes[node][0]
        left = MOST_ANCESTORS
        while dk == dk and held != dk and at >= 0:
            if at > 0:
                left -= 1
                if left < 0:
                    at = 0
            parent, _, slopes, _, lows, highs = nodes[at]
            reached = @_hold(dk, lows[k], highs[k])
            s[k % 4] += slopes[output][k] * (reached - held)
            held = reached
            at = parent
    return value[output] + @_sum(s)


def @_leaves(tree, x):
    """The leaves that reach the row, from left to right, with their validities."""
    active = []
    waiting = [(0, 1.0)]
    while waiting:
        node, validity = waiting.pop()
        while tree["branches"][node]:
            branch = tree["branches"][node]
            left = @_left_share(branch, x, tree["kind"] == "logistic")
            node = branch[1] if left <= 0.0 else branch[0]
            if 0.0 < left < 1.0:
                waiting.append((branch[1], validity * (1.0 - left)))
                validity *= left
        active.append((node, validity))
    return active


def @_gaussians(tree, x):
    exponents = []
    for _, terms in tree["gaussians"]:
        s = [0.0, 0.0, 0.0, 0.0]
        for j, centre, per_sigma in terms:
            z = 0.0 if x[j] != x[j] else (x[j] - centre) * per_sigma
            s[j % 4] += z * z
        exponents.append(-0.5 * @_sum(s))
    largest = max(exponents)
    weights = [math.exp(e - largest) if e - largest >= -40.0 else 0.0 for e in exponents]
    total = 0.0
    for weight in weights:
        total += weight
    return [(node, weight / total) for (node, _), weight in zip(tree["gaussians"], weights) if weight > 0.0]


def NAME(row):
    """RETURNS for one row.

    `row` is a mapping from the names of the inputs to their values, or a sequence of the values in the order
    INPUTS.
    A category is given by its label, or by the number that its label is the text of. None and NaN are missing values.
    A label that was not in training belongs to all leaves that its category would tell apart. Raises ValueError if a value is infinite.
    """
    x = @_numbers(row)
    d = @_deviations(x)
    y = [0.0] * OUTPUTS
    for tree in @_TREES:
        nodes = tree["nodes"]
        active = @_gaussians(tree, x) if tree["kind"] == "gaussian" else @_leaves(tree, x)
        for o, column in enumerate(tree["outputs"]):
            value = 0.0
            for node, validity in active:
                value += validity * @_local_model(nodes, node, o, d)
            if tree["residual_range"]:
                root = @_local_model(nodes, 0, o, d)
                value = root + @_hold(value - root, *tree["residual_range"][o])
            s = [0.0, 0.0, 0.0, 0.0]
            for k, dk in enumerate(d):
                beyond = 0.0 if dk != dk else dk - @_hold(dk, nodes[0][4][k], nodes[0][5][k])
                s[k % 4] += tree["outer"][o][k] * beyond
            value += @_sum(s)
            if tree["output_range"] and tree["output_range"][o]:
                low, high = tree["output_range"][o]
                value = low if value < low else high if high < value else value
            y[column] = value
    return RESULT
'''


# What a function of this name would hide from the others.
_USED = {"math"} | {
    node.id
    for node in ast.walk(ast.parse(_RUNTIME.replace("@", "")))
    if isinstance(node, ast.Name) and hasattr(builtins, node.id)
}


def _check_name(name: str) -> None:
    if not name.isidentifier():
        raise ValueError(f"name is {name!r}, it must be an identifier of Python")
    meant = unicodedata.normalize("NFKC", name)  # as Python reads identifiers
    if keyword.iskeyword(meant) or meant in _USED or (meant.startswith("__") and meant.endswith("__")):
        raise ValueError(f"name is {name!r}, which means something else in Python source; take another one")


def _table(name: str, entries: Iterable[Any]) -> str:
    return f"{name} = (\n" + "".join(f"    {entry!r},\n" for entry in entries) + ")\n"


def _branch(node: Node) -> tuple[Any, ...]:
    if node.is_leaf:
        return ()
    return (
        node.left,
        node.right,
        node.input,
        node.threshold,
        node.per_half_width,
        node.direction,
        node.shares,
        node.missing_left,
    )


def _tree(partition: Partition) -> str:
    text = "    {\n"
    text += f'        "kind": {partition.kind!r},\n'
    text += f'        "outputs": {partition.outputs!r},\n'
    text += "        # left, right, input, threshold, 1 / half width, direction, shares of levels, missing left\n"
    text += '        "branches": (\n' + "".join(f"            {_branch(node)!r},\n" for node in partition.nodes)
    text += "        ),\n"
    text += "        # parent, then of the local model: values, slopes, means, low and high ends of the range\n"
    text += '        "nodes": (\n'
    for node in partition.nodes:
        text += f"            {(node.parent, node.value, node.slope, node.mean, node.low, node.high)!r},\n"
    text += "        ),\n"
    for name in ("outer", "residual_range", "output_range", "gaussians"):
        text += f'        "{name}": {getattr(partition, name)!r},\n'
    return text + "    },\n"


def _order(inputs: tuple[Input, ...]) -> str:
    """The names of the inputs, in lines that are not too long, as part of a docstring."""
    lines = [""]
    for column in inputs:
        word = ascii(column.name).replace("\\", "\\\\").replace('"', '\\"')
        if lines[-1] and len(lines[-1]) + len(word) > 100:
            lines.append("")
        lines[-1] += (", " if lines[-1] else "") + word
    return ",\n    ".join(lines)


def to_python(model: dict[str, Any], name: str = "predict") -> str:
    """The source text of a Python module with the function `name(row)`, which needs no package.

    The function returns what `llmt predict` says of one row, to the last bit (with Gaussian validities: as far as
    `exp` of the C library is the same). All guards, categories, missing values and validities are in it.

    `model` is what `json.loads` makes of the text of a model file. `name` is the name of the function, and the
    beginning of all other names of the text. Raises ValueError if `model` is not such a model, if `name` is no
    identifier, and if it is a word of Python or a name that the text uses (`math`, `len`).

    >>> source = to_python(json.loads(text), "strength")  # doctest: +SKIP
    >>> exec(source)  # doctest: +SKIP
    """
    _check_name(name)
    tree = read(model)
    prefix = f"_{name}"
    columns = [
        (
            *(c.name, c.low, c.high, c.centre),
            {label: i for i, label in enumerate(c.levels)} | c.numbers,
            *(c.codes, c.empty_level),
        )
        for c in tree.inputs
    ]
    single = len(tree.outputs) == 1
    returns = f"The prediction of {tree.outputs[0]!a}"
    if not single:
        returns = f"The predictions of {list(tree.outputs)!a}, a list,"
    returns = returns.replace("\\", "\\\\").replace('"', '\\"')
    words = {
        "@": prefix,
        "BLANKS": repr(BLANKS),
        "INPUTS": _order(tree.inputs),
        "MOST_ANCESTORS": str(MOST_ANCESTORS),
        "NAME": name,
        "OUTPUTS": str(len(tree.outputs)),
        "RESULT": "y[0]" if single else "y",
        "RETURNS": returns,
    }
    runtime = re.sub(r"@|\b[A-Z_]+\b", lambda word: words.get(word[0], word[0]), _RUNTIME)
    return (
        "# Local linear model tree, written by llmt.\nimport math\n\n# name, low, high, centre, levels, codes, level of a missing value\n"
        + _table(f"{prefix}_INPUTS", columns)
        + "# input, level, second input of a product, centre\n"
        + _table(f"{prefix}_REGRESSORS", [(r.input, r.level, r.second, r.centre) for r in tree.regressors])
        + f"{prefix}_TREES = (\n"
        + "".join(_tree(partition) for partition in tree.partitions)
        + ")\n\n"
        + runtime
    )
