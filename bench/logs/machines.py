"""Machines whose truth is known: they move under control, and their nominal models say which torque the motion needs.

A machine has `parameters`, the nominal ones. What the real machine has and the model lacks is an `Effect`. `record()`
lets the real machine follow a reference of five sines and returns signals without noise, `simulate()` is the nominal
model on any rows of signals. Units: rad (m for a slide), s, N m (N).

The arm, the elastic joint and the cart are those of MuJoCo (integrator implicitfast, no contacts). machines_of_ode.py
has the others.
"""

import dataclasses
import functools
from collections.abc import Callable

import mujoco
import numpy as np

STEP = 0.0005  # seconds of the integration
RATE = 500  # rows a second of a log


@dataclasses.dataclass(frozen=True)
class Effect:
    """A torque that the motion needs beyond the nominal model, at joint number `joint`.

    Functions take the vectors q and dq of all joints. `needed(q, dq)` is subtracted from the applied torques. Dry
    friction is `friction(q, dq)` instead: the level that opposes the motion and holds a joint at rest.
    """

    joint: int = 0
    needed: Callable | None = None
    friction: Callable | None = None


EFFECTS = {
    "arm": {"stribeck": Effect(0, friction=lambda q, dq: 1.0 * np.exp(-((dq[0] / 0.15) ** 2)))},
    "elastic": {},
    "cart": {
        "drag": Effect(0, needed=lambda q, dq: 1.5 * dq[0] * abs(dq[0])),
        "cable": Effect(0, needed=lambda q, dq: 12.0 * max(0.0, q[0] - 0.25)),
    },
}

PARAMETERS = {
    "arm": {"m1": 2.0, "m2": 1.0, "b1": 0.3, "b2": 0.15, "f1": 0.8, "f2": 0.2, "a1": 0.02, "a2": 0.01},
    "elastic": {"m": 2.0, "armature": 0.05, "b": 0.3, "k": 150.0, "d": 0.3},
    "cart": {"m": 3.0, "b": 1.0, "f": 0.5},
}

# Of each joint: proportional and derivative gain, amplitude of each of the five sines.
CONTROL = {"arm": [(250.0, 20.0, 0.22), (60.0, 4.0, 0.28)], "elastic": [(300.0, 12.0, 0.35)], "cart": [(600.0, 60.0, 0.17)]}

# Of the references: frequency of the fastest sine in Hz, and the seconds within which they fade in from rest. The elastic
# joint starts with a jerk that makes it ring.
REFERENCES = {"arm": (0.8, 1.0), "elastic": (1.6, 0.3), "cart": (0.8, 1.0)}


def model_text(machine, p, rigid=True):
    """MJCF of a machine. The nominal elastic joint is rigid, the real one is not."""
    if machine == "arm":
        bodies = """<body><joint name="1" axis="0 1 0" damping="{b1}" frictionloss="{f1}" armature="{a1}"/>
          <inertial pos="0 0 -.2" mass="{m1}" diaginertia=".02 .02 .004"/>
          <body pos="0 0 -.4"><joint name="2" axis="0 1 0" damping="{b2}" frictionloss="{f2}" armature="{a2}"/>
            <inertial pos="0 0 -.15" mass="{m2}" diaginertia=".01 .01 .002"/></body></body>"""
    elif machine == "cart":
        bodies = """<body><joint type="slide" axis="1 0 0" damping="{b}" frictionloss="{f}"/>
          <inertial pos="0 0 0" mass="{m}" diaginertia=".01 .01 .01"/></body>"""
    else:
        link = '<inertial pos="0 0 -.25" mass="{m}" diaginertia=".03 .03 .004"/>'
        rotor = '<joint axis="0 1 0" damping="{b}" armature="{armature}"/>'
        spring = '<joint axis="0 1 0" stiffness="{k}" damping="{d}"/>'
        nothing = '<inertial pos="0 0 0" mass="1e-6" diaginertia="1e-9 1e-9 1e-9"/>'
        bodies = f"<body>{rotor}{link}</body>" if rigid else f"<body>{rotor}{nothing}<body>{spring}{link}</body></body>"
    return f"""<mujoco><option integrator="implicitfast" timestep="{STEP}"><flag contact="disable"/></option>
      <worldbody>{bodies.format(**p)}</worldbody></mujoco>"""


@functools.cache
def model(machine, parameters, rigid=True):
    return mujoco.MjModel.from_xml_string(model_text(machine, dict(parameters), rigid))


def as_key(machine, changes):
    """Nominal parameters and their changes, in a form that can be cached."""
    return tuple({**PARAMETERS[machine], **dict(changes)}.items())


