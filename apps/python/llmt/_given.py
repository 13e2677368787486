"""What a search for missing terms is given, as the extension takes it."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np

from llmt._results import number
from llmt.tables.named import columns_of


@dataclass(frozen=True)
class Parameter:
    """A parameter that a simulation may adjust before anything counts as missing."""

    value: float
    """Where the fit starts."""
    scale: float | None = None
    """A change that is typical; None: a tenth of the value, or 1 if that is 0."""
    unit: str = ""
    free: bool = True
    """False: the value is kept."""
    sigma: float | None = None
    """Standard deviation of what is known beforehand: the value is an observation with this error."""

    def _given(self, name: str) -> dict[str, Any]:
        value = number(f"parameter {name}", self.value, -1e300, 1e300)
        scale = self.scale if self.scale is not None else 0.1 * abs(value) or 1.0
        return {
            "name": name,
            "unit": self.unit,
            "value": value,
            "scale": number(f"scale of parameter {name}", scale, 5e-324, 1e300),
            "free": bool(self.free),
            "prior_sigma": None
            if self.sigma is None
            else number(f"sigma of parameter {name}", self.sigma, 5e-324, 1e300),
            "prior_value": None,
        }


def is_table(given: Any) -> bool:
    return not isinstance(given, np.ndarray) or bool(given.dtype.names)


def matrix_of(given: Any, what: str, prefix: str) -> tuple[np.ndarray, list[str]]:
    """Numbers, rows x columns, and the names of the columns. A plain array has the names x0, x1, ... of ``prefix``."""
    if isinstance(given, (list, tuple)) and given and not isinstance(given[0], Mapping):
        given = np.asarray(given)
    if hasattr(given, "to_frame") and not hasattr(given, "columns"):  # a Series
        given = given.to_frame()
    if is_table(given):
        columns = columns_of(given, what)
        for name, values in columns.items():
            for row, value in enumerate(values):
                if isinstance(value, (str, bytes)) or not np.isfinite(_float(value, what, name, row)):
                    raise ValueError(f"{what}, row {row}: column {name!r} is {value!r}, must be a finite number")
        return np.array([[float(v) for v in values] for values in columns.values()]).T, list(columns)
    array = np.asarray(given, dtype=float)
    if array.ndim == 1:
        array = array[:, np.newaxis]
    if array.ndim != 2 or array.shape[0] == 0 or array.shape[1] == 0:
        raise ValueError(f"{what} has the shape {array.shape}, must have rows and columns")
    if not np.isfinite(array).all():
        row, column = (int(k) for k in np.argwhere(~np.isfinite(array))[0])
        raise ValueError(f"{what}, row {row}: column {column} is {array[row, column]}, must be a finite number")
    return array, [prefix if array.shape[1] == 1 and prefix == "y" else f"{prefix}{k}" for k in range(array.shape[1])]


def _float(value: Any, what: str, name: str, row: int) -> float:
    try:
        return float("nan") if value is None else float(value)
    except (TypeError, ValueError):
        raise ValueError(f"{what}, row {row}: column {name!r} is {value!r}, must be a finite number") from None


def maker_like(like: Any) -> Callable[[np.ndarray, list[str]], Any]:
    """Makes rows into a table of the kind that the caller gave: callables get what their author knows."""
    if not is_table(like):
        return lambda rows, _: rows
    if hasattr(like, "iloc"):
        import pandas

        return lambda rows, columns: pandas.DataFrame(rows, columns=columns)
    if hasattr(like, "get_columns"):
        import polars

        return lambda rows, columns: polars.DataFrame({name: rows[:, k] for k, name in enumerate(columns)})
    return lambda rows, columns: {name: rows[:, k] for k, name in enumerate(columns)}


def outputs_of(given: Any, rows: int, outputs: list[str], what: str) -> np.ndarray:
    """What a callable returned, rows x outputs. A table has the outputs as columns."""
    if isinstance(given, Mapping) or hasattr(given, "iloc") and hasattr(given, "columns"):
        columns = columns_of(given, what)
        missing = [name for name in outputs if name not in columns]
        if missing:
            raise ValueError(f"{what} returned no column {missing[0]!r}; there are {', '.join(columns)}")
        given = np.array([columns[name] for name in outputs], dtype=float).T
    array = np.asarray(given, dtype=float)
    if array.ndim == 1:
        array = array[:, np.newaxis]
    if array.shape != (rows, len(outputs)):
        raise ValueError(f"{what} returned the shape {array.shape}, must be {rows} x {len(outputs)}")
    if not np.isfinite(array).all():
        row = int(np.argwhere(~np.isfinite(array))[0][0])
        raise ValueError(f"{what} returned a number that is not finite, in row {row}")
    return np.ascontiguousarray(array)


def in_order(rows: np.ndarray, columns: list[str], wanted: list[str], named: bool) -> np.ndarray:
    if not named:
        if rows.shape[1] != len(wanted):
            raise ValueError(f"inputs has {rows.shape[1]} columns, must have {len(wanted)}: {', '.join(wanted)}")
        return rows
    missing = [name for name in wanted if name not in columns]
    if missing:
        raise ValueError(f"inputs has no column {missing[0]!r}; there are {', '.join(columns)}")
    return rows[:, [columns.index(name) for name in wanted]]


def predictor_of(simulate: Any, kind: Any, question: Mapping[str, Any], as_array: bool) -> Any:
    if simulate is None:
        return None
    make = maker_like(kind)
    inputs, outputs = list(question["input_names"]), list(question["output_names"])
    parameters = [parameter["name"] for parameter in question["parameters"]]

    def predict(rows: np.ndarray, values: list[float]) -> np.ndarray:
        given = np.array(values) if as_array else dict(zip(parameters, values, strict=True))
        return outputs_of(simulate(given, make(rows, inputs)), len(rows), outputs, "simulate")

    return predict


def derivatives_of(jacobian: Any, kind: Any, question: Mapping[str, Any], as_array: bool) -> Any:
    """As the extension takes them: rows x (outputs * parameters), all parameters of output 0 first."""
    if jacobian is None:
        return None
    if not callable(jacobian):
        raise TypeError(f"jacobian is {jacobian!r}, must be a callable of parameters and inputs")
    make = maker_like(kind)
    inputs, outputs = list(question["input_names"]), list(question["output_names"])
    parameters = [parameter["name"] for parameter in question["parameters"]]

    def derivatives(rows: np.ndarray, values: list[float]) -> np.ndarray:
        given = np.array(values) if as_array else dict(zip(parameters, values, strict=True))
        made = jacobian(given, make(rows, inputs))
        if isinstance(made, Mapping):
            if missing := [name for name in parameters if name not in made]:
                raise ValueError(f"jacobian returned no {missing[0]!r}; there are {', '.join(made)}")
            by = [outputs_of(made[name], len(rows), outputs, f"jacobian by {name}") for name in parameters]
            array = np.stack(by, axis=2)
        else:
            array = np.asarray(made, dtype=float)
            if array.ndim == 2 and len(outputs) == 1:
                array = array[:, np.newaxis, :]
            if array.shape != (len(rows), len(outputs), len(parameters)):
                raise ValueError(
                    f"jacobian returned the shape {array.shape}, must be rows x outputs x parameters: "
                    f"{len(rows)} x {len(outputs)} x {len(parameters)}"
                )
            if not np.isfinite(array).all():
                row = int(np.argwhere(~np.isfinite(array))[0][0])
                raise ValueError(f"jacobian returned a number that is not finite, in row {row}")
        return np.ascontiguousarray(array.reshape(len(rows), -1))

    return derivatives


def own_terms_of(terms: Mapping[str, Any], kind: Any, question: Mapping[str, Any]) -> list[tuple[str, str, Any]]:
    make = maker_like(kind)
    inputs = list(question["input_names"])

    def of_rows(name: str, function: Callable[[Any], Any]) -> Callable[[np.ndarray], np.ndarray]:
        return lambda rows: outputs_of(function(make(rows, inputs)), len(rows), [name], f"term {name}")

    own = []
    for name, term in terms.items():
        formula, function = term if isinstance(term, tuple) else (name, term)
        if not callable(function) or not isinstance(formula, str):
            raise TypeError(f"term {name!r} is {term!r}, must be a callable of the inputs, or (formula, callable)")
        own.append((name, formula, of_rows(name, function)))
    return own


def parameters_of(parameters: Any) -> tuple[list[dict[str, Any]], bool]:
    """As the extension takes them, and whether the callable gets an array: of parameters without names."""
    if parameters is None:
        parameters = {}
    if isinstance(parameters, Mapping):
        given = {
            name: value if isinstance(value, Parameter) else Parameter(value) for name, value in parameters.items()
        }
        return [parameter._given(str(name)) for name, parameter in given.items()], False
    values = [value if isinstance(value, Parameter) else Parameter(value) for value in parameters]
    return [parameter._given(f"p{k}") for k, parameter in enumerate(values)], True


def noise_of(given: Mapping[str, float] | str | None, inputs: list[str]) -> list[float]:
    """Standard deviations of the errors of the inputs; NaN for those that are estimated."""
    if given is None:
        return []
    if isinstance(given, str):
        if given != "auto":
            raise ValueError(f"input_noise is {given!r}, must be 'auto' or numbers by input")
        return [np.nan] * len(inputs)
    if unknown := [name for name in given if name not in inputs]:
        raise ValueError(f"input_noise names {unknown[0]!r}, must be inputs of {', '.join(inputs)}")
    errors = [float(given.get(name, 0.0)) for name in inputs]
    if any(not 0.0 <= error < np.inf for error in errors):
        raise ValueError("input_noise has a number that is not finite or below 0")
    return errors


def in_time(time: Any, groups: Any, n: int, has_order: bool) -> tuple[list[float], list[int]]:
    """The instant of every row, and the number of its recording."""
    if time is None:
        if groups is not None:
            raise ValueError("groups needs time: the rows of a group follow each other in time")
        return [], []
    if has_order:
        raise ValueError("time says the order of the rows: order is not needed beside it")
    if np.asarray(time).dtype.kind in "mM":
        raise ValueError("time holds dates: give numbers, such as (time - time[0]).dt.total_seconds()")
    instants = np.asarray(time, dtype=float)
    labels = np.zeros(n) if groups is None else np.asarray(groups)
    for name, values in (("time", instants), ("groups", labels)):
        if values.shape != (n,):
            raise ValueError(f"{name} has the shape {values.shape}, must be ({n},)")
    return instants.tolist(), np.unique(labels, return_inverse=True)[1].tolist()


def in_order_of_outputs(rows: np.ndarray, found: list[str], outputs: list[str]) -> np.ndarray:
    missing = [name for name in outputs if name not in found]
    if missing:
        raise ValueError(f"simulated has no column {missing[0]!r}; there are {', '.join(found)}")
    return rows[:, [found.index(name) for name in outputs]]
