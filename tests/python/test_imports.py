"""What importing the package costs: nothing but itself."""

import subprocess
import sys

OPTIONAL = ("matplotlib", "onnx", "onnxruntime", "pandas", "polars", "pyarrow", "scipy", "shap", "sklearn", "sympy")


def imported_by(statement: str) -> set[str]:
    """The modules that a new Python has imported after the statement, without their submodules."""
    program = f"{statement}\nimport sys\nprint(*sorted({{name.partition('.')[0] for name in sys.modules}}))"
    run = subprocess.run([sys.executable, "-c", program], check=True, capture_output=True, text=True)
    return set(run.stdout.split())


def test_an_optional_library_is_imported_by_nothing_but_its_use() -> None:
    modules = imported_by("import llmt, llmt._core")
    assert "llmt" in modules
    assert not modules.intersection(OPTIONAL)

