"""What people read: expressions of sympy and of SRBench, and LaTeX, against `llmt predict`."""

import json
import pathlib
import re
import sys

import numpy as np
import pytest
from fitted_models import assert_same, constants, every_model, fitted, function_of  # noqa: F401

from llmt.export import to_latex, to_sympy

sys.path.insert(0, str(pathlib.Path(__file__).resolve().parents[2] / "bench/python"))
import srbench  # noqa: E402

# sympy


def symbol_values(model, row):
    """The values of all symbols of to_sympy() for a row."""
    values = {}
    for column, value in zip(model["inputs"], row):
        if "levels" in column:
            values.update({f"{column['name']}={label}": float(value == label) for label in column["levels"]})
        else:
            values[column["name"]] = value
    return values


def within_the_ranges(space, row):
    """Whether no guard acts on a row but the range of the outputs: by the parts of the Python export."""
    x = space["_predict_numbers"](row)
    d = space["_predict_deviations"](x)
    for tree in space["_predict_TREES"]:
        active = space["_predict_gaussians" if tree["kind"] == "gaussian" else "_predict_leaves"](tree, x)
        for node in [0] + [node for node, _ in active]:
            _, _, _, _, low, high = tree["nodes"][node]
            if not all(a <= dk <= b for a, dk, b in zip(low, d, high)):
                return False
        for o, (low, high) in enumerate(tree["residual_range"]):
            value = sum(v * space["_predict_local_model"](tree["nodes"], node, o, d) for node, v in active)
            if not low <= value - space["_predict_local_model"](tree["nodes"], 0, o, d) <= high:
                return False
    return True


@every_model
def test_sympy_evaluates_to_the_prediction(fitted, name):
    sympy = pytest.importorskip("sympy")
    model = fitted(name)
    _, space = function_of(model.model)
    inside = [
        i
        for i in model.of("training", "threshold")
        if None not in model.rows[i] and within_the_ranges(space, model.rows[i])
    ]
    assert len(inside) >= 20
    expressions = to_sympy(model.model)
    expressions = expressions if isinstance(expressions, list) else [expressions]
    names = list(symbol_values(model.model, model.rows[0]))
    symbols = [sympy.Symbol(symbol, real=True) for symbol in names]
    for o, expression in enumerate(expressions):
        assert expression.free_symbols <= set(symbols)
        function = sympy.lambdify(symbols, expression, "math")
        got = [float(function(*symbol_values(model.model, model.rows[i]).values())) for i in inside]
        assert_same(np.array(got), model.predicted[inside, o], 1e-11)


def test_sympy_substitutes(fitted):
    sympy = pytest.importorskip("sympy")
    model = fitted("readable_words")
    expression = to_sympy(model.model)
    for i in model.of("training")[:5]:
        values = {sympy.Symbol(k, real=True): v for k, v in symbol_values(model.model, model.rows[i]).items()}
        assert float(expression.subs(values)) == pytest.approx(model.predicted[i, 0], rel=1e-12)


# LaTeX


def from_latex(text, names):
    """The rules of a `cases` as (value, condition), Python expressions in v[0], v[1], ...: a reader of its own."""
    words = {rf"\text{{{name}}}": f"v[{j}]" for j, name in names.items()}
    words.update({r"\,": "*", r"\ ": " ", r"\le": "<=", r"\text{if }": "", "^2": "**2"})
    text = re.sub(r" \\times 10\^\{(-?\d+)\}", r"e\1", text)
    for word in sorted(words, key=len, reverse=True):
        text = text.replace(word, words[word])
    text = re.sub(r"(?<![\w\[])a(?![\w])", "v[0]", text)
    body = re.fullmatch(r".*? = \\begin{cases}\n(.*)\n\\end{cases}", text, re.S).group(1)
    for line in body.split(" \\\\\n"):
        value, condition = line.split(" & ")
        yield value, " and ".join(condition.split(", "))


def test_latex_says_the_rules(fitted):
    model = fitted("readable")
    names = {1: 'width "w", mm', 2: "größe", 3: r"c\_1"}
    rules = list(from_latex(to_latex(model.model), names))
    assert len(rules) == (len(model.model["partitions"][0]["nodes"]) + 1) // 2
    for i in model.of("training"):
        values = [
            eval(value, {"v": model.rows[i]}) for value, condition in rules if eval(condition, {"v": model.rows[i]})
        ]
        assert values == [pytest.approx(model.predicted[i, 0], rel=1e-9)]


