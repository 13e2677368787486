"""Thresholds: numbers that decide, whether they have a name or stand in a condition."""

import ast
import functools
import re

from .sources import line_of

# These decide no more than whether there is any, whether there are several, and the sign or half of a number.
_PLAIN = {0.0, 0.5, 1.0, 2.0}
_NUMBER = r"(?<![\w.])(?:\d[\d']*\.?\d*(?:[eE][+-]?\d+)?)[fFuUlL]*(?![\w.(])"
_NAMED = re.compile(r"\bconstexpr\s+(?:(?:inline|static|const)\s+)*[\w:<>, ]+?[\s&*]+(\w+)(?:\[[^;=]*\])?"
                    r"\s*(?:=\s*|(?=\{))([^;]*);")
_COMPARED = re.compile(r"\s(?:<|>|<=|>=|==|!=)\s")
_ENDS = re.compile(r"[;{}?]|&&|\|\||,|\s:\s|\breturn\b|(?<![<>=!+\-*/|&])=(?!=)|\b(?:if|while|for|switch)\b")
_BOUNDED = re.compile(r"\bstd::(?:min|max|clamp)\b(?:<[^()]*>)?\(")
_LOOP = re.compile(r"\bfor \([^;()]*(?:\([^;()]*\)[^;()]*)*;[^;]*;")
_INDEX = re.compile(r"[\[(]\s*\d+\s*[\])]|<\s*\d+\s*>")


def _value(text):
    return float(re.sub(r"[fFuUlL']", "", text))


def _numbers(piece):
    """Numbers of a piece of code that decide; what stands alone in brackets is an index."""
    return [match for match in re.finditer(_NUMBER, _INDEX.sub(lambda index: " " * len(index.group()), piece))
            if _value(match.group()) not in _PLAIN]


def named(checkout, path):
    """(name, value or None, line) of every constexpr number."""
    code = checkout.code(path)
    found = []
    for match in _NAMED.finditer(code):
        if re.search(_NUMBER, match.group(2)):
            alone = re.fullmatch(r"[-\s]*" + _NUMBER + r"\s*", match.group(2))
            value = _value(alone.group().strip(" -\n")) if alone else None
            found.append((match.group(1), value, line_of(code, match.start())))
    return found


@functools.lru_cache(maxsize=None)
def conditions(checkout, path):
    """(text, position) of every comparison, and of the arguments of std::min, std::max and std::clamp."""
    code = _LOOP.sub(lambda loop: " " * len(loop.group()), checkout.code(path))
    ends = [0] + [match.end() for match in _ENDS.finditer(code)] + [len(code)]
    pieces = [(code[begin:end], begin) for begin, end in zip(ends, ends[1:])]
    found = [(piece, begin) for piece, begin in pieces if _COMPARED.search(piece)]
    for match in _BOUNDED.finditer(code):
        depth, end = 1, match.end()
        while end < len(code) and depth:
            depth += {"(": 1, ")": -1}.get(code[end], 0)
            end += 1
        found.append((code[match.end():end - 1], match.end()))
    return found


def _in_conditions(checkout, path):
    code = checkout.code(path)
    at = {begin + number.start() for piece, begin in conditions(checkout, path) for number in _numbers(piece)}
    return [line_of(code, position) for position in sorted(at)]


def _of_python(checkout, path):
    def number(node):
        return (isinstance(node, ast.Constant) and type(node.value) in (int, float) and abs(node.value) not in _PLAIN)

    lines = []
    for node in checkout.nodes(path):
        if isinstance(node, ast.Compare):
            sides = [node.left, *node.comparators]
            sides += [side.operand for side in sides if isinstance(side, ast.UnaryOp)]
            sides += [part for side in sides if isinstance(side, ast.BinOp) for part in (side.left, side.right)]
            lines += [side.lineno for side in sides if number(side)]
    for node in checkout.nodes(path)[0].body:
        value = getattr(getattr(node, "value", None), "value", None)
        if isinstance(node, (ast.Assign, ast.AnnAssign)) and type(value) in (int, float):
            lines.append(node.lineno)
    return lines


def thresholds(checkout):
    places = []
    for path in checkout.cpp():
        places += [(path, line) for _, _, line in named(checkout, path)]
        places += [(path, line) for line in _in_conditions(checkout, path)]
    for path in checkout.python():
        places += [(path, line) for line in _of_python(checkout, path)]
    return places


_SIZE = re.compile(r"\b(?:rows|inputs|samples|columns|trees)\b|\bcols\(\)|\brows\(\)")
_FEWEST = 10  # smaller ones say that an equation has a solution


def by_size(checkout):
    """Conditions in which a number of rows or inputs is set against a number of 10 or more, named or not."""
    constants = {}
    for path in checkout.cpp():
        of_room = constants.setdefault(checkout.room(path), set())
        of_room |= {name for name, value, _ in named(checkout, path) if value is not None and value >= _FEWEST}
    places = []
    for path in checkout.cpp():
        known = constants[checkout.room(path)]
        for piece, begin in conditions(checkout, path):
            decides = any(_value(number.group()) >= _FEWEST for number in _numbers(piece))
            if _SIZE.search(piece) and (decides or known & set(re.findall(r"\w+", piece))):
                skip = len(piece) - len(piece.lstrip())
                places.append((path, line_of(checkout.code(path), begin + skip)))
    return places
