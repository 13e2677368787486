"""What the documentation shows works: examples in docstrings, and the programs of docs/examples/python."""

import doctest
import importlib
import os
import pkgutil
import re
import subprocess
import sys
from pathlib import Path

import pytest
from study import sampled

import llmt

ROOT = Path(__file__).parents[2]
PAGES = [ROOT / "README.md", ROOT / "docs" / "python.md", *sorted((ROOT / "docs" / "python").glob("*.md"))]
PAGES = [page for page in PAGES if "```python\n" in page.read_text(encoding="utf-8")]
EXAMPLES = sorted((Path(__file__).parents[2] / "docs" / "examples" / "python").glob("*.py"))
# What takes long in a program, and what the gate runs in its place: the same with fewer rows.
SHORTER = {
    "mujoco_log": [("seconds=20.0", "seconds=5.0"), ("record(2, 10.0)", "record(2, 2.0)")],
    "regression": [("(5000, 5)", "(1000, 5)")],
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
    command = [sys.executable, "-" if shorter else program]  # from standard input it has no place of its own
    environment = {**os.environ, "PYTHONPATH": str(Path(llmt.__path__[0]).resolve().parent)}
    run = subprocess.run(
        command, input=text, cwd=tmp_path, capture_output=True, text=True, timeout=300, env=environment
    )
    print(run.stdout)
    assert run.returncode == 0, run.stderr
    assert run.stdout


@pytest.mark.parametrize("page", PAGES, ids=lambda path: path.stem)
def test_the_blocks_of_a_page_run_one_after_the_other(page, tmp_path):
    for module in ("matplotlib", "onnx", "pandas", "sklearn", "sympy"):
        pytest.importorskip(module)
    if "dask" in page.read_text(encoding="utf-8"):
        pytest.importorskip("dask.dataframe")
    (tmp_path / "docs").symlink_to(ROOT / "docs")  # what blocks write is not left in the repository
    blocks = re.findall(r"^```python\n(.*?)^```$", page.read_text(encoding="utf-8"), re.MULTILINE | re.DOTALL)
    environment = {**os.environ, "PYTHONPATH": str(Path(llmt.__path__[0]).resolve().parent), "MPLBACKEND": "agg"}
    run = subprocess.run(
        [sys.executable, "-c", "\n".join(blocks)],
        cwd=tmp_path,
        capture_output=True,
        text=True,
        timeout=300,
        env=environment,
    )
    assert run.returncode == 0, run.stderr
