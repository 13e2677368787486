"""What the documentation shows works: examples in docstrings, and the programs of docs/examples/python."""

import doctest
import importlib
import os
import pkgutil
import re
import subprocess
import sys
from pathlib import Path

import programs
import pytest
from study import sampled

import llmt

ROOT = Path(__file__).parents[2]
PAGES = [ROOT / "README.md", ROOT / "docs" / "python.md", *sorted((ROOT / "docs" / "python").glob("*.md"))]
PAGES = [page for page in PAGES if "```python\n" in page.read_text(encoding="utf-8")]
EXAMPLES = sorted((Path(__file__).parents[2] / "docs" / "examples" / "python").glob("*.py"))
# What takes long in a program, and what the gate runs in its place: the same with fewer rows.
SHORTER = {
    "mujoco_log": [("seconds=20.0", "seconds=2.5"), ("record(2, 10.0)", "record(2, 1.0)")],
    "regression": [("(5000, 5)", "(400, 5)")],
}


def modules():
    names = [module.name for module in pkgutil.walk_packages(llmt.__path__, "llmt.")]
    return ["llmt"] + [name for name in names if not name.rpartition(".")[2] in ("_core", "_robotics")]


@pytest.mark.parametrize("name", modules())
def test_examples_in_docstrings(name, monkeypatch):
    monkeypatch.chdir(Path(__file__).parents[2])  # examples read docs/samples
    results = doctest.testmod(importlib.import_module(name), optionflags=doctest.ELLIPSIS)
    assert results.failed == 0


def test_docstrings_have_examples():
    finder = doctest.DocTestFinder()
    assert any(found.examples for found in finder.find(importlib.import_module("llmt"), "llmt"))


@pytest.mark.parametrize("program", EXAMPLES, ids=lambda path: path.stem)
def test_a_program_of_the_documentation_runs(program, tmp_path):
    for module in ("sklearn", "pandas"):
        pytest.importorskip(module)
    text = program.read_text(encoding="utf-8")
    if "mujoco" in text:
        pytest.importorskip("mujoco")
    shorter = sampled([], SHORTER.get(program.stem, []))
    for long, short in shorter:
        assert long in text
        text = text.replace(long, short)
    if shorter:
        program = tmp_path / program.name
        program.write_text(text, encoding="utf-8")
    code, printed, complained = programs.run(program, tmp_path)
    print(printed)
    assert code == 0, complained
    assert printed


def blocks_of(page):
    return re.findall(r"^```python\n(.*?)^```$", page.read_text(encoding="utf-8"), re.MULTILINE | re.DOTALL)


@pytest.mark.parametrize("page", PAGES[1:], ids=lambda path: path.stem)
def test_the_blocks_of_a_page_run_one_after_the_other(page, tmp_path):
    for module in ("matplotlib", "onnx", "pandas", "sklearn", "sympy"):
        pytest.importorskip(module)
    if "dask" in page.read_text(encoding="utf-8"):
        pytest.importorskip("dask.dataframe")
    (tmp_path / "docs").symlink_to(ROOT / "docs")  # what blocks write is not left in the repository
    program = tmp_path / "program.py"
    program.write_text("\n".join(blocks_of(page)), encoding="utf-8")
    code, _, complained = programs.run(program, tmp_path)
    assert code == 0, complained


def test_the_first_page_runs_in_a_new_interpreter(tmp_path):
    """From the first import to the end of the interpreter, which processes that are forked do not see."""
    for module in ("matplotlib", "pandas", "sklearn"):
        pytest.importorskip(module)
    (tmp_path / "docs").symlink_to(ROOT / "docs")
    environment = {**os.environ, "PYTHONPATH": str(Path(llmt.__path__[0]).resolve().parent), "MPLBACKEND": "agg"}
    command = [sys.executable, "-c", "\n".join(blocks_of(PAGES[0]))]
    run = subprocess.run(command, cwd=tmp_path, capture_output=True, text=True, timeout=300, env=environment)
    assert run.returncode == 0, run.stderr
