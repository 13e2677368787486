"""What a simulation lacks, from measurements beside it."""

from __future__ import annotations

import json
from collections.abc import Callable, Mapping, Sequence
from typing import Any

import numpy as np

from llmt._found import Found
from llmt._frames import table_of
from llmt._given import (
    derivatives_of,
    in_order,
    in_order_of_outputs,
    in_time,
    is_table,
    maker_like,
    matrix_of,
    noise_of,
    own_terms_of,
    parameters_of,
    predictor_of,
)
from llmt._results import Findings, draw_points, html_table, names, number
from llmt._signals import Signals


class Missing(Findings):
    """The terms that a simulation lacks. ``print`` shows the page of ``llmt discover``."""

    _of_effect = ("name", "location", "output", "formula", "confirmed")
    _sizes = ("share",)
    _titles = {"formula": "term"}

    def __init__(self, made: Mapping[str, Any], question: dict[str, Any], kind: Any, callables: dict[str, Any]) -> None:
        super().__init__(made["text"], json.loads(made["json"]))
        self._question = question
        self._kind = kind  # an empty table of the kind that was given
        self._callables = callables
        self._found: str = made["state"]
        self._measured: np.ndarray = question.pop("measured")
        self._time: np.ndarray | None = question.pop("time")
        self.before: np.ndarray = made["before"]
        """The simulation at the measured rows, its own parameters adjusted; rows x outputs."""
        self.corrected: np.ndarray = made["corrected"]
        """The same with the terms found."""
        self.held_out: np.ndarray = np.array(made["held_out"], dtype=int)
        """The rows that took no part in the search."""

    @property
    def parameters(self) -> Any:
        """The parameters of the simulation, fitted together with the terms. Those that the rows cannot tell apart are
        one row, "mass + armature". ``changed``: by more than chance."""
        return table_of(
            [
                {
                    "name": value["name"],
                    "nominal": value["nominal"],
                    "value": value["value"],
                    "change": value["change"],
                    "standard_error": value["std_error"],
                    "unit": value["unit"],
                    "changed": value["changed"],
                }
                for value in self._data["parameters"]
            ],
            ("name", "nominal", "value", "change", "standard_error", "unit", "changed"),
        )

    def predict(self, inputs: Any, simulated: Any = None) -> Any:
        """The simulation with the terms found, at other inputs: an array of their rows, or rows x outputs if there are
        several. ``simulated``: its outputs there, where no callable was given."""
        from llmt import _core

        if any("inner_state" in effect and effect["expression"] is None for effect in self._data["effects"]):
            raise ValueError("what was found depends on the past of a run: correct(inputs, simulated, time=...) has it")
        rows, columns = matrix_of(inputs, "inputs", "x")
        rows = in_order(rows, columns, self._question["input_names"], is_table(inputs))
        callable_ = self._callables["simulate"]
        if (simulated is None) == (callable_ is None):
            raise ValueError(
                "simulated is needed: the simulation is known by its outputs alone"
                if callable_ is None
                else "simulated is not needed: the simulation was given as a callable"
            )
        tabulated = None if simulated is None else matrix_of(simulated, "simulated", "y")[0]
        if tabulated is not None and tabulated.shape != (len(rows), len(self._question["output_names"])):
            raise ValueError(f"simulated has the shape {tabulated.shape}, inputs has {len(rows)} rows")
        result = _core.corrected(
            **self._question,
            predict=predictor_of(callable_, self._kind, self._question, self._callables["parameters"]),
            terms=own_terms_of(self._callables["terms"], self._kind, self._question),
            state=self._found,
            elsewhere=np.ascontiguousarray(rows),
            tabulated=tabulated,
        )
        return result[:, 0] if result.shape[1] == 1 else result

    def correct(self, inputs: Any, simulated: Any, **options: Any) -> Any:
        """``simulated`` with what was found, at other inputs: :meth:`Found.correct`. It needs no callable, and serves
        after :func:`load_found` as well."""
        return Found(self._data).correct(inputs, simulated, **options)

    def code(self, language: str = "python") -> str:
        """What was found as a function: :meth:`Found.code`."""
        return Found(self._data).code(language)

    def mujoco(self, spec: Any) -> tuple[Any, Callable[[Any, Any], None] | None]:
        """A copy of a specification of MuJoCo with what was found, and a callback: :func:`llmt.mujoco.apply`."""
        from llmt.mujoco import apply

        return apply(self, spec)

    def plot(self, ax: Any = None) -> Any:
        """Draws measured minus simulated on the rows set aside (all rows without any), of the first output: with the
        simulation's own parameters adjusted, and with the terms. The figures are those of the page. Returns the axes of
        matplotlib, ``ax`` if it is given."""
        rows = self.held_out if len(self.held_out) else np.arange(len(self.before))
        of_page = self._data["gap"]["outputs"][0]
        adjusted = "parameters alone" if self._data["parameters"] else "before"
        gaps = {}
        for label, key, values in ((adjusted, "before", self.before), ("with terms", "after", self.corrected)):
            gap = self._measured[rows, 0] - values[rows, 0]
            size = np.sqrt(np.mean(gap**2)) if of_page[key] is None else of_page[key]
            gaps[f"{label}, root mean square {size:.3g}"] = gap
        y = f"measured - simulated {self._question['output_names'][0]}"
        title = "Rows set aside" if len(self.held_out) else "All rows"
        at = rows if self._time is None else self._time[rows]
        ax = draw_points(ax, at, gaps, x="row" if self._time is None else "time", y=y, title=title)
        ax.axhline(0.0, linewidth=0.5, color="black")
        return ax

    @property
    def summary(self) -> str:
        """The verdict in a sentence."""
        line: str = next(line for line in self._text.split("\n") if line.startswith("VERDICT: "))
        return line

    def _html_tables(self) -> list[str]:
        gaps = [[g["output"], g["before"], g["after"], g["noise_floor"]] for g in self._data["gap"]["outputs"]]
        return [
            self._effects_html(),
            html_table(["output", "gap before", "after", "noise"], gaps),
        ]


