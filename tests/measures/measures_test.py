"""measures_test.py CHECKOUT: every room has the figures of table.md, and a rise or fall of each measure is noticed."""

import contextlib
import io
import pathlib
import sys
import tempfile
import types
import unittest

root = pathlib.Path(sys.argv.pop())
sys.dont_write_bytecode = True
sys.path.insert(0, str(root / "bench/code"))

import measure_code

OPTIONS = "llmt/include/llmt/options.hpp"
NAMES = ["max_leaves", "min_leaf_samples", "loss", "sparse", "terms"]
START = {
    OPTIONS: "struct ExpertOptions {\n  int search = 0;\n};\nstruct FitOptions {\n"
             + "".join(f"  int {name} = 0;\n" for name in NAMES) + "  ExpertOptions expert = {};\n};\n",
    "llmt/src/a/judge.cpp": "constexpr double most = 0.9;  // 3 is no threshold\nvoid judge() { found.answer = no; }\n",
    "llmt/src/a/parts.hpp": "",
    "llmt/src/a/whole.hpp": '#include "a/parts.hpp"\n',
    "apps/python/llmt/__init__.py": "",
    "apps/python/llmt/_one.py": "from . import _core, _two\n",
    "apps/python/llmt/_two.py": "import math\n",
}


class Measures(unittest.TestCase):
    def setUp(self):
        self.folder = tempfile.TemporaryDirectory()
        self.addCleanup(self.folder.cleanup)
        self.checkout = pathlib.Path(self.folder.name)
        self.table = self.checkout / "tests/measures/table.md"
        self.table.parent.mkdir(parents=True)
        for name, text in START.items():
            self.write(name, text)
        self.run_script("--renew")

    def write(self, name, text):
        path = self.checkout / name
        path.parent.mkdir(parents=True, exist_ok=True)
        path.write_text(text)

    def add(self, name, text):
        self.write(name, START.get(name, "") + text)

    def run_script(self, what, checkout=None):
        with contextlib.redirect_stderr(io.StringIO()) as words:
            code = measure_code.main([what, str(checkout or self.checkout)])
        return types.SimpleNamespace(returncode=code, stderr=words.getvalue())

    def refused(self, words):
        result = self.run_script("--check")
        self.assertEqual(result.returncode, 1)
        self.assertIn(words, result.stderr)
        self.assertEqual(result.stderr.count("\n"), 2, result.stderr)  # this one, and what to do

    def accepted(self):
        result = self.run_script("--check")
        self.assertEqual((result.returncode, result.stderr), (0, ""))

    def test_every_room_has_the_figures_of_the_table(self):
        result = self.run_script("--check", root)
        self.assertEqual(result.returncode, 0, result.stderr)

    def test_a_checkout_that_was_renewed_is_accepted(self):
        self.accepted()
        self.assertIn("| llmt/src/a | thresholds | 1 | 1 | |", self.table.read_text())

    def test_one_more_place_that_writes_an_answer_is_noticed(self):
        self.add("llmt/src/a/judge.cpp", "void b() { now->answer = yes; }\nbool c() { return now.answer == yes; }\n")
        self.refused("llmt/src/a: answers rose from 1 to 2. Its line must have the new figure and say")

    def test_a_confirmed_is_noticed(self):
        self.add("llmt/src/a/judge.cpp", "void b() { found[0].confirmed = false; }\n")
        self.refused("llmt/src/a: confirmed rose from 0 to 1")

    def test_another_file_that_prepares_rows_is_noticed(self):
        self.write("robotics/src/b/c.cpp", "void b() { const auto t = make_table(x, y); }\n")
        self.refused("robotics/src/b: preparations rose from 0 to 1")

    def test_another_list_of_options_is_noticed(self):
        self.write("apps/trees/list.cpp", 'const char* taken[] = {"max-leaves", "min-leaf", "loss", "sparse"};\n')
        self.refused("apps/trees: option-lists rose from 0 to 1")

    def test_a_copy_of_the_options_is_noticed(self):
        copies = "".join(f"  kept.{name} = fit.{name};\n" for name in NAMES)
        self.write("llmt/src/b/kept.cpp", "void copy() {\n" + copies + "}\n")
        self.refused("llmt/src/b: option-lists rose from 0 to 1")

    def test_a_named_threshold_is_noticed(self):
        self.add("llmt/src/a/judge.cpp", "constexpr int fewest = 7;\n")
        self.refused("llmt/src/a: thresholds rose from 1 to 2")

    def test_a_number_in_a_condition_is_noticed_but_no_text_index_or_loop(self):
        self.add("llmt/src/a/judge.cpp", 'bool b() { return x(3) < 0 || s == "7 > 5"; }\n'
                 "void c() { for (int i = 0; i < 3; ++i) d(i); }\n")
        self.accepted()
        self.add("llmt/src/a/judge.cpp", "bool b() { return share < 0.3 * all; }\n")
        self.refused("llmt/src/a: thresholds rose from 1 to 2")

    def test_a_threshold_of_python_is_noticed(self):
        self.add("apps/python/llmt/_two.py", "def b(x):\n    return x if x < 12 else 0\n")
        self.refused("apps/python/llmt: thresholds rose from 0 to 1")

    def test_a_decision_by_rows_is_noticed(self):
        self.add("llmt/src/a/judge.cpp", "bool b(int rows) { return rows < 100 * most; }\n")
        self.run_script("--renew")
        self.assertIn("| llmt/src/a | sizes | 1 | 0 | ? |", self.table.read_text())

    def test_a_circle_is_noticed(self):
        self.write("llmt/src/a/parts.hpp", '#include "a/whole.hpp"\n')
        self.refused("llmt/src/a: circles rose from 0 to 1")

    def test_a_circle_of_imports_in_a_function_is_noticed(self):
        self.add("apps/python/llmt/_two.py", "def b():\n    from ._one import c\n    return c\n")
        self.refused("apps/python/llmt: circles rose from 0 to 1")

    def test_a_compiled_module_is_in_no_circle(self):
        self.write("apps/python/llmt/__init__.py", "from ._one import b as b\n")
        self.add("apps/python/llmt/_two.py", "from llmt import _core\n")
        self.accepted()
        self.add("apps/python/llmt/_two.py", "from llmt import b\n")
        self.refused("apps/python/llmt: circles rose from 0 to 1")

    def test_a_fall_asks_for_the_lower_figure(self):
        self.write("llmt/src/a/judge.cpp", "void judge() { found.answer = no; }\n")
        self.refused("llmt/src/a: thresholds fell from 1 to 0. Lower the figure")
        self.run_script("--renew")
        self.accepted()

    def test_a_rise_is_accepted_once_its_line_says_what_for(self):
        self.add("llmt/src/a/judge.cpp", "constexpr int fewest = 7;\n")
        self.assertEqual(self.run_script("--renew").returncode, 1)
        self.refused("llmt/src/a: thresholds rose from 1 to 2, and its line does not say what for")
        self.table.write_text(self.table.read_text().replace("| 2 | 1 | ? |", "| 2 | 1 | Without it six rows decide |"))
        self.accepted()
        self.run_script("--renew")
        self.assertIn("| 2 | 1 | Without it six rows decide |", self.table.read_text())
        self.write("llmt/src/a/judge.cpp", START["llmt/src/a/judge.cpp"])
        self.run_script("--renew")
        self.assertIn("| llmt/src/a | thresholds | 1 | 1 | |", self.table.read_text())
        self.accepted()


unittest.main()
