"""From a log of positions and torques to rows that a model of the motion can be compared with."""

from __future__ import annotations

import json
from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np

from llmt._results import Result, html_table, names, number
from llmt.tables.named import columns_of


class Signals(Result):
    """Rows of filtered signals and their derivatives. ``print()`` says what was done."""

    def __init__(
        self,
        made: Mapping[str, Any],
        table: Any,
        inputs: Any,
        torques: Any,
        time: np.ndarray,
        groups: np.ndarray | None,
    ) -> None:
        super().__init__(made["text"], json.loads(made["json"]))
        self.table = table
        """The rows: group, time, positions, velocities, accelerations, torques, columns kept. A table of the kind that
        was given."""
        self.inputs = inputs
        """Positions, velocities, accelerations and columns kept alone."""
        self.torques = torques
        """The torques alone."""
        self.time = time
        """In s, of each row: ``time`` of :func:`llmt.discover`."""
        self.groups = groups
        """The run of each row, or None: ``groups`` of :func:`llmt.discover`."""
        self.rows: np.ndarray = np.array(made["rows"], dtype=int)
        """The row of the log at the time of each row."""

    @property
    def noise(self) -> dict[str, float]:
        """Of each column of positions, velocities, accelerations and torques: the standard deviation that white noise
        of the log leaves in it."""
        noise: dict[str, float] = self._data["noise"]
        return noise

    @property
    def cutoff(self) -> float | None:
        """Of the filter, in Hz, if the rows are dense enough to filter a simulation alike; else None."""
        return self._data["cutoff_hz"] if self._data["dense"] else None

    def _html_tables(self) -> list[str]:
        in_log = self._data["noise_in_log"]
        return [
            html_table(["column", "noise"], [[name, in_log.get(name, value)] for name, value in self.noise.items()])
        ]


def _like(given: Any, columns: Mapping[str, Any]) -> Any:
    """A table of the kind that was given."""
    if hasattr(given, "iloc"):
        import pandas

        return pandas.DataFrame(columns)
    if hasattr(given, "get_columns"):
        import polars

        return polars.DataFrame(columns)
    if hasattr(given, "__arrow_c_stream__"):
        import pyarrow

        return pyarrow.table(columns)
    return dict(columns)


def _number(value: Any, name: str, row: int) -> float:
    try:
        result = float("nan") if value is None or isinstance(value, (str, bytes)) else float(value)
    except (TypeError, ValueError):
        result = float("nan")
    if not np.isfinite(result):
        shown = repr(value) if isinstance(value, str) else str(value)
        raise ValueError(f"log, row {row}: column {name!r} is {shown}, must be a finite number")
    return result


def _numbers(columns: Mapping[str, Any], wanted: list[str], rows: int) -> np.ndarray:
    made = np.empty((len(wanted), rows))
    for k, name in enumerate(wanted):
        cells = columns[name]
        if isinstance(cells, np.ndarray) and cells.dtype.kind == "f" and np.isfinite(cells).all():
            made[k] = cells
        else:
            made[k] = [_number(value, name, row) for row, value in enumerate(cells)]
    return made


def signals(
    log: Any,
    *,
    position: str | Sequence[str],
    cutoff: float,
    torque: str | Sequence[str] = (),
    time: str = "",
    rate: float | None = None,
    standstill: float | Sequence[float] | None = None,
    every: int | None = None,
    independent: bool = False,
    group: str = "",
    keep: str | Sequence[str] = (),
) -> Signals:
    """Filters and differentiates a log: ``llmt signals``.

    One low pass without delay for all signals; velocities ``d`` + position and accelerations ``dd`` + position are
    derivatives through the same filter, so that equations of motion hold between the columns. The gain of the filter
    is exp(-x) (1 + x + x^2/2 + x^3/6), x proportional to the square of the frequency, and 1/sqrt(2) at the cutoff.

    Parameters
    ----------
    log : table
        A DataFrame of pandas or polars, a table of pyarrow, or a dict of columns; rows in the order of time.
    position, torque : str or list of str
        Columns to filter and differentiate, and columns to filter alone.
    cutoff : float
        In Hz, at most a quarter of the sampling rate.
    time : str
        Column of the time in s. Gaps split a run, jitter is interpolated.
    rate : float
        Samples per second, instead of ``time``; the time is then called ``t``.
    standstill : float or list of float
        Rows below this speed of a position are left out, 0: none. By default none are; with ``independent`` the speed is
        found from the noise and the filter.
    every : int
        Samples from one row to the next. By default a twelfth of those that make white noise of the log independent, so
        that :func:`llmt.discover` can filter a simulation at these rows alike (``signals`` of it).
    independent : bool
        Rows whose noise is independent, without standstill and reversals: for a least squares fit of your own.
    group : str
        Column that says which run a row belongs to.
    keep : str or list of str
        Columns to take over as they stand at the same time.

    Raises
    ------
    ValueError
        Values that are not finite, times that do not increase, uneven sampling (with the row), a log shorter than the
        filter, names that come twice.

    Examples
    --------
    >>> import numpy as np, llmt
    >>> t = np.arange(0.0, 8.0, 0.002)
    >>> log = {"t": t, "q": np.sin(t), "u": 3.0 * np.sin(t)}
    >>> made = llmt.signals(log, time="t", position="q", torque="u", cutoff=10.0)
    >>> list(made.table)
    ['t', 'q', 'dq', 'ddq', 'u']
    >>> bool(np.abs(made.table["dq"] - np.cos(made.table["t"])).max() < 1e-6)
    True
    """
    from llmt import _core

    columns = columns_of(log, "log")
    positions, torques, kept = names("position", position), names("torque", torque), names("keep", keep)
    if bool(time) == (rate is not None):
        raise ValueError("either time, a column, or rate, in Hz, is needed: when the rows were recorded")
    if not positions:
        raise ValueError("position names no column")
    for name in [*positions, *torques, *kept, *([time] if time else []), *([group] if group else [])]:
        if name not in columns:
            raise ValueError(f"log has no column {name!r}; there are {', '.join(columns)}")
    rows = len(next(iter(columns.values())))
    if rate is not None:
        instants = np.arange(rows) / number("rate", rate, 5e-324, 1e300)
    else:
        instants = _numbers(columns, [time], rows)[0]
    given: list[float] = []
    if standstill is not None:
        speeds = [standstill] if np.ndim(standstill) == 0 else list(standstill)  # type: ignore[arg-type]
        given = [number("standstill", speed, 0.0, 1e300) for speed in speeds]
    made = _core.signals(
        time=instants,
        positions=_numbers(columns, positions, rows).T,
        torques=_numbers(columns, torques, rows).T,
        runs=[str(value) for value in columns[group]] if group else [],
        time_name=time or "t",
        position_names=positions,
        torque_names=torques,
        group=group,
        kept=kept,
        cutoff=number("cutoff", cutoff, 5e-324, 1e300),
        standstill=given,
        every=0 if every is None else number("every", every, 1, 2**31, whole=True),
        independent=bool(independent),
    )
    taken = made["rows"]
    whole: dict[str, Any] = {}
    values = iter(made["values"].T)
    for name in made["names"][: len(made["names"]) - len(made["constants"])]:
        if name == group or name in kept:
            whole[name] = np.array([columns[name][row] for row in taken])
        else:
            whole[name] = np.ascontiguousarray(next(values))
    instant = time or "t"
    inputs = {name: column for name, column in whole.items() if name not in (*torques, instant, group)}
    forces = {name: whole[name] for name in torques}
    return Signals(made, _like(log, whole), _like(log, inputs), _like(log, forces), whole[instant], whole.get(group))
