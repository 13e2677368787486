"""Inner states: what the target owes to the past of a run. The nominal model has none of them.

`missing(name, run, strength, constants)` is what the target has beyond the nominal model, on the fine grid of a `Fine`
run. Linear states are integrated exactly for signals that are straight lines between the grid's points.
"""

import dataclasses

import numpy as np
from scipy import signal

from .structure import MOTION

OF_FAMILY = {
    "tank": ("late", "ahead", "actuator", "filling"),
    "cylinder": ("late", "ahead", "actuator", "filling"),
    "thermal": ("late", "ahead", "actuator", "heat"),
    "vehicle": ("late", "ahead", "actuator", "heat", "swing"),
    "electric": ("late", "ahead", "actuator", "sensor", "heat"),
}
OF_MOTION = ("elastic", "elastic", "late", "ahead", "actuator", "sensor", "heat", "swing", "filling")


def names(machine):
    return OF_MOTION if machine.moves else OF_FAMILY[machine.family]


@dataclasses.dataclass
class Fine:
    """Signals of a run on a fine grid, and the target of the true model without the state."""

    t: np.ndarray
    signals: dict
    target: np.ndarray
    machine: object
    parameters: dict
    sample: float  # s, of the log
    fastest: float  # Hz, of the reference


def linear_filter(numerator, denominator, x, step):
    """Response to x from rest at x[0], exact for an x that is linear between samples."""
    order = len(denominator) - 1
    powers = step ** -np.arange(order, -1, -1.0)  # the unit of time is a step, which keeps the numbers near 1
    b = np.pad(numerator, (order + 1 - len(numerator), 0)) * powers
    a = np.array(denominator) * powers
    b, a = b / a[0], a / a[0]
    matrix = np.eye(order, k=1)
    matrix[-1] = -a[:0:-1]
    drive = np.zeros((order, 1))
    size = np.abs(b).max()
    drive[-1] = size
    output = ((b[1:] - b[0] * a[1:])[::-1] / size)[None, :]  # controllable canonical form
    found = signal.cont2discrete((matrix, drive, output, np.array([[b[0]]])), 1.0, method="foh")[:4]
    b, a = signal.ss2tf(*found)
    still = numerator[-1] / denominator[-1] * x[0]
    return still + signal.lfilter(b.ravel(), a, x - x[0])


def lagged(x, tau, step, start=None):
    """First-order lag of x. It begins settled, or at `start`."""
    y = linear_filter([1.0], [tau, 1.0], x, step)
    if start is not None:
        y = y + (start - x[0]) * np.exp(-np.arange(len(x)) * step / tau)
    return y


def shifted(run, seconds):
    """The target that is logged `seconds` late."""
    return np.interp(run.t - seconds, run.t, run.target)


def elastic(run, compliance, constants):
    """A spring between the measured motor and a share of the inertia, with all that the link carries behind it."""
    machine, step = run.machine, run.t[1] - run.t[0]
    name = machine.coordinates[machine.target_axis]
    inertia = constants["share"] * run.parameters["J" if "J" in run.parameters else "m"]
    q, ddq = run.signals[name], run.signals["dd" + name]
    carried = {k: run.parameters[k] for k in ("G", "K") if k in run.parameters}
    load = lambda x: sum(p * machine.columns[k]({name: x}) for k, p in carried.items()) if carried else 0 * x
    stiffness = 1 / compliance
    damping = 2 * constants["zeta"] * np.sqrt(stiffness * inertia)
    twist, at_rest = np.zeros_like(q), load(q)
    for _ in range(25):
        need = -(inertia * ddq + load(q + twist))
        now = linear_filter([1.0], [inertia, damping, stiffness], need, step)
        change = np.sqrt(np.mean((now - twist) ** 2))
        twist = now
        if change < 1e-9 * np.sqrt(np.mean(twist**2)) or not np.isfinite(change):
            break
    speed = linear_filter([1.0, 0.0], [inertia, damping, stiffness], need, step)
    acceleration = (need - damping * speed - stiffness * twist) / inertia
    return inertia * acceleration + load(q + twist) - at_rest


