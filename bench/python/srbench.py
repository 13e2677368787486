"""SRBench's interface to readable, crisp trees (La Cava et al. 2021): `est`, `model(est)`, `complexity(est)`.

With this folder in PYTHONPATH beside the package:

    from srbench import est, model, complexity
    est.fit(X, y)
    model(est)       # "Piecewise((1.2 + 0.5*x0, x0 <= 3), (2.7, True))"
    complexity(est)  # 10
"""

import json
import keyword
from typing import Any

from llmt.export.model import Model, read
from llmt.export.needed import needed
from llmt.export.sympy_expression import texts

eval_kwargs: dict[str, Any] = {}


def __getattr__(name: str) -> Any:
    if name == "est":  # made when asked for: the functions need no compiled part
        from llmt import LocalLinearTreeRegressor

        return LocalLinearTreeRegressor(readable=True)
    raise AttributeError(f"module {__name__!r} has no attribute {name!r}")


def _tree(est: Any) -> Model:
    tree = read(json.loads(est.to_json()))
    for column in tree.inputs:
        if column.levels:
            raise ValueError(f"the input {column.name!r} is a category of words, which the expressions of SRBench lack")
    if len(tree.outputs) != 1:
        raise ValueError(f"the model has {len(tree.outputs)} outputs; the expressions of SRBench have one")
    return tree


def model(est: Any, X: Any = None) -> str:
    """The fitted model as a text that sympy reads, with the names of the columns as symbols.

    `est` is a fitted estimator whose `to_json()` gives the text of a model. The names are those of `X.columns` if X has
    them, else those of the model. A name that is no identifier of Python becomes x0, x1, ... by its position. Between
    the smallest and the largest training value of every input the value of the expression is the prediction, if the
    model is a readable one; else within the ranges of its leaves.

    Raises ValueError if an input is a category of words, there are several outputs, or X has another number of columns.
    """
    tree = _tree(est)
    names = [column.name for column in tree.inputs] if X is None else [str(name) for name in X.columns]
    given = len(names)
    features = getattr(est, "feature_names_in_", None)
    if X is not None and features is not None:  # the model may leave out inputs
        if len(features) != given:
            raise ValueError(f"X has {given} columns, the estimator was fitted with {len(features)}")
        new = dict(zip([str(name) for name in features], names))
        names = [new[column.name] for column in tree.inputs]
    elif given != len(tree.inputs):
        raise ValueError(f"X has {given} columns, the model has {len(tree.inputs)} inputs")
    is_symbol = [name.isidentifier() and not keyword.iskeyword(name) for name in names]
    return texts(tree, {j: name if ok else f"x{j}" for j, (name, ok) in enumerate(zip(names, is_symbol))})[0]


def complexity(est: Any) -> int:
    """Number of nodes of the expression that sympy reads, as SRBench counts: operators, constants and variables.

    To sympy a sum of many terms is one operator, and a pair of a Piecewise is a node; so this is not the size that
    `llmt inspect` prints.
    Raises ImportError without sympy, and ValueError as `model`.
    """
    sympy = needed("sympy", "complexity")
    tree = _tree(est)
    names = {j: f"x{j}" for j in range(len(tree.inputs))}
    symbols = {name: sympy.Symbol(name, real=True) for name in names.values()}
    expression = sympy.parse_expr(texts(tree, names)[0], local_dict=symbols)
    return sum(1 for _ in sympy.preorder_traversal(expression))
