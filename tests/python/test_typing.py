"""What type checkers see: a program that uses the package, the package itself, and the stub of the extension."""

import os
import subprocess
import sys
from pathlib import Path

import pytest

import llmt

HERE = Path(__file__).parent
PACKAGE = Path(llmt.__file__).parent


@pytest.fixture(scope="module")
def mypy(tmp_path_factory):
    pytest.importorskip("mypy")
    folder = tmp_path_factory.mktemp("mypy")  # with a cache that the tests share: most of the time is NumPy's

    def run(*source):
        command = [sys.executable, "-m", "mypy", "--config-file", HERE.parents[1] / "pyproject.toml", *source]
        done = subprocess.run(
            command, capture_output=True, text=True, env=os.environ | {"MYPYPATH": str(PACKAGE.parent)}, cwd=folder
        )
        return done.returncode, done.stdout + done.stderr

    return run


def test_the_package_and_the_stub_of_its_extension_pass_strictly(mypy):
    assert (PACKAGE / "py.typed").exists() and (PACKAGE / "_core.pyi").exists()
    code, said = mypy("-p", "llmt")
    assert code == 0, said


def test_a_program_that_uses_the_package_passes_strictly(mypy):
    code, said = mypy(HERE / "typed_use.py")
    assert code == 0, said


def test_a_wrong_use_is_found(mypy, tmp_path):
    wrong = tmp_path / "wrong.py"
    wrong.write_text("import llmt\n\nx: int = llmt.__version__\nllmt.LocalLinearTreeRegressor(max_leafs=3)\n")
    code, said = mypy(wrong)
    assert code == 1
    assert "wrong.py:3" in said and "wrong.py:4" in said, said