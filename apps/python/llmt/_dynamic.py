"""Models of systems that move."""

import json
import os
from pathlib import Path
from typing import Any, NoReturn, Self

import numpy as np

from . import _core
from ._progress import Bar


class DynamicLocalLinearTreeRegressor:
    """A model of a system that moves, learned from records and chosen by free runs on stretches that are held out.

    The next outputs are a polynomial of earlier outputs and inputs plus a local linear model tree of the same values
    (docs/dynamics.md). After its first rows a run uses nothing that was measured.

    Parameters
    ----------
    lags : str, default="auto"
        The earlier values that the model looks at, in rows: ``"y:1-3,u:0-4"``, of outputs from 1 on. ``"auto"``: found
        on held-out stretches.
    purpose : {"simulation", "prediction"} or int, default="simulation"
        What the model is chosen for: free runs, predictions of the next row, or runs of so many rows.
    rest : str, default="auto"
        What learns beside the polynomial: a growth rule as ``"hilomot"``, ``"sum"`` (a sum of trees), ``"readable"``
        (a readable tree alone) or ``"none"``. ``"auto"``: trees of several rules are compared.
    n_jobs : int or None, default=None
        Threads; None and -1: all. The model does not depend on it.

    Attributes
    ----------
    summary_ : dict
        What was compared and chosen, errors, poles, steady gains and tests of the residuals, as
        ``llmt fit --lags auto --json`` prints it.
    simulated_ : ndarray, (rows, outputs)
        The model's runs over its own records; NaN where there is none.

    Examples
    --------
    >>> import numpy as np
    >>> from llmt import DynamicLocalLinearTreeRegressor
    >>> u = np.sin(np.arange(200) ** 1.5 / 40)
    >>> y = np.zeros(200)
    >>> for t in range(1, 200):
    ...     y[t] = 0.9 * y[t - 1] + 0.1 * u[t - 1]
    >>> model = DynamicLocalLinearTreeRegressor(lags="y:1,u:1", rest="none").fit(u, y, dt=0.02)
    >>> bool(abs(model.simulate(u, y[:1])[-1, 0] - y[-1]) < 1e-9)
    True
    """

    def __init__(
        self,
        *,
        lags: str = "auto",
        purpose: "str | int" = "simulation",
        rest: str = "auto",
        n_jobs: int | None = None,
    ) -> None:
        self.lags = lags
        self.purpose = purpose
        self.rest = rest
        self.n_jobs = n_jobs

    def fit(self, u: Any, y: Any, *, dt: float | None = None, records: Any = None) -> Self:
        """Learns from inputs `u` and outputs `y`: arrays or frames, (rows,) or (rows, signals); NaN is a missing value.

        Parameters
        ----------
        u, y : array or frame
            Inputs (None: there are none) and outputs, a row for each time.
        dt : float, optional
            The time from row to row in seconds. By default that of a frame's index of times or numbers, which must rise
            in equal steps; 1 for arrays.
        records : sequence, optional
            The record of each row; rows of one record stand together.

        Raises
        ------
        ValueError
            If shapes differ, times are not at equal steps, or nothing can be learned; the message says which row.
        """
        outputs, output_names = _signals(y, "y")
        inputs, input_names = _signals(u, "u", len(outputs))
        begins = _record_begins(records, len(outputs))
        if dt is None:
            dt = _step_of(y, begins)
        with Bar() as bar:
            self._fitted = _core.fit_system(
                inputs,
                outputs,
                input_names,
                output_names,
                begins,
                float(dt),
                "s",
                self.lags,
                self._horizon(),
                self.rest,
                0 if self.n_jobs in (None, -1) else int(self.n_jobs or 0),
                bar,
            )
        self._handle = self._fitted.model()
        self.summary_: dict[str, Any] = json.loads(self._fitted.summary("series"))
        self.simulated_: np.ndarray = self._fitted.simulated()
        return self

    def simulate(self, u: Any, y0: Any) -> np.ndarray:
        """A free run over the inputs `u`, from the outputs `y0` of the first rows: (rows, outputs).

        One row of `y0` is a system at rest there. Behind a row where the run left all bounds there is NaN.
        """
        initial, _ = _signals(y0, "y")
        inputs, _ = _signals(u, "u", len(initial))
        outputs, _, _ = self._model().simulate(inputs, initial)
        return np.asarray(outputs)

    def predict(self, u: Any, y: Any) -> np.ndarray:
        """Predictions of each row from the measured rows before it: (rows, outputs), NaN for the first ones."""
        outputs, _ = _signals(y, "y")
        inputs, _ = _signals(u, "u", len(outputs))
        return np.asarray(self._model().predict(inputs, outputs))

    def poles(self) -> dict[str, np.ndarray]:
        """The poles z of the local linear models, by where they hold: leaves of the tree, or points of rest."""
        return {where: np.array(poles) for where, poles in self._model().poles()}

    @property
    def lags_(self) -> str:
        lags: str = self._model().lags()
        return lags

    @property
    def sample_time_(self) -> float:
        return float(self._model().sample_time())

    @property
    def is_stable_(self) -> bool:
        """Whether no run over a held-out stretch left its bounds."""
        return bool(self._model().is_stable())

    def save(self, path: "str | os.PathLike[str]", *, accept_unstable: bool = False) -> None:
        """Writes the model as a file of ``llmt simulate``.

        Raises
        ------
        ValueError
            If the model is unstable, unless that is accepted.
        """
        if not self.is_stable_ and not accept_unstable:
            raise ValueError("save: a run over a held-out stretch left all bounds; accept_unstable=True writes the model")
        _core.write_file(os.fsencode(path), self._model().to_json())

    @classmethod
    def load(cls, path: "str | os.PathLike[str]") -> Self:
        """The model of a file of ``save`` or ``llmt fit --lags``."""
        model = cls()
        model._handle = _core.DynamicModel.parse(Path(path).read_text(encoding="utf-8"), os.fspath(path))
        return model

    def to_c(self, name: str = "model") -> tuple[str, str]:
        """Source and header of C99: ``NAME_start`` and ``NAME_step`` with a state; the bytes of `simulate`."""
        source, header = self._model().c_source(name)
        return source, header

    def to_onnx(self, *args: Any, **keywords: Any) -> NoReturn:
        """Raises ValueError: a graph of ONNX has no state. `to_c` has one."""
        raise ValueError("to_onnx: a system that moves has a state, which a graph of ONNX has not; to_c writes it as C")

    def to_sql(self, *args: Any, **keywords: Any) -> NoReturn:
        """Raises ValueError: a SELECT has no state. `to_c` has one."""
        raise ValueError("to_sql: a system that moves has a state, which a SELECT has not; to_c writes it as C")

    def __str__(self) -> str:
        if not hasattr(self, "_fitted"):
            return repr(self)
        text: str = self._fitted.text("series", 100)
        return text

    def __repr__(self) -> str:
        return f"DynamicLocalLinearTreeRegressor(lags={self.lags!r}, purpose={self.purpose!r}, rest={self.rest!r})"

    def _model(self) -> Any:
        if not hasattr(self, "_handle"):
            raise ValueError("this model is not fitted yet; call fit(u, y) first")
        return self._handle

    def _horizon(self) -> int:
        if self.purpose == "simulation":
            return 0
        if self.purpose == "prediction":
            return 1
        if isinstance(self.purpose, int) and not isinstance(self.purpose, bool) and self.purpose > 0:
            return self.purpose
        raise ValueError(f"purpose is {self.purpose!r}, it must be 'simulation', 'prediction' or a number of rows")


