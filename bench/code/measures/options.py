"""Lists of the options of a fit that are spelled out by hand."""

import ast
import re

from .sources import line_of

_HEADER = "llmt/include/llmt/options.hpp"
_VISITOR = "llmt/include/llmt/option_fields.hpp"  # of the members of the structs; one list with them
_ESTIMATOR = "apps/python/llmt/_estimator.py"
_TEXT = re.compile(r'//[^\n]*|"((?:\\.|[^"\\\n])*)"')
_COPY = re.compile(r"(?:\.|->)(\w+)\s*=\s*(?:static_cast<[\w:]+>\()?[\w.]*(?:\.|->)(\w+)\b")
_TIE = re.compile(r"\bstd::tie\(([^;]*)\)")
_FEWEST_OF_PYTHON = 3  # names in one display: parameters of the estimator, or options of a fit


# Names and types of the data members of a struct.
def members(struct, header):
    match = re.search(r"struct " + struct + r" \{(.*?)\n\};", header, re.S)
    body = re.sub(r"\([^()]*\)", "", re.sub(r"//[^\n]*", "", match.group(1))) if match else ""
    return re.findall(r"([\w:<>]+(?:<[^;]*?>)?)\s+(\w+)(?:\s*=[^;]*|\{[^;]*\})?;", body)


def leaves(checkout, struct="FitOptions"):
    """How many options there are, those of structs in structs included."""
    headers = "\n".join(checkout.text(path) for path in checkout.files("llmt/include"))

    def count(of):
        return sum(count(kind) if kind.endswith("Options") else 1 for kind, _ in members(of, headers))

    return count(struct)


def _fields(checkout):
    header = checkout.root / _HEADER
    text = checkout.text(header) if header.is_file() else ""
    return {name for struct in ("FitOptions", "ExpertOptions") for kind, name in members(struct, text)
            if not kind.endswith("Options")}


def _field_of(word, fields):
    """The option that a text names: "--min-leaf" is min_leaf_samples, "width" is widths."""
    word = word.split(",")[-1].split(".")[-1].lstrip("-").replace("-", "_")
    return next((f for f in sorted(fields) if word and (f in (word, word + "s") or f.startswith(word + "_"))), None)


def _named(checkout, path, fields):
    """Line of each option that a C++ file names in a text of its own, copies between members of one name, or ties."""
    text, code = checkout.text(path), checkout.code(path)
    found = [(_field_of(match.group(1), fields), line_of(text, match.start()))
             for match in _TEXT.finditer(text) if match.group(1)]
    found += [(match.group(1), line_of(code, match.start()))
              for match in _COPY.finditer(code) if match.group(1) == match.group(2)]
    found += [(name, line_of(code, match.start()))
              for match in _TIE.finditer(code) for name in re.findall(r"\.(\w+)", match.group(1))]
    return {name: line for name, line in reversed(found) if name in fields}


def _parameters(checkout):
    path = checkout.root / _ESTIMATOR
    names = set()
    for node in checkout.nodes(path) if path.is_file() else ():
        if isinstance(node, ast.FunctionDef) and node.name == "__init__":
            names |= {argument.arg for argument in node.args.kwonlyargs}
    return names


def lists(checkout):
    """Files that name more than half of the options of a fit by hand, the header of the options itself among them, and
    files of Python with a display (a dict, list, tuple or set) that names three parameters of the estimator or more. The
    visitor of the members is one list with the structs.

    A struct that repeats the options and the functions of its room that copy from and to it are one list."""
    fields = _fields(checkout)
    places, structs = [], {}
    for path in checkout.cpp():
        if checkout.name(path) == _HEADER:
            places.append((path, 1))
            continue
        if checkout.name(path) == _VISITOR:
            continue
        named = _named(checkout, path, fields)
        if 2 * len(named) > len(fields):
            room = checkout.room(path)
            copies = not any(_field_of(match.group(1) or "", fields) for match in _TEXT.finditer(checkout.text(path)))
            if copies and room in structs:
                continue
            if copies:
                structs[room] = path
            places.append((path, min(named.values())))
    known = fields | _parameters(checkout)
    for path in checkout.python():
        lines = []
        for node in checkout.nodes(path):
            if isinstance(node, (ast.Dict, ast.List, ast.Tuple, ast.Set)):
                keys = node.keys if isinstance(node, ast.Dict) else node.elts
                named = {key.value for key in keys if isinstance(key, ast.Constant)} & known
                if len(named) >= _FEWEST_OF_PYTHON:
                    lines.append(node.lineno)
        places += [(path, min(lines))] if lines else []
    return places
