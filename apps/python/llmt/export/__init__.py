"""Writers that take a model elsewhere: Python, SQL, ONNX, sympy, LaTeX.

Every function takes what `json.loads` makes of the text of a model file. docs/python/deploy.md says which of them
keeps what.
"""

from .latex import to_latex
from .onnx_graph import to_onnx
from .python_source import to_python
from .sql import to_sql
from .sympy_expression import to_sympy

__all__ = ["to_latex", "to_onnx", "to_python", "to_sql", "to_sympy"]
