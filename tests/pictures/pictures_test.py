"""pictures_test.py CHECKOUT: the pictures of CONTRIBUTING.md are current, and a change of a table is noticed."""

import pathlib
import re
import subprocess
import sys
import tempfile
import unittest

root = pathlib.Path(sys.argv.pop())
page = (root / "CONTRIBUTING.md").read_text()


class Pictures(unittest.TestCase):
    def check(self, text):
        with tempfile.TemporaryDirectory() as folder:
            path = pathlib.Path(folder) / "page.md"
            path.write_text(text)
            command = [sys.executable, root / "bench/code/pictures.py", "--check", "--page", path, root]
            return subprocess.run(command, capture_output=True, text=True)

    def changed(self, pattern, replacement):
        text, count = re.subn(pattern, replacement, page, count=1, flags=re.M)
        self.assertEqual(count, 1, pattern)
        return self.check(text)

    def test_are_what_the_tables_make(self):
        result = self.check(page)
        self.assertEqual(result.returncode, 0, result.stderr)

    def test_an_arrow_less_in_the_table_of_rooms_is_noticed(self):
        self.assertIn("is not what the tables make", self.changed(r"^(  boosted  .*) fit (\|.*)$", r"\1 \2").stderr)

    def test_another_order_of_stages_is_noticed(self):
        self.assertIn("is not what the tables make", self.changed(r"^(\| grow \|.*\n)(\| choose \|.*\n)", r"\2\1").stderr)

    def test_a_stage_whose_function_is_gone_is_noticed(self):
        self.assertIn("defines grow_shrub()", self.changed(r"`grow_tree\(\)`", "`grow_shrub()`").stderr)

    def test_a_function_that_is_only_called_there_is_noticed(self):
        self.assertIn("defines parallel_for()", self.changed(r"`grow_tree\(\)`", "`parallel_for()`").stderr)

    def test_a_file_that_is_gone_is_noticed(self):
        self.assertIn("grow_shrub.cpp", self.changed(r"grow_tree.cpp`", "grow_shrub.cpp`").stderr)


unittest.main()
