"""The sources of a checkout: which there are, their rooms, and C++ without comments and texts."""

import ast
import functools
import pathlib
import re

LIBRARIES = ("llmt", "robotics")
MEASURED = (*LIBRARIES, "apps")  # programs, reports and the Python package have rooms as the libraries have

COMMENT_OR_TEXT = re.compile(
    r"""//[^\n]* | /\*.*?\*/ | R"(?P<mark>[^(\s]*)\(.*?\)(?P=mark)" | "(?:\\.|[^"\\\n])*" |
        (?<![0-9a-fA-F])'(?:\\.|[^'\\\n])'""",
    re.S | re.X)


class Checkout:
    def __init__(self, root):
        self.root = pathlib.Path(root).resolve()

    def name(self, path):
        return path.relative_to(self.root).as_posix()

    # The room of a file is its folder.
    def room(self, path):
        return self.name(path.parent)

    @functools.lru_cache(maxsize=None)
    def files(self, *folders, endings=("cpp", "hpp")):
        found = []
        for folder in folders:
            for ending in endings:
                found += [path for path in (self.root / folder).rglob(f"*.{ending}")
                          if "build" not in path.relative_to(self.root).parts]
        return sorted(found)

    @functools.lru_cache(maxsize=None)
    def text(self, path):
        return path.read_text(errors="replace")

    # C++ with the same lines, comments blank and the texts in quotes empty.
    @functools.lru_cache(maxsize=None)
    def code(self, path):
        def blank(match):
            lines = "\n" * match.group().count("\n")
            return lines if match.group().startswith("/") else '""' + lines

        return COMMENT_OR_TEXT.sub(blank, self.text(path))

    # All nodes of the syntax tree of a file of Python, its module first.
    @functools.lru_cache(maxsize=None)
    def nodes(self, path):
        return list(ast.walk(ast.parse(self.text(path))))

    def cpp(self):
        return self.files(*MEASURED)

    def python(self):
        return self.files("apps", endings=("py",))


def line_of(text, position):
    return text.count("\n", 0, position) + 1