def _signals(values: Any, name: str, rows: int = 0) -> tuple[np.ndarray, list[str]]:
    """Signals as columns, and their names: those of a frame, or `name`, or name1, name2, ..."""
    if values is None:
        return np.empty((rows, 0)), []
    columns = getattr(values, "columns", None)
    of_series = getattr(values, "name", None)
    array = np.asarray(values, dtype=float)
    if array.ndim == 1:
        array = array.reshape(-1, 1)
    if array.ndim != 2:
        raise ValueError(f"{name} has {array.ndim} dimensions; it has rows, or rows and columns")
    if columns is not None:
        names = [str(column) for column in columns]
    elif of_series is not None and array.shape[1] == 1:
        names = [str(of_series)]
    else:
        names = [name] if array.shape[1] == 1 else [f"{name}{k + 1}" for k in range(array.shape[1])]
    return array, names


def _record_begins(records: Any, rows: int) -> list[int]:
    if records is None:
        return []
    labels = list(records)
    if len(labels) != rows:
        raise ValueError(f"records has {len(labels)} labels, y has {rows} rows")
    begins = [row for row in range(rows) if row == 0 or labels[row] != labels[row - 1]]
    seen: set[Any] = set()
    for row in begins:
        if labels[row] in seen:
            raise ValueError(f"records: {labels[row]!r} goes on in row {row}, behind another record; sort the rows")
        seen.add(labels[row])
    return begins


def _step_of(values: Any, begins: list[int]) -> float:
    """The step of a frame's index in seconds; 1 where there is none."""
    index = getattr(values, "index", None)
    if index is None or callable(index) or len(index) < 2:
        return 1.0
    times = np.asarray(index)
    if times.dtype.kind == "M":
        times = times.astype("datetime64[ns]").astype(np.int64) / 1e9
    elif times.dtype.kind not in "iuf":
        return 1.0
    steps = np.diff(times.astype(float))
    inside = np.ones(len(steps), dtype=bool)
    inside[[begin - 1 for begin in begins if begin > 0]] = False
    step = float(np.median(steps[inside]))
    wrong = np.flatnonzero(inside & ~(np.abs(steps - step) <= 0.01 * abs(step)))
    if not step > 0 or len(wrong):
        row = int(wrong[0]) + 1 if len(wrong) else 1
        raise ValueError(f"y: the index does not rise in equal steps at row {row}; give dt, or put the rows on a grid")
    return step
