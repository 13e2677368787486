"""Small tables and a robot to try things with. All are made up, so that the truth is known; docs/samples says how.

>>> from llmt import LocalLinearTreeRegressor, samples
>>> X, y = samples.heat_pump()
>>> LocalLinearTreeRegressor().fit(X, y).predict(X).shape
(600,)
"""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from llmt.robotics import Robot

__all__ = ["arm", "arm_measured", "arm_true", "heat_pump", "path"]


def path(name: str) -> Path:
    """The file of a sample: ``heat_pump.csv``, ``arm.yaml``, ``arm.urdf``, ``arm_true.yaml``, ``arm_measured.csv``.

    Raises FileNotFoundError, which lists the samples, for another name.
    """
    folder = Path(__file__).parent
    there = sorted(file.name for file in folder.iterdir() if file.suffix in (".csv", ".urdf", ".yaml"))
    if name not in there:
        raise FileNotFoundError(f"there is no sample {name!r}; there are {', '.join(there)}")
    return folder / name


def heat_pump() -> tuple[Any, Any]:
    """600 rows of a heat pump: X with ``outdoor_C``, ``flow_C``, ``load_percent``, ``humidity_percent`` and
    ``weekday``, a word; y the coefficient of performance, ``cop``.

    Three regimes meet abruptly: below -7 degrees a backup heater helps, in humid air below 2 degrees the evaporator is
    defrosted, and above 85 % load the compressor is less efficient. Noise has a standard deviation of 0.08. The weekday
    does nothing. X is a DataFrame of pandas and y a Series where pandas is installed, else both are arrays.
    """
    from llmt.robotics._csv import frame_of

    table = frame_of(path("heat_pump.csv").read_text(encoding="utf-8"))
    y = table.pop("cop")
    if isinstance(table, dict):
        import numpy as np

        return np.column_stack([column.astype(object) for column in table.values()]), y
    return table, y


def arm() -> Robot:
    """A six-axis arm as its maker describes it."""
    from llmt.robotics import robot

    return robot(path("arm.yaml"))


def arm_measured() -> Any:
    """150 measured positions of the arm as it is, with noise of 20 um: ``q1_rad`` ... ``q6_rad``, ``x_mm``, ``y_mm``,
    ``z_mm``. A DataFrame where pandas is installed, else a dict of arrays."""
    from llmt.robotics._csv import frame_of

    return frame_of(path("arm_measured.csv").read_text(encoding="utf-8"))


def arm_true() -> Robot:
    """The arm that was measured: its geometry is some tenths of a millimetre off, and two joints are elastic."""
    from llmt.robotics import robot

    return robot(path("arm_true.yaml"))