def _search(
    simulate: Any,
    parameters: tuple[list[dict[str, Any]], bool],
    inputs: Any,
    simulated: Any,
    measured: Any,
    *,
    jacobian: Any = None,
    allow: Any,
    order: str,
    time: Any,
    groups: Any,
    signals: Signals | None,
    input_noise: Mapping[str, float] | str | None,
    only: Any,
    without: Any,
    terms: Mapping[str, Any] | None,
    own_terms_only: bool,
    held_out: float,
    seed: int,
    progress: Any,
) -> Missing:
    from llmt import _core

    rows, columns = matrix_of(inputs, "inputs", "x")
    values, outputs = matrix_of(measured, "measured", "y")
    if len(values) != len(rows):
        raise ValueError(f"inputs has {len(rows)} rows, measured has {len(values)}")
    if order and order not in columns:
        raise ValueError(f"order is {order!r}, must be a column of inputs: {', '.join(columns)}")
    if own_terms_only and not terms:
        raise ValueError("own_terms_only is about terms, which are not given")
    adjusted = names("allow", allow)
    if unknown := [word for word in adjusted if word not in ("offset", "scale")]:
        raise ValueError(f"allow is {unknown[0]!r}, must be 'offset' or 'scale'")
    kind = maker_like(inputs)(rows[:0], columns)
    question: dict[str, Any] = {
        "inputs": np.ascontiguousarray(rows),
        "input_names": columns,
        "order": order,
        "only": names("only", only),
        "without": names("without", without),
        "output_names": outputs,
        "parameters": parameters[0],
        "offset": "offset" in adjusted,
        "scale": "scale" in adjusted,
        "own_terms_only": bool(own_terms_only),
    }
    predict = predictor_of(simulate, kind, question, parameters[1])
    if predict is not None:
        start = predict(question["inputs"], [parameter["value"] for parameter in parameters[0]])
    else:
        start, found = matrix_of(simulated, "simulated", "y")
        if is_table(simulated) and is_table(measured):
            start = in_order_of_outputs(start, found, outputs)
        if start.shape != values.shape:
            raise ValueError(f"simulated has the shape {start.shape}, measured has {values.shape}")
    question["simulated"] = np.ascontiguousarray(start)
    own = dict(terms or {})
    known: Mapping[str, float] = {}
    if signals is not None:
        time = signals.time if time is None else time
        groups = signals.groups if groups is None else groups
        known = signals.noise
    instants, runs = in_time(time, groups, len(rows), bool(order))
    errors = noise_of(input_noise, columns)
    if input_noise is None and known:
        errors = [known.get(name, np.nan) for name in columns]
    made = _core.find_missing(
        **question,
        instants=instants,
        runs=runs,
        input_noise=errors,
        output_noise=[known.get(name, np.nan) for name in outputs] if known else [],
        cutoff=(signals.cutoff or 0.0) if signals is not None else 0.0,
        measured=np.ascontiguousarray(values),
        predict=predict,
        jacobian=derivatives_of(jacobian, kind, question, parameters[1]),
        terms=own_terms_of(own, kind, question),
        held_out=number("held_out", held_out, 0.0, 0.9),
        seed=number("seed", seed, 0, 2**64 - 1, whole=True),
        simulated_name="simulated" if simulate is None else getattr(simulate, "__name__", "simulate"),
        measured_name="measured",
        report=progress,
    )
    callables = {"simulate": simulate, "terms": own, "parameters": parameters[1]}
    when = np.array(instants) if instants else None
    return Missing(made, {**question, "measured": values, "time": when}, kind, callables)