def references(rng, machine, seconds):
    """Position and velocity of five sines for each joint, from rest at 0."""
    t = np.arange(0, seconds, STEP)
    fastest, fading = REFERENCES[machine]
    part = np.minimum(1.0, t / fading)
    fade = part**2 * (3 - 2 * part)
    frequencies = 2 * np.pi * np.geomspace(0.08, fastest, 5)
    position, velocity = [], []
    for _, _, amplitude in CONTROL[machine]:
        sizes = amplitude * rng.uniform(0.6, 1.4, 5)
        phases = frequencies[:, None] * t * rng.uniform(0.95, 1.05, (5, 1)) + rng.uniform(0, 2 * np.pi, (5, 1))
        wave = sizes @ np.sin(phases)
        position.append(fade * wave)
        velocity.append(np.gradient(position[-1], STEP))
    return t, np.array(position).T, np.array(velocity).T


def step_effects(real, data, effects, nominal_friction):
    """Sets the forces of the effects and their friction for the next step."""
    data.qfrc_applied[:] = 0
    real.dof_frictionloss[:] = nominal_friction
    for effect in effects:
        if effect.friction:
            level = real.dof_frictionloss[effect.joint] + effect.friction(data.qpos, data.qvel)
            real.dof_frictionloss[effect.joint] = max(0.0, level)
        else:
            data.qfrc_applied[effect.joint] -= effect.needed(data.qpos, data.qvel)


def move(machine, parameters, effects, reference, control=None, rigid=True, rate=RATE, torques=None, start=None):
    """Lets a machine follow a reference (closed loop), or replays torques from a start (open loop).

    Returns arrays of t, q, dq, ddq, u: a row for each 1/rate seconds, a column for each coordinate. `torques` holds one
    row for each step.
    """
    nominal = model(machine, parameters, rigid)
    real = nominal.__copy__()
    friction = nominal.dof_frictionloss.copy()
    data = mujoco.MjData(real)
    t, position, velocity = reference
    gains = np.array(control if control is not None else CONTROL[machine])
    driven = len(gains)
    if start is not None:
        data.qpos[:], data.qvel[:] = start
    every = round(1 / (STEP * rate))
    rows = []
    for k in range(len(t)):
        if torques is None:
            error, slip = position[k] - data.qpos[:driven], velocity[k] - data.qvel[:driven]
            u = gains[:, 0] * error + gains[:, 1] * slip
        else:
            u = torques[k]
        step_effects(real, data, effects, friction)
        data.qfrc_applied[:driven] += u
        if k % every == 0:
            mujoco.mj_forward(real, data)
            rows.append(np.concatenate([[t[k]], data.qpos, data.qvel, data.qacc, u]))
        mujoco.mj_step(real, data)
    table, n = np.array(rows), real.nv
    return table[:, 0], table[:, 1 : 1 + n], table[:, 1 + n : 1 + 2 * n], table[:, 1 + 2 * n : 1 + 3 * n], table[:, 1 + 3 * n :]


def record(machine, changes, effects, rng, seconds, rate=RATE):
    """The log of the real machine without noise: t, and q, dq, ddq, u of each joint."""
    reference = references(rng, machine, seconds)
    chosen = [EFFECTS[machine][name] for name in effects]
    t, q, dq, ddq, u = move(machine, as_key(machine, changes), chosen, reference, rigid=machine != "elastic", rate=rate)
    signals = {"t": t}
    if machine == "elastic":  # coordinates: the rotor, and the link against it
        signals |= {"q": q[:, 0], "dq": dq[:, 0], "ddq": ddq[:, 0], "u": u[:, 0], "q_link": q[:, 0] + q[:, 1]}
        return signals | {"twist": q[:, 1]}
    for j in range(q.shape[1]):
        end = str(j + 1) if q.shape[1] > 1 else ""
        signals |= {f"q{end}": q[:, j], f"dq{end}": dq[:, j], f"ddq{end}": ddq[:, j], f"u{end}": u[:, j]}
    return signals


def columns(rows, names, joints):
    ends = [str(j + 1) for j in range(joints)] if joints > 1 else [""]
    return [np.column_stack([rows[name + end] for end in ends]) for name in names]


def simulate(machine, rows, changes=()):
    """Torques that the nominal model needs for q, dq, ddq of the rows: rows x joints (mj_inverse)."""
    nominal = model(machine, as_key(machine, changes))
    data = mujoco.MjData(nominal)
    q, dq, ddq = columns(rows, ["q", "dq", "ddq"], nominal.nv)
    torques = np.empty_like(q)
    for k in range(len(q)):
        data.qpos[:], data.qvel[:], data.qacc[:] = q[k], dq[k], ddq[k]
        mujoco.mj_inverse(nominal, data)
        torques[k] = data.qfrc_inverse
    return torques


def simulate_forward(machine, rows, changes=()):
    """Accelerations that the nominal model gives to q, dq and the torques u of the rows: rows x joints."""
    nominal = model(machine, as_key(machine, changes))
    data = mujoco.MjData(nominal)
    q, dq, u = columns(rows, ["q", "dq", "u"], nominal.nv)
    result = np.empty_like(q)
    for k in range(len(q)):
        data.qpos[:], data.qvel[:], data.qfrc_applied[:] = q[k], dq[k], u[k]
        mujoco.mj_forward(nominal, data)
        result[k] = data.qacc
    return result
