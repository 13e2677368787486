"""Machines: which coordinates they have, and which target their nominal model gives for the motion.

Every nominal model is a sum of parameters times columns, functions of the signals: `target = sum_k p_k column_k`. The
columns are the derivatives by parameters that a user gives to `llmt discover --parameters`. Units: SI, degrees Celsius.
"""

import dataclasses
from collections.abc import Callable

import numpy as np

GRAVITY = 9.81
MOTION = ("gravity", "spring", "screw", "belt")
FAMILIES = (*MOTION, "tank", "cylinder", "thermal", "vehicle", "electric")
FRICTION = ("none", "viscous", "coulomb", "both", "stribeck")


@dataclasses.dataclass
class Axis:
    """One coordinate of a machine that moves: parameters and their columns, friction that may stick apart."""

    name: str
    friction: str
    speed: float = 1.0  # of Stribeck's law
    parameters: dict = dataclasses.field(default_factory=dict)


@dataclasses.dataclass
class Machine:
    family: str
    coordinates: list  # measured and differentiated
    extras: list  # measured inputs that are not differentiated
    columns: dict  # parameter -> function of a dict of signals
    parameters: dict  # nominal values
    target_axis: int = 0
    axes: list = dataclasses.field(default_factory=list)
    angular: bool = False
    coupling: np.ndarray | None = None  # of inertias, axes x axes

    @property
    def moves(self):
        return self.family in MOTION

    def inputs(self):
        names = [d + name for name in self.coordinates for d in ("", "d", "dd")]
        return names + self.extras


def output(machine, signals, parameters):
    """The nominal model, or with true parameters the true one, at these signals."""
    return sum(value * machine.columns[name](signals) for name, value in parameters.items())


def friction_columns(law, name, speed):
    """Parameters of a law of friction and their columns; sign(0) is what the signal `hold` says of a machine at rest."""
    direction = lambda s: np.where(s["d" + name] != 0, np.sign(s["d" + name]), s.get("hold_" + name, 0.0))
    columns = {}
    if law in ("viscous", "both", "stribeck"):
        columns["b"] = lambda s: s["d" + name]
    if law in ("coulomb", "both", "stribeck"):
        columns["f"] = direction
    if law == "stribeck":
        columns["h"] = lambda s: direction(s) * np.exp(-((s["d" + name] / speed) ** 2))
    return columns


def axis_columns(family, name, law, speed):
    columns = {"J" if name.startswith("q") else "m": lambda s: s["dd" + name]}
    if family == "gravity":
        columns["G"] = lambda s: np.cos(s[name])
    if family == "spring":
        columns["K"] = lambda s: s[name]
    if family == "screw":
        columns["W"] = lambda s: np.ones_like(s[name])
    return columns | friction_columns(law, name, speed)


def coupled(own, other, angular):
    """The column of an inertia that couples two axes: absolute angles of a planar chain, or slides."""
    if not angular:
        return lambda s: s["dd" + other]
    return lambda s: (
        np.cos(s[own] - s[other]) * s["dd" + other] + np.sin(s[own] - s[other]) * s["d" + other] ** 2
    )


def names_of_axes(family, count):
    letter = "q" if family == "gravity" else "x"
    return [letter] if count == 1 else [f"{letter}{k + 1}" for k in range(count)]


def other_machine(family):
    """Coordinates, extras and columns of the machines that are no mechanisms."""
    if family == "tank":
        return ["h"], ["T"], {"A": lambda s: s["dh"], "k": lambda s: np.sqrt(np.maximum(s["h"], 0))}
    if family == "cylinder":
        return ["x", "p"], [], {"A": lambda s: s["dx"], "C": lambda s: s["dp"], "k": lambda s: s["p"]}
    if family == "thermal":
        radiation = lambda s: 1e-8 * ((s["T"] + 273.15) ** 4 - (s["Ta"] + 273.15) ** 4)
        return ["T"], ["Ta", "fan"], {"C": lambda s: s["dT"], "h": lambda s: s["T"] - s["Ta"], "r": radiation}
    if family == "vehicle":
        mass = lambda s: s["dv"] + GRAVITY * s["grade"]
        return ["v"], ["grade", "wind"], {"m": mass, "c0": lambda s: np.ones_like(s["v"]), "c2": lambda s: s["v"] ** 2}
    return ["q", "i"], [], {"R": lambda s: s["i"], "L": lambda s: s["di"], "Ke": lambda s: s["dq"]}


# Of the signals of such machines: middle and amplitude of each coordinate and extra.
LEVELS = {
    "tank": {"h": (1.0, 0.6), "T": (25.0, 12.0)},
    "cylinder": {"x": (0.0, 0.3), "p": (6.0, 4.0)},
    "thermal": {"T": (80.0, 35.0), "Ta": (20.0, 5.0), "fan": (3.0, 2.0)},
    "vehicle": {"v": (20.0, 12.0), "grade": (0.0, 0.05), "wind": (0.0, 8.0)},
    "electric": {"q": (0.0, 3.0), "i": (0.0, 4.0)},
}
RATES = {
    "gravity": (100, 2000), "spring": (100, 2000), "screw": (100, 2000), "belt": (100, 2000), "tank": (1, 10),
    "cylinder": (50, 1000), "thermal": (1, 10), "vehicle": (10, 100), "electric": (200, 2000),
}


def sized(rng, columns, signals, scale):
    """Parameters, log-uniform over a decade around the values at which all parts of the target are alike."""
    return {
        name: float(scale * 10 ** rng.uniform(-0.9, 0.1) / max(np.sqrt(np.mean(column(signals) ** 2)), 1e-12))
        for name, column in columns.items()
    }
