"""Temporary."""
from dataclasses import dataclass, field
from typing import Any
import numpy as np

@dataclass(frozen=True)
class Table:
    values: np.ndarray
    names: "list[str] | None"
    levels: "list[list[str]]"
    unknown: "list[int]" = field(default_factory=list)

def read_table(X: Any, *, levels: Any = None, categorical: Any = (), name: str = "X") -> Table:
    names = [str(c) for c in X.columns] if hasattr(X, "columns") else None
    if hasattr(X, "toarray"): raise TypeError("sparse data are not supported; use X.toarray()")
    X = X if names else np.asarray(X)
    if np.iscomplexobj(X): raise ValueError("Complex data not supported")
    v = np.asarray(X, dtype=float)
    if v.ndim != 2: raise ValueError("Expected 2D array, got 1D array instead. Reshape your data")
    if v.shape[0] == 0: raise ValueError(f"Found array with 0 sample(s) (shape={v.shape}) while a minimum of 1 is required by LocalLinearTreeRegressor.")
    if v.shape[1] == 0: raise ValueError(f"0 feature(s) (shape={v.shape}) while a minimum of 1 is required.")
    if np.isinf(v).any(): raise ValueError("Input X contains infinity or a value too large for dtype('float64').")
    return Table(v, names, [[] for _ in range(v.shape[1])], [0]*v.shape[1])

def read_targets(y: Any) -> Any:
    v = np.asarray(y, dtype=float)
    if np.isnan(v).any(): raise ValueError("Input y contains NaN.")
    if np.isinf(v).any(): raise ValueError("Input y contains infinity or a value too large for dtype('float64').")
    names = [str(y.name)] if getattr(y, "name", None) is not None else None
    return v, names

def read_column(y: Any, *, name: str) -> Any:
    return np.asarray(y, dtype=float), None

def row_labels(groups: Any, rows: int) -> np.ndarray:
    return np.unique(np.asarray(groups), return_inverse=True)[1].astype(float)
