"""Models of systems that move."""

import json
import os
from pathlib import Path
from typing import Any, NoReturn, Self

import numpy as np

from . import _core
from ._progress import Bar
from ._regressor import share
from ._series import record_begins, signals, step_of


_PARAMETERS = ("lags", "delay", "purpose", "rest", "n_jobs")


class DynamicLocalLinearTreeRegressor:
    """A model of a system that moves, learned from records and chosen by free runs on stretches that are held out.

    The next outputs are a polynomial of earlier outputs and inputs plus a local linear model tree of the same values
    (docs/dynamics.md). After its first rows a run uses nothing that was measured.

    Parameters
    ----------
    lags : str, default="auto"
        The earlier values that the model looks at, in rows: ``"y:1-3,u:0-4"``, of outputs from 1 on. ``"auto"``: found
        on held-out stretches.
    delay : str or None, default=None
        Dead time of inputs in rows, ``"u:3"``, from which their lags count. ``"auto"``: found on held-out stretches, 40
        rows at most. None: chosen lags find up to 10 rows, given lags have none.
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
    held_out_ : ndarray, (rows, outputs)
        The same by models that were learned without the stretch of the row; runs begin anew in each stretch.

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
        delay: str | None = None,
        purpose: "str | int" = "simulation",
        rest: str = "auto",
        n_jobs: int | None = None,
    ) -> None:
        self.lags = lags
        self.delay = delay
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
        outputs, output_names = signals(y, "y")
        inputs, input_names = signals(u, "u", len(outputs))
        begins = record_begins(records, len(outputs))
        if dt is None:
            dt = step_of(y, begins)
        with Bar() as bar:
            fitted = _core.fit_system(
                inputs,
                outputs,
                input_names,
                output_names,
                begins,
                float(dt),
                "s",
                self.lags,
                self._dead_times(),
                self._horizon(),
                self.rest,
                0 if self.n_jobs in (None, -1) else int(self.n_jobs or 0),
                bar,
            )
        self._handle = fitted.model()
        self._text: str = fitted.text("series", 100)
        self.summary_: dict[str, Any] = json.loads(fitted.summary("series"))
        self.simulated_: np.ndarray = fitted.simulated()
        self.held_out_: np.ndarray = fitted.held_out()
        return self

    def simulate(self, u: Any, y0: Any) -> np.ndarray:
        """A free run over the inputs `u`, from the outputs `y0` of the first rows: (rows, outputs).

        One row of `y0` is a system at rest there. Behind a row where the run left all bounds there is NaN.
        """
        initial, _ = signals(y0, "y")
        inputs, _ = signals(u, "u", len(initial))
        outputs, _, _ = self._model().simulate(inputs, initial)
        return np.asarray(outputs)

    def simulate_interval(self, u: Any, y0: Any, coverage: float = 0.9) -> np.ndarray:
        """The band about the run of `simulate`, in which the share `coverage` of measured values lies.

        It is as wide as the errors of runs over held-out stretches were, so many rows after they began.

        Returns
        -------
        ndarray, (rows, 2, outputs)
            Lower and upper ends. The rows of `y0` have no width.

        Raises
        ------
        ValueError
            If the file of the model has no held-out errors, or too few for the coverage.
        """
        level = share("coverage", coverage)
        if not self._model().has_band():
            raise ValueError("simulate_interval: the model has no errors of held-out runs; fit again")
        initial, _ = signals(y0, "y")
        inputs, _ = signals(u, "u", len(initial))
        lower, upper = self._model().band(inputs, initial, level)
        return np.stack([np.asarray(lower), np.asarray(upper)], axis=1)

    def local_models(self) -> list[dict[str, Any]]:
        """The linear models near the leaves of the tree, or near points of rest.

        Returns
        -------
        list of dict
            ``where``; ``poles``: z, complex; ``steady_gain``: (outputs, inputs), NaN where an output integrates;
            ``settling_time``: until all step responses stay within 2 %, infinite where one does not settle;
            ``step_response``: (inputs, outputs, rows), at the times ``arange(rows) * sample_time_``; ``stable``.
        """
        models: list[dict[str, Any]] = []
        for local in json.loads(self._model().local_models()):
            settling = local["settling_time"]
            models.append(
                {
                    "where": local["where"],
                    "poles": np.array([complex(pole["re"], pole["im"]) for pole in local["poles"]]),
                    "steady_gain": np.array(local["steady_gain"], dtype=float),
                    "settling_time": np.inf if settling is None else settling,
                    "step_response": np.array(local["step_response"], dtype=float),
                    "stable": local["stable"],
                }
            )
        return models

    def static_curve(self, input: "str | int" = 0, points: int = 41) -> dict[str, np.ndarray]:
        """Where the model comes to rest, over the training range of one input, the others in the middle of theirs.

        Parameters
        ----------
        input : str or int, default=0
            The input that is varied.
        points : int, default=41
            Values of the input, 2 or more.

        Returns
        -------
        dict of ndarray
            ``input`` and ``outputs`` (states, outputs) of each state of rest, of which one value of the input may have
            several; ``stable``, ``inside`` (the training ranges) and ``at_stop`` of each; ``none``: values of the input
            at which no state of rest was found. Where an output adds up there are none at all.
        """
        names = self._model().inputs()
        if isinstance(input, str) and input not in names:
            raise ValueError(f"static_curve: there is no input {input!r}; there are {names}")
        index = names.index(input) if isinstance(input, str) else int(input)
        inputs, outputs, stable, inside, at_stop, none = self._model().static_curve(index, int(points))
        return {
            "input": np.asarray(inputs)[:, 0],
            "outputs": np.asarray(outputs),
            "stable": np.array(stable, dtype=bool),
            "inside": np.array(inside, dtype=bool),
            "at_stop": np.array(at_stop, dtype=bool),
            "none": np.array(none, dtype=float),
        }

    def predict(self, u: Any, y: Any) -> np.ndarray:
        """Predictions of each row from the measured rows before it: (rows, outputs), NaN for the first ones."""
        outputs, _ = signals(y, "y")
        inputs, _ = signals(u, "u", len(outputs))
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
        return getattr(self, "_text", repr(self))

    def get_params(self, deep: bool = True) -> dict[str, Any]:
        """The parameters, as scikit-learn's ``clone`` takes them."""
        return {name: getattr(self, name) for name in _PARAMETERS}

    def set_params(self, **parameters: Any) -> Self:
        """Sets parameters by their names; the fitted model stays until the next `fit`."""
        for name, value in parameters.items():
            if name not in _PARAMETERS:
                raise ValueError(f"set_params: there is no parameter {name!r}; there are {', '.join(_PARAMETERS)}")
            setattr(self, name, value)
        return self

    def __getstate__(self) -> dict[str, Any]:
        state = self.__dict__.copy()
        if "_handle" in state:
            state["_handle"] = state["_handle"].to_json()
        return state

    def __setstate__(self, state: dict[str, Any]) -> None:
        self.__dict__.update(state)
        if "_handle" in state:
            self._handle = _core.DynamicModel.parse(state["_handle"], "the pickled model")

    def __repr__(self) -> str:
        given = {name: getattr(self, name) for name in _PARAMETERS if name != "n_jobs"}
        words = ", ".join(f"{name}={value!r}" for name, value in given.items() if value is not None)
        return f"DynamicLocalLinearTreeRegressor({words})"

    def _model(self) -> Any:
        if not hasattr(self, "_handle"):
            raise ValueError("this model is not fitted yet; call fit(u, y) first")
        return self._handle

    def _dead_times(self) -> str:
        if self.delay is None or isinstance(self.delay, str):
            return self.delay or ""
        raise TypeError(f"delay is {self.delay!r}, it must be a text such as 'u:3', 'auto', or None")

    def _horizon(self) -> int:
        if self.purpose == "simulation":
            return 0
        if self.purpose == "prediction":
            return 1
        if isinstance(self.purpose, int) and not isinstance(self.purpose, bool) and self.purpose > 0:
            return self.purpose
        raise ValueError(f"purpose is {self.purpose!r}, it must be 'simulation', 'prediction' or a number of rows")
