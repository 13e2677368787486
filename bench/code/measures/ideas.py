"""Ideas that should stand once: an answer, and a preparation of rows."""

import ast
import re

from .sources import line_of

# Members that say what came of a search. Their default in a struct is not counted, only what is assigned later.
ANSWERS = ("answer", "verdict", "outcome")

# How rows are made ready. A room that does so in several files does not do it once.
PREPARATIONS = (
    (r"\bmake_table\(", "scaled columns and their order, for trees"),
    (r"\bmake_training\(", "tables, folds and regressors of a fit"),
    (r"\bprepare(?:_plain)?\((?:rows|all|given|given_rows|\{)", "checked rows of a fit, equal ones found"),
    (r"\bchecked_rows\(", "checked rows of a sum of trees"),
    (r"\brows_of\([\w.]*(?:inputs|data),", "rows of a log, or of data of a sum of trees"),
    (r"\bDerivatives(?: \w+)?\((?!const )", "derivatives by time"),
    (r"\bsmooth_lag\(", "the lag of smooth derivatives"),
    (r"(?<!\w)motions\(", "speeds and accelerations among inputs"),
    (r"\bcovariance_of_errors\(", "the covariance of errors of inputs"),
    (r"\bset_aside\(measure", "poses set aside"),
)
# A declaration or definition begins a line with a type, or belongs to a class.
_DECLARED = re.compile(r"^\s*(?!return\b|throw\b)(?:[\w:<>]+[ &*]+)+(?:\w+::)?$")


def answers(checkout, members):
    """Assignments to these members; in Python also keyword arguments of this name."""
    assigned = re.compile(r"(?:\.|->)(?:" + "|".join(members) + r")(?:\[[^\]]*\])?\s*[|&]?=(?!=)")
    places = [(path, line_of(checkout.code(path), match.start()))
              for path in checkout.cpp() for match in assigned.finditer(checkout.code(path))]
    for path in checkout.python():
        for node in checkout.nodes(path):
            is_member = isinstance(node, ast.Attribute) and isinstance(node.ctx, ast.Store) and node.attr in members
            if is_member or isinstance(node, ast.keyword) and node.arg in members:
                places.append((path, node.lineno if is_member else node.value.lineno))
    return places


def preparations(checkout):
    """The first place of each file that makes rows ready."""
    places = []
    for path in checkout.cpp():
        code = checkout.code(path)
        lines = [line_of(code, match.start()) for pattern, _ in PREPARATIONS for match in re.finditer(pattern, code)
                 if not _DECLARED.match(code[code.rfind("\n", 0, match.start()) + 1:match.start()])]
        if lines:
            places.append((path, min(lines)))
    return places