def discover(
    simulate: Callable[[Any, Any], Any],
    parameters: Mapping[str, Any] | Sequence[Any] | None,
    inputs: Any,
    measured: Any,
    *,
    jacobian: Callable[[Any, Any], Any] | None = None,
    order: str = "",
    time: Any = None,
    groups: Any = None,
    signals: Signals | None = None,
    input_noise: Mapping[str, float] | str | None = None,
    only: Any = (),
    without: Any = (),
    terms: Mapping[str, Any] | None = None,
    own_terms_only: bool = False,
    held_out: float = 0.2,
    seed: int = 1,
    progress: Callable[[int, int, str], Any] | None = None,
) -> Missing:
    """Finds and names the terms that a simulation lacks, while its own parameters are adjusted.

    Parameters
    ----------
    simulate : callable
        ``simulate(parameters, inputs)`` gives the outputs of all rows of ``inputs`` at once: n values, rows x outputs,
        or a table. ``parameters`` is a dict of numbers (an array, if a list was given), ``inputs`` a table of the kind
        that was given. It is called in this thread. Derivatives by parameters are central differences.
    parameters : dict, list or None
        Start values, as numbers or :class:`Parameter`.
    inputs : table or array, n rows
        What the simulation and the terms may depend on. The columns of an array are called x0, x1, ...
    measured : table or array, n rows
        The outputs. The columns of an array are called y, or y0, y1, ...
    jacobian : callable
        ``jacobian(parameters, inputs)`` gives the derivatives of the outputs by the parameters: rows x outputs x
        parameters, or rows x parameters of one output, or a dict with those by each parameter. Default: central
        differences with a hundredth of each parameter's scale. The simulation is linearised at the parameters, and
        again at the new ones, until they settle (Gauss-Newton).
    order : str
        Column that says in which order rows were measured; by default as they stand.
    time : n numbers
        When each row was taken, in any unit, each time once in a recording, for rows of a log: they are averaged over blocks, whole stretches are set aside, and
        noise that is alike in neighbouring rows is no evidence. Smooth inputs are taken for a log without it.
    groups : n labels
        The recording that each row is of; with ``time``.
    signals : Signals
        What :func:`llmt.signals` made ``inputs`` and ``measured`` of, in the place of ``time`` and ``groups``: the noise
        of each column is known then, which bounds the answer "nothing is missing", and the simulation is filtered as
        the measured outputs were.
    input_noise : dict or "auto"
        Standard deviations of the errors of inputs, or "auto": from neighbouring rows. By default those of ``signals``,
        else "auto" for rows in time, else none.
    only, without : str or list of str
        Families of built-in terms to try alone, or to leave out.
    terms : dict
        Terms of your own: a callable of the inputs for each name, or (formula, callable).
    own_terms_only : bool
        Leave the built-in terms out, but for unknown shapes.
    held_out, seed
        Share of the rows set aside to verify, and seed of their choice.

    Raises
    ------
    ValueError
        Numbers that are not finite, shapes or names that do not fit; what ``simulate`` raises is let through.

    Examples
    --------
    >>> import numpy as np, llmt
    >>> x = np.linspace(-3.0, 3.0, 200)
    >>> noise = np.random.default_rng(1).normal(0.0, 0.02, 200)
    >>> spring = lambda p, inputs: p["k"] * inputs["x"]
    >>> found = llmt.discover(spring, {"k": 1.0}, {"x": x}, {"force": 2.0 * x + 0.3 * x**3 + noise})
    >>> found.verdict, [term["formula"] for term in found.to_dict()["effects"]]
    ('named', ['x^3'])
    """
    if not callable(simulate):
        raise TypeError(f"simulate is {simulate!r}, must be a callable; find_missing() takes the outputs themselves")
    return _search(
        simulate,
        parameters_of(parameters),
        inputs,
        None,
        measured,
        jacobian=jacobian,
        allow=(),
        order=order,
        time=time,
        groups=groups,
        signals=signals,
        input_noise=input_noise,
        only=only,
        without=without,
        terms=terms,
        own_terms_only=own_terms_only,
        held_out=held_out,
        seed=seed,
        progress=progress,
    )


def find_missing(
    inputs: Any,
    simulated: Any,
    measured: Any,
    *,
    allow: Any = (),
    order: str = "",
    time: Any = None,
    groups: Any = None,
    signals: Signals | None = None,
    input_noise: Mapping[str, float] | str | None = None,
    only: Any = (),
    without: Any = (),
    terms: Mapping[str, Any] | None = None,
    own_terms_only: bool = False,
    held_out: float = 0.2,
    seed: int = 1,
    progress: Callable[[int, int, str], Any] | None = None,
) -> Missing:
    """Finds and names the terms that a simulation lacks, from its outputs beside measured ones: ``llmt discover``.

    ``inputs``, ``simulated`` and ``measured`` have the same rows. ``allow`` is what the simulation may adjust before
    anything counts as missing: ``"offset"``, ``"scale"`` or both. The others are as for :func:`discover`.
    """
    return _search(
        None,
        ([], False),
        inputs,
        simulated,
        measured,
        allow=allow,
        order=order,
        time=time,
        groups=groups,
        signals=signals,
        input_noise=input_noise,
        only=only,
        without=without,
        terms=terms,
        own_terms_only=own_terms_only,
        held_out=held_out,
        seed=seed,
        progress=progress,
    )
