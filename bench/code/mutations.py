"""Changes of one token or one statement of C++, such as slips of the pen make."""

import dataclasses
import re

from measures.sources import COMMENT_OR_TEXT, line_of

# Not mutated either: directives, and what only the compiler reads.
_OF_THE_COMPILER = re.compile(r"^[ \t]*#(?:\\\n|[^\n])*\n|\bstatic_assert\b[^;]*;|\btemplate <[^\n]*>$", re.M)

_COMPARISONS = {"<": "<=", "<=": "<", ">": ">=", ">=": ">", "==": "!=", "!=": "=="}
_LOGIC = {"&&": "||", "||": "&&", "!": ""}
_ARITHMETIC = {"+": "-", "-": "+", "*": "/", "/": "*", "%": "*", "+=": "-=", "-=": "+=", "*=": "/=", "/=": "*=",
               "++": "--", "--": "++"}
_BOUNDS = {"begin": "end", "end": "begin", "front": "back", "back": "front", "min": "max", "max": "min",
           "lower_bound": "upper_bound", "upper_bound": "lower_bound", "floor": "ceil", "ceil": "floor",
           "any_of": "all_of", "all_of": "any_of", "none_of": "any_of"}
_TRUTH = {"true": "false", "false": "true"}
_KINDS = {"comparison": _COMPARISONS, "logic": _LOGIC, "arithmetic": _ARITHMETIC, "bound": _BOUNDS, "constant": _TRUTH}

# clang-format puts spaces around an operator of two values, and none inside of <> or before the && of a reference.
_TOKEN = re.compile(
    r"(?<= )(?:[<>=!]=|&&|\|\||[-+*/]=|[-+*/%<>])(?=[ \n])|\+\+|--|!(?!=)"
    r"|\b(?:" + "|".join((*_BOUNDS, *_TRUTH)) + r")\b(?!<)"
    r"|(?P<number>(?<![\w.])(?:\d+\.?\d*|\.\d+)(?:e[-+]?\d+)?(?![\w.]))")
# What throws, leaves a loop, or begins with a call.
_STATEMENT = re.compile(
    r"(?<=[;{})\n])\s*(?P<statement>continue;|break;|(?:throw\b|[a-z_][\w.:\[\]]*(?:->\w+)*\()[^{};]*;)")
_NO_CALL = re.compile(r"(?:if|for|while|switch|return|sizeof|static_cast)\b|.*= (?:default|delete);$")


@dataclasses.dataclass(frozen=True)
class Mutation:
    at: int
    line: int
    kind: str
    before: str
    after: str

    def applied(self, text):
        return text[:self.at] + self.after + text[self.at + len(self.before):]


def _other_number(text):
    if text.isdigit():
        return str(int(text) + 1)
    return str(float(f"{10.0 * float(text):.6g}") if "e" in text else round(float(text) + 0.1, 12))


def mutations(text):
    """All mutations of a C++ source, in the order of the text."""
    code = text
    for skipped in (COMMENT_OR_TEXT, _OF_THE_COMPILER):  # places stay the same
        code = skipped.sub(lambda match: re.sub(r"[^\n]", "\0", match.group()), code)
    found = []
    for match in _TOKEN.finditer(code):
        before = match.group()
        if match["number"]:
            kind, after = "constant", _other_number(before)
        else:
            kind, after = next((kind, changes[before]) for kind, changes in _KINDS.items() if before in changes)
        found.append(Mutation(match.start(), line_of(text, match.start()), kind, before, after))
    for match in _STATEMENT.finditer(code):
        begin, end = match.span("statement")
        statement = code[begin:end]
        if not _NO_CALL.match(statement) and statement.count("(") == statement.count(")"):
            found.append(Mutation(begin, line_of(text, begin), "statement", text[begin:end], ";"))
    return sorted(found, key=lambda mutation: mutation.at)