def power_and_lever(run):
    """What warms the machine, and what grows or falls with its temperature."""
    machine, s = run.machine, run.signals
    if machine.family == "electric":
        return s["i"] ** 2, s["i"]
    if machine.family == "vehicle":
        return s["v"] ** 2, -np.ones_like(s["v"])
    speed = s["d" + machine.coordinates[machine.target_axis]]
    return speed**2, -speed


def heat(run, strength, constants):
    step, tau = run.t[1] - run.t[0], constants["tau"]
    if run.machine.family == "thermal":  # a second mass beside the one that is measured
        T = run.signals["T"]
        return strength * (T - lagged(T, tau, step, T[0]))
    power, lever = power_and_lever(run)
    return strength * lagged(power / constants["power"], tau, step, 0.0) * lever


def filling(run, strength, constants):
    machine, s, step, tau = run.machine, run.signals, run.t[1] - run.t[0], constants["tau"]
    if machine.family in ("tank", "cylinder"):  # a second vessel behind a throttle
        x = s["h" if machine.family == "tank" else "p"]
        return strength * (x - lagged(x, tau, step))
    name = machine.coordinates[machine.target_axis]
    mass = lagged((s[name] > constants["loading"]) * 1.0, tau, step, 0.0)  # loads on one side, and leaks
    lever = next((machine.columns[k](s) for k in ("G", "W") if k in machine.columns), s["dd" + name])
    return strength * mass * lever


def swing(run, mass, constants):
    """A load that swings behind what is measured; the model carries it rigidly."""
    step, w = run.t[1] - run.t[0], 2 * np.pi * constants["frequency"]
    name = run.machine.coordinates[run.machine.target_axis]
    acceleration = run.signals["d" + name if run.machine.family == "vehicle" else "dd" + name]
    return mass * linear_filter([-1.0, 0.0, 0.0], [1.0, 2 * constants["zeta"] * w, w * w], acceleration, step)


def missing(name, run, strength, constants):
    if name == "late":
        return shifted(run, strength) - run.target
    if name == "ahead":
        return shifted(run, -strength) - run.target
    if name == "actuator":  # the log holds the command u + tau du/dt
        return strength * (shifted(run, -run.sample) - shifted(run, run.sample)) / (2 * run.sample)
    if name == "sensor":
        return lagged(run.target, strength, run.t[1] - run.t[0]) - run.target
    return {"elastic": elastic, "heat": heat, "filling": filling, "swing": swing}[name](run, strength, constants)


def constants_of(rng, name, run):
    seconds = run.t[-1] - run.t[0]
    if name == "elastic":
        return {"share": rng.uniform(0.3, 0.8), "zeta": 10 ** rng.uniform(-1.7, -0.7)}
    if name in ("heat", "filling"):
        tau = seconds * 10 ** rng.uniform(-1.3, -0.2)
        x = run.signals[run.machine.coordinates[run.machine.target_axis]]
        constants = {"tau": tau, "loading": float(np.quantile(x, rng.uniform(0.3, 0.7)))}
        if name == "heat" and run.machine.family != "thermal":
            constants["power"] = float(np.mean(power_and_lever(run)[0]))  # of the first run, in every run
        return constants
    if name == "swing":
        return {"frequency": run.fastest * rng.uniform(0.15, 0.8), "zeta": 10 ** rng.uniform(-2.0, -1.0)}
    return {}


def strength_of(name, run, constants, size):
    """The strength at which the missing part has the root mean square `size`, within what keeps the state plausible:
    delays and lags up to a tenth of the fastest period, resonances from 1.5 times the fastest frequency."""
    rms = lambda x: float(np.sqrt(np.mean(missing(name, run, x, constants) ** 2)))
    if name in ("heat", "filling", "swing"):
        return size / rms(1.0)
    if name == "elastic":
        inertia = constants["share"] * run.parameters["J" if "J" in run.parameters else "m"]
        last = 1 / (inertia * (2 * np.pi * 1.5 * run.fastest) ** 2)
    else:
        last = 0.1 / run.fastest
    first = last * 1e-6
    if rms(last) < size:
        return last
    for _ in range(22):
        middle = np.sqrt(first * last)
        first, last = (middle, last) if rms(middle) < size else (first, middle)
    return float(np.sqrt(first * last))