def test_latex_says_on_which_side_a_threshold_lies():
    """Rules hold from above their lower end up to their upper end, which is theirs."""
    model = constants()
    nodes = model["partitions"][0]["nodes"]
    nodes[2]["split"] = {**nodes[0]["split"], "threshold": 3.0, "left": 3, "right": 4}
    nodes += [{**nodes[1], "samples": 2, "value": [2.25]}, {**nodes[1], "samples": 3, "value": [2.75]}]
    rules = re.findall(r"([0-9.]+) & \\text\{if \} ([^\n]*?)(?: \\\\)?\n", to_latex(model))
    assert rules == [("1.5", r"x \le 2"), ("2.25", r"2 < x \le 3"), ("2.75", "x > 3")]


@every_model
def test_latex_is_balanced(fitted, name):
    text = to_latex(fitted(name).model)
    bare = re.sub(r"\\[{}\\]", "", text)
    depth = 0
    for letter in bare:
        depth += {"{": 1, "}": -1}.get(letter, 0)
        assert depth >= 0
    assert depth == 0
    assert not re.search(r"(?<!\\)[%#$~]", text) and text.count("\\begin{cases}") == text.count("\\end{cases}")
    assert not re.search(r"e[+-]\d\d", text)


def test_latex_of_one_leaf_and_digits(fitted):
    text = to_latex(fitted("one_leaf").model, digits=3)
    assert text.startswith("y = ") and "cases" not in text
    assert all(len(number.replace(".", "").lstrip("0")) <= 4 for number in re.findall(r"(?<=[ -])\d+\.\d+", text))
    with pytest.raises(ValueError, match="digits is 0"):
        to_latex(fitted("one_leaf").model, digits=0)


# SRBench


class Estimator:
    """What the module asks of an estimator."""

    def __init__(self, model):
        self.text = json.dumps(model)
        self.feature_names_in_ = np.array([column["name"] for column in model["inputs"]] + ["not used"], dtype=object)

    def to_json(self):
        return self.text


class Frame:
    def __init__(self, columns):
        self.columns = columns


@pytest.mark.parametrize("name", ["readable", "crisp", "one_leaf"])
def test_srbench_model_evaluates_to_the_prediction(fitted, name):
    pytest.importorskip("sympy")
    from sympy import Symbol, lambdify
    from sympy.parsing.sympy_parser import parse_expr

    model = fitted(name)
    _, space = function_of(model.model)
    inside = [i for i in model.of("training", "threshold") if within_the_ranges(space, model.rows[i])]
    assert len(inside) > 50
    for given, names in (
        (None, ["a", "x1", "größe", "c_1"]),
        (["p", "E", "x_2", "lambda", "u"], ["p", "E", "x_2", "x3"]),
    ):
        text = srbench.model(Estimator(model.model), None if given is None else Frame(given))
        expression = parse_expr(text, local_dict={name: Symbol(name) for name in names})
        assert expression.free_symbols <= {Symbol(name) for name in names}
        function = lambdify([Symbol(name) for name in names], expression, "math")
        assert_same(np.array([float(function(*model.rows[i])) for i in inside]), model.predicted[inside, 0], 1e-11)


def test_srbench_complexity():
    pytest.importorskip("sympy")
    # Piecewise, of two pairs: (1.5, x0 <= 2) and (2.5, true)
    assert srbench.complexity(Estimator(constants())) == 1 + (1 + 1 + 3) + (1 + 1 + 1)
    assert srbench.model(Estimator(constants())) == "Piecewise((1.5, x <= 2), (2.5, True))"


def test_srbench_writes_as_people_do():
    model = constants()
    model["regressors"] = [{"column": 0, "centre": 2.0}]
    for node, slope in zip(model["partitions"][0]["nodes"], (0.0, -1.0, 0.25)):
        node.update(slope=[[slope]], mean=[0.0], low=[-2.0], high=[2.0])
    model["partitions"][0]["outer_slope"] = [[0.0]]
    model["partitions"][0]["nodes"][2]["value"] = [-2.0]
    # 1.5 - (x - 2) and -2 + 0.25 (x - 2)
    assert srbench.model(Estimator(model)) == "Piecewise((3.5 - x, x <= 2), (-2.5 + 0.25*x, True))"


def test_srbench_refuses(fitted):
    with pytest.raises(ValueError, match="category of words"):
        srbench.model(Estimator(fitted("readable_words").model))
    with pytest.raises(ValueError, match="2 outputs"):
        srbench.model(Estimator(fitted("two_outputs").model))
    with pytest.raises(ValueError, match="X has 2 columns, the estimator was fitted with 5"):
        srbench.model(Estimator(fitted("crisp").model), Frame(["p", "q"]))
    with pytest.raises(AttributeError, match="nonsense"):
        srbench.nonsense
