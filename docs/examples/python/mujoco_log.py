"""From two logs of a two-joint arm to what its MuJoCo model lacks: the real arm has friction that falls with speed, and
masses that nobody weighed. The first log is searched, the second one is replayed with the model before and after."""

import mujoco
import numpy as np

import llmt
import llmt.mujoco as lm

ARM = """
<mujoco>
  <option timestep="0.001" integrator="implicitfast"/>
  <worldbody>
    <body name="upper">
      <inertial pos="0 0 -0.2" mass="2" diaginertia="0.02 0.02 0.004"/>
      <joint name="shoulder" axis="0 1 0" damping="0.3" frictionloss="0.8" armature="0.02"/>
      <body name="fore" pos="0 0 -0.4">
        <inertial pos="0 0 -0.15" mass="1" diaginertia="0.01 0.01 0.002"/>
        <joint name="elbow" axis="0 1 0" damping="0.15" frictionloss="0.2" armature="0.01"/>
      </body>
    </body>
  </worldbody>
</mujoco>
"""


def record(seed, seconds=20.0):
    """A log of the real arm, 500 times a second: it follows sines, and its encoders and torques have noise."""
    spec = mujoco.MjSpec.from_string(ARM)
    for body, mass in (("upper", 2.3), ("fore", 1.15)):
        spec.body(body).mass = mass
    model = spec.compile()
    data, rng = mujoco.MjData(model), np.random.default_rng(seed)
    rates, phases = np.array([0.08, 0.17, 0.31, 0.52, 0.79]), rng.uniform(0, 2 * np.pi, (2, 5))
    sizes = np.array([0.5, 0.4, 0.3, 0.2, 0.1]) * rng.uniform(0.7, 1.3, (2, 5))
    rows = []
    for step in range(round(seconds / model.opt.timestep)):
        angle = 2 * np.pi * rates * data.time + phases
        goal, speed = (sizes * np.sin(angle)).sum(1), (sizes * 2 * np.pi * rates * np.cos(angle)).sum(1)
        torque = np.array([150.0, 60.0]) * (goal - data.qpos) + np.array([12.0, 5.0]) * (speed - data.qvel)
        if step % 2 == 0:
            rows.append([data.time, *(data.qpos + rng.normal(0, 1e-5, 2)), *(torque + rng.normal(0, 0.05, 2))])
        model.dof_frictionloss[0] = 0.8 + 1.0 * np.exp(-((data.qvel[0] / 0.15) ** 2))
        data.qfrc_applied[:] = torque
        mujoco.mj_step(model, data)
    return {name: np.array(column) for name, column in zip(["t", "q1", "q2", "u1", "u2"], zip(*rows))}


run1, run2 = record(1), record(2, 10.0)

# What a user writes: 15 lines.
spec = mujoco.MjSpec.from_string(ARM)
log = dict(time="t", position=["q1", "q2"], torque=["u1", "u2"], cutoff=20.0)
rows = llmt.signals(run1, **log, standstill=0.03)
print(rows)
parameters = lm.parameters(spec, ["mass", "damping", "frictionloss"])
simulation = lm.inverse_dynamics(spec, parameters)
found = llmt.discover(simulation, parameters, rows.inputs, rows.torques, signals=rows)
print(found)
fixed, callback = found.mujoco(spec)
before = lm.replay(spec, run2, **log)
after = lm.replay(fixed, run2, callback=callback, **log)
for name in before.rms:
    print(f"{name}: {before.rms[name]:.2g} rad before, {after.rms[name]:.2g} rad after")
try:
    found.plot().figure.savefig("gap.png")
except ImportError:
    print("matplotlib draws the gap where it is installed")
