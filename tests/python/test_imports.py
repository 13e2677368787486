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


def test_the_estimator_imports_numpy_and_the_base_class_of_scikit_learn_alone():
    modules = imported_by("from llmt import LocalLinearTreeRegressor")
    assert "numpy" in modules
    of_scikit_learn = imported_by("import numpy\ntry:\n    import sklearn.base\nexcept ImportError:\n    pass")
    assert not (modules - of_scikit_learn) & OPTIONAL


def test_all_public_names_are_there_and_listed():
    program = "import llmt; assert set(llmt.__all__) <= set(dir(llmt)); [getattr(llmt, name) for name in llmt.__all__]"
    subprocess.run([sys.executable, "-c", program], check=True)
