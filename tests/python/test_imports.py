"""What importing the package costs: nothing but itself."""

import subprocess
import sys

OPTIONAL = {"dask", "distributed", "joblib", "matplotlib", "onnx", "onnxruntime", "pandas", "polars", "pyarrow", "pyspark", "scipy", "shap", "sklearn", "sympy"}


def imported_by(statement):
    """The modules that a new Python has imported after the statement, without their submodules."""
    program = f"{statement}\nimport sys\nprint(*sorted({{name.partition('.')[0] for name in sys.modules}}))"
    run = subprocess.run([sys.executable, "-c", program], check=True, capture_output=True, text=True)
    return set(run.stdout.split())


def test_import_imports_no_other_library():
    modules = imported_by("import llmt; llmt.__version__")
    assert "llmt" in modules
    assert not modules & (OPTIONAL | {"numpy"})


# What is left when scikit-learn's base class has been imported already is what llmt imports itself.
ALL_NAMES = """
import sys
import numpy
try:
    import sklearn.base
except ImportError:
    pass
before = {name.partition(".")[0] for name in sys.modules}
from llmt import LocalLinearTreeRegressor
print(*sorted({name.partition(".")[0] for name in sys.modules} - before))
import llmt
assert set(llmt.__all__) <= set(dir(llmt))
[getattr(llmt, name) for name in llmt.__all__]
"""


def test_the_estimator_imports_no_more_than_numpy_and_the_base_class_and_all_public_names_are_there_and_listed():
    run = subprocess.run([sys.executable, "-c", ALL_NAMES], check=True, capture_output=True, text=True)
    modules = set(run.stdout.split())
    assert "llmt" in modules
    assert not modules & OPTIONAL
