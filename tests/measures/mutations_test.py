"""mutations_test.py CHECKOUT: what mutants.py changes, and what it leaves alone."""

import pathlib
import sys
import unittest

root = pathlib.Path(sys.argv.pop())
sys.dont_write_bytecode = True
sys.path.insert(0, str(root / "bench/code"))

from mutations import mutations

SOURCE = """#include <a/b.hpp>  // 1 < 2
static_assert(3 < 4);
template <int n = 5>
void f(std::vector<int>&& v, const char* name) {
  if (v.empty() || !*name) throw Error("6 < 7", v);
  for (auto i = v.begin(); i != v.end(); ++i) {
    if (*i <= 0.5 * 1e-9) continue;
    call(v,
         true);
  }
  return g(v);
}
"""


class Mutations(unittest.TestCase):
    def test_are_these(self):
        self.assertEqual(
            [(one.line, one.kind, one.before, one.after) for one in mutations(SOURCE)],
            [(5, "logic", "||", "&&"), (5, "logic", "!", ""), (5, "statement", 'throw Error("6 < 7", v);', ";"),
             (6, "bound", "begin", "end"), (6, "comparison", "!=", "=="), (6, "bound", "end", "begin"),
             (6, "arithmetic", "++", "--"), (7, "comparison", "<=", "<"), (7, "constant", "0.5", "0.6"),
             (7, "arithmetic", "*", "/"), (7, "constant", "1e-9", "1e-08"), (7, "statement", "continue;", ";"),
             (8, "statement", "call(v,\n         true);", ";"), (9, "constant", "true", "false")])

    def test_change_the_text_in_their_place_alone(self):
        for one in mutations(SOURCE):
            changed = one.applied(SOURCE)
            self.assertEqual(changed[:one.at], SOURCE[:one.at])
            self.assertTrue(changed[one.at:].startswith(one.after + SOURCE[one.at + len(one.before):]))


unittest.main()
