"""Machines of one or two inertias that need no MuJoCo, with the functions of machines.py.

For every inertia M: M dv/dt + needed(x) + dry(x) sgn(v) = u. Steps are semi-implicit, and dry friction holds a body that
it can stop within a step, so that bodies stand still as they do. The same formulas serve floats and arrays.
"""

import dataclasses
from collections.abc import Callable

import numpy as np

KELVIN = 293.0  # ambient temperature


@dataclasses.dataclass(frozen=True)
class Machine:
    parameters: dict
    inertia: Callable  # p -> a tuple, one for each body
    needed: Callable  # p, x -> a tuple: force beyond inertia and dry friction
    dry: Callable  # p, x -> a tuple: levels of dry friction
    drive: Callable  # reference position and velocity, x -> force on the first body
    mean: float = 0.0  # of the reference
    amplitude: float = 0.3  # of each of its five sines
    sines: tuple = (0.08, 0.8)  # slowest and fastest, in Hz
    step: float = 0.0005  # s
    follows_speed: bool = False  # the reference is one of v, and the log has no q
    extra: Callable | None = None  # p, x -> signals that are measured too
    fan: bool = False


def pd(kp, kd):
    return lambda position, velocity, x: kp * (position - x["q"]) + kd * (velocity - x["v"])


def speed(gain):
    return lambda position, velocity, x: gain * (position - x["v"])


def grip(p, x):
    return p["k"] * np.maximum(0.0, x["q"] - p["q0"])


def stretch_force(p, x):
    return p["k"] * (x["q"] - x["q_b"]) + p["d"] * (x["v"] - x["v_b"])


MACHINES = {
    # A jaw that closes on something elastic.
    "gripper": Machine(
        parameters={"m": 0.8, "b": 8.0, "f": 3.0, "k": 2000.0, "q0": 0.02},
        inertia=lambda p: (p["m"],),
        needed=lambda p, x: (p["b"] * x["v"] + grip(p, x),),
        dry=lambda p, x: (p["f"],),
        drive=pd(6000.0, 120.0),
        mean=0.02,
        amplitude=0.007,
        sines=(0.1, 1.0),
        extra=lambda p, x: {"grip": grip(p, x)},
    ),
    # A gear with a pendulum as its load; angles and torques of the load.
    "gear": Machine(
        parameters={"J": 1.2, "b": 2.0, "f": 1.5, "g": 6.0},
        inertia=lambda p: (p["J"],),
        needed=lambda p, x: (p["b"] * x["v"] + p["g"] * np.cos(x["q"]),),
        dry=lambda p, x: (p["f"],),
        drive=pd(900.0, 60.0),
        amplitude=0.35,
    ),
    # A motor and a carriage with a belt between them; motor side in m and N.
    "belt": Machine(
        parameters={"m": 4.0, "m_b": 6.0, "b": 15.0, "f": 4.0, "f_b": 8.0, "k": 20000.0, "d": 60.0},
        inertia=lambda p: (p["m"], p["m_b"]),
        needed=lambda p, x: (p["b"] * x["v"] + stretch_force(p, x), -stretch_force(p, x)),
        dry=lambda p, x: (p["f"], p["f_b"]),
        drive=pd(15000.0, 500.0),
        amplitude=0.12,
        sines=(0.1, 1.2),
        extra=lambda p, x: {"stretch": x["q"] - x["q_b"], "dstretch": x["v"] - x["v_b"]},
    ),
    # A heated plate with a fan: v is its temperature in K, u the heating power in W.
    "thermal": Machine(
        parameters={"C": 500.0, "h": 2.0, "h_fan": 3.0},
        inertia=lambda p: (p["C"],),
        needed=lambda p, x: ((p["h"] + p["h_fan"] * x["fan"]) * (x["v"] - KELVIN),),
        dry=lambda p, x: (0.0,),
        drive=speed(60.0),
        mean=350.0,
        amplitude=12.0,
        sines=(0.0005, 0.005),
        step=0.1,
        follows_speed=True,
        fan=True,
    ),
    # A pump that turns one way.
    "pump": Machine(
        parameters={"J": 0.02, "b": 0.01, "f": 0.3},
        inertia=lambda p: (p["J"],),
        needed=lambda p, x: (p["b"] * x["v"],),
        dry=lambda p, x: (p["f"],),
        drive=speed(0.5),
        mean=90.0,
        amplitude=16.0,
        follows_speed=True,
    ),
}

# Force that the first body needs beyond the nominal model; with "dry" the level of a dry friction.
EFFECTS = {
    "gripper": {"load_friction": ("dry", lambda p, x: 0.12 * grip(p, x))},
    "gear": {
        "stribeck": ("dry", lambda p, x: 1.2 * np.exp(-((x["v"] / 0.2) ** 2))),
        "ripple": ("needed", lambda p, x: 0.8 * np.cos(24 * x["q"]) + 0.5 * np.sin(24 * x["q"])),
        "payload": ("needed", lambda p, x: 2.5 * np.cos(x["q"])),
    },
    "belt": {"hardening": ("needed", lambda p, x: 4e9 * (x["q"] - x["q_b"]) ** 3)},
    "thermal": {
        "fan_heat": ("needed", lambda p, x: -8.0 * x["fan"] ** 2),
        "radiation": ("needed", lambda p, x: 2.8e-9 * (x["v"] ** 4 - KELVIN**4)),
    },
    "pump": {"flow": ("needed", lambda p, x: 2e-4 * x["v"] ** 2)},
}

