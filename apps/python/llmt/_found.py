"""What was found missing, applied to other rows."""

from __future__ import annotations

import json
import os
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np

from llmt._given import in_order, in_order_of_outputs, in_time, is_table, matrix_of


class Found:
    """Terms and changes of parameters that a simulation lacks, as :func:`load_found` reads them."""

    def __init__(self, data: Mapping[str, Any]) -> None:
        from llmt import _core

        self._data = dict(data)
        self._json = json.dumps(self._data)
        made = _core.names_of_found(self._json)
        self.inputs: list[str] = made["inputs"]
        """Names of the columns that the terms depend on."""
        self.outputs: list[str] = made["outputs"]
        """Names of the simulated outputs."""
        self.parameters: list[str] = made["parameters"]
        """Names of the parameters of the simulation that change."""

    def to_dict(self) -> dict[str, Any]:
        """What was read."""
        copy: dict[str, Any] = json.loads(self._json)
        return copy

    def correct(
        self,
        inputs: Any,
        simulated: Any,
        *,
        derivatives: Mapping[str, Any] | None = None,
        parameters_are_set: bool = False,
        time: Any = None,
        groups: Any = None,
    ) -> np.ndarray:
        """The simulated outputs with what was found, at other rows: n values, or n x outputs if there are several.

        ``inputs`` is a table or array with the columns :attr:`inputs`, ``simulated`` the outputs there. Where parameters
        of the simulation change, either ``derivatives`` has the derivatives of the outputs by each of them at these
        rows, or ``parameters_are_set`` says that ``simulated`` was computed with their new values. ``time`` and
        ``groups`` are those of the rows, as :func:`llmt.discover` takes them, n numbers in the unit of the search and n
        labels: a delay, a spring in the drive or a resonance depends on the past of a run.

        Raises ValueError for other shapes or columns, for times that such a term cannot do with (none, equal ones in a
        run, another unit), and where a term is not finite at a row.
        """
        from llmt import _core

        rows, columns = matrix_of(inputs, "inputs", "x")
        rows = in_order(rows, columns, self.inputs, is_table(inputs))
        values, found = matrix_of(simulated, "simulated", "y")
        if is_table(simulated):
            values = in_order_of_outputs(values, found, self.outputs)
        shape = (len(rows), len(self.outputs))
        if values.shape != shape:
            raise ValueError(f"simulated has the shape {values.shape}, must be {shape[0]} x {shape[1]}")
        given = {} if derivatives is None else {name: matrix_of(by, name, "y")[0] for name, by in derivatives.items()}
        for name, by in given.items():
            if by.shape != shape:
                raise ValueError(f"derivatives by {name} have the shape {by.shape}, must be {shape[0]} x {shape[1]}")
        missing = [name for name in self.parameters if name not in given]
        if missing and not parameters_are_set:
            raise ValueError(
                f"the parameter {missing[0]!r} changes: derivatives by it are needed, or parameters_are_set=True "
                "where simulated was computed with its new value"
            )
        instants, runs = in_time(time, groups, len(rows), False)
        made = _core.apply_found(
            self._json,
            np.ascontiguousarray(rows),
            np.ascontiguousarray(values),
            {} if parameters_are_set else {name: np.ascontiguousarray(by) for name, by in given.items()},
            instants,
            runs,
        )
        return made[:, 0] if made.shape[1] == 1 else made

    def code(self, language: str = "python") -> str:
        """A function ``correction`` of the inputs, in ``"python"`` (with NumPy) or ``"c"``: what is to be added to the
        simulated output; ``correction_OUTPUT`` for each of several."""
        from llmt import _core

        if language not in ("python", "c"):
            raise ValueError(f"language is {language!r}, must be 'python' or 'c'")
        code: str = _core.code_of_found(self._json, language == "python")
        return code


def load_found(source: str | os.PathLike[str] | Mapping[str, Any]) -> Found:
    """Reads what ``llmt discover --json`` wrote: a path, the JSON text itself, or the dict of ``to_dict()``."""
    if isinstance(source, Mapping):
        return Found(source)
    text = source if isinstance(source, str) and source.lstrip().startswith("{") else Path(source).read_text("utf-8")
    try:
        data = json.loads(text)
    except (json.JSONDecodeError, RecursionError) as error:
        raise ValueError(f"this is no JSON: {error}") from None
    if not isinstance(data, dict):
        raise ValueError("this is no JSON object of llmt discover")
    return Found(data)
