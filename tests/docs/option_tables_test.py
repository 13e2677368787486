"""option_tables_test.py CHECKOUT PROGRAMS: docs/options.md is what the programs say, and another page is noticed."""

import pathlib
import subprocess
import sys
import tempfile
import unittest

programs = pathlib.Path(sys.argv.pop())
root = pathlib.Path(sys.argv.pop())
page = (root / "docs/options.md").read_text()


class OptionTables(unittest.TestCase):
    def check(self, text):
        with tempfile.TemporaryDirectory() as folder:
            path = pathlib.Path(folder) / "options.md"
            path.write_text(text)
            command = [sys.executable, root / "docs/option_tables.py", "--check", "--page", path, programs]
            return subprocess.run(command, capture_output=True, text=True)

    def test_are_what_the_programs_say(self):
        result = self.check(page)
        self.assertEqual(result.returncode, 0, result.stdout + result.stderr)

    def test_another_default_is_noticed(self):
        result = self.check(page.replace("Level of prediction intervals, such as 0.9", "Level of intervals, such as 0.8"))
        self.assertEqual(result.returncode, 1)
        self.assertIn("+| `--interval NUMBER` | Level of prediction intervals, such as 0.9", result.stdout)

    def test_an_option_that_is_missing_is_noticed(self):
        lines = [line for line in page.splitlines(True) if not line.startswith("| `--interval")]
        self.assertEqual(self.check("".join(lines)).returncode, 1)

    def test_every_option_of_a_command_has_a_line(self):
        whole = subprocess.run([programs / "llmt", "fit", "--help-all"], capture_output=True, text=True, check=True)
        names = [line.split()[0].split(",")[-1] for line in whole.stdout.splitlines() if line.startswith("  -")]
        self.assertGreater(len(names), 40)
        for name in names:
            self.assertIn(f"`{name.partition('[')[0]}", page)


unittest.main()