PARAMETERS = {name: machine.parameters for name, machine in MACHINES.items()}


def sines(rng, machine, t):
    """Five sines of the machine's reference and their derivative."""
    frequencies = 2 * np.pi * np.geomspace(*machine.sines, 5) * rng.uniform(0.95, 1.05, 5)
    sizes, phases = machine.amplitude * rng.uniform(0.6, 1.4, 5), rng.uniform(0, 2 * np.pi, 5)
    angles = np.outer(t, frequencies) + phases
    return machine.mean + np.sin(angles) @ sizes, np.cos(angles) @ (sizes * frequencies)


def references(rng, name, seconds):
    """What the machine is to do: times, position and velocity at each step, and the speed of a fan."""
    machine = MACHINES[name]
    t = np.arange(0, seconds, machine.step)
    position, velocity = sines(rng, machine, t)
    fan = 0.5 + 0.4 * np.sin(np.outer(t, 2 * np.pi * rng.uniform(0.001, 0.004, 2)) + rng.uniform(0, 6, 2)).mean(axis=1)
    return t, position, velocity, fan


def move(name, changes, effects, reference, every=1, forces=None, start=None):
    """Signals of every so many steps of a machine that follows a reference, or replays forces from a start.

    `effects` are as in EFFECTS; of a machine with two bodies those of the kind "own" act on the first alone. `forces` holds one value for each step, `start` position and velocity of each body.
    """
    machine = MACHINES[name]
    p = {**machine.parameters, **dict(changes)}
    t, position, velocity, fan = reference
    h = machine.step
    inertia = machine.inertia(p)
    if start is None:
        first = (0.0, float(position[0])) if machine.follows_speed else (float(position[0]), float(velocity[0]))
        start = [first for _ in inertia]
    bodies = [list(body) for body in start]
    rows = []
    for k in range(len(t)):
        x = {"q": bodies[0][0], "v": bodies[0][1], "fan": fan[k]}
        if len(bodies) > 1:
            x |= {"q_b": bodies[1][0], "v_b": bodies[1][1]}
        u = machine.drive(position[k], velocity[k], x) if forces is None else forces[k]
        needed, dry = list(machine.needed(p, x)), list(machine.dry(p, x))
        for kind, function in effects:
            force = function(p, x)
            if kind == "dry":
                dry[0] = max(0.0, dry[0] + force)
            else:
                needed[0] += force
                if len(bodies) > 1 and kind == "needed":
                    needed[1] -= force
        before = x["v"]
        for body, (mass, force, level) in enumerate(zip(inertia, needed, dry)):
            free = bodies[body][1] + h / mass * ((u if body == 0 else 0.0) - force)
            hold = h / mass * level
            bodies[body][1] = free - min(max(free, -hold), hold)
        if k % every == 0:
            x |= {"t": t[k], "u": u, "a": (bodies[0][1] - before) / h}
            rows.append(x | (machine.extra(p, x) if machine.extra else {}))
        for body in bodies:
            body[0] += h * body[1]
    return {key: np.array([float(row[key]) for row in rows]) for key in rows[0]}


def record(name, changes, effects, rng, seconds, rate):
    machine = MACHINES[name]
    chosen = [EFFECTS[name][effect] for effect in effects]
    every = round(1 / (machine.step * rate))
    return renamed(machine, move(name, changes, chosen, references(rng, name, seconds), every))


def renamed(machine, x):
    """Signals under the names of a log."""
    names = {"v": "T", "a": "dT"} if machine.fan else {"v": "w", "a": "dw"} if machine.follows_speed else {"v": "dq", "a": "ddq"}
    dropped = ({"q"} if machine.follows_speed else set()) | (set() if machine.fan else {"fan"})
    return {names.get(key, key): value for key, value in x.items() if key not in dropped}


def simulate(name, rows, changes=()):
    """The force on the first body that the nominal model needs: rows x 1."""
    machine = MACHINES[name]
    p = {**machine.parameters, **dict(changes)}
    x = dict(rows)
    for short, names in {"v": ("dq", "w", "T"), "a": ("ddq", "dw", "dT")}.items():
        x[short] = next(rows[key] for key in names if key in rows)
    if "stretch" in x:
        x |= {"q_b": x["q"] - x["stretch"], "v_b": x["v"] - x["dstretch"]}
    total = machine.inertia(p)[0] * x["a"] + machine.needed(p, x)[0] + machine.dry(p, x)[0] * np.sign(x["v"])
    return total[:, None]


def simulate_rigid_belt(rows, changes=()):
    """The belt as one mass on the encoder of the motor."""
    p = {**PARAMETERS["belt"], **dict(changes)}
    return (p["m"] + p["m_b"]) * rows["ddq"] + p["b"] * rows["dq"] + (p["f"] + p["f_b"]) * np.sign(rows["dq"])
