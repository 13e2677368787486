"""A MuJoCo simulation that lacks a term: the motor's torque of a pendulum, whose real bearing drags with the square of
the speed."""

import mujoco
import numpy as np

import llmt

SPEC = """
<mujoco>
  <worldbody>
    <body>
      <joint name="hinge" type="hinge" axis="0 1 0" damping="0.05"/>
      <geom type="capsule" fromto="0 0 0 0 0 -0.5" size="0.02" mass="1"/>
    </body>
  </worldbody>
</mujoco>
"""
MODEL = mujoco.MjModel.from_xml_string(SPEC)
MASS, INERTIA = MODEL.body_mass[1], MODEL.body_inertia[1].copy()


def torque(parameters, inputs):
    """Inverse dynamics of every row: the torque that makes the hinge move as it was seen to move."""
    MODEL.body_mass[1] = parameters["mass"]
    MODEL.body_inertia[1] = INERTIA * parameters["mass"] / MASS
    data = mujoco.MjData(MODEL)
    result = np.empty(len(inputs["q"]))
    for row, (q, dq, ddq) in enumerate(zip(inputs["q"], inputs["dq"], inputs["ddq"])):
        data.qpos[0], data.qvel[0], data.qacc[0] = q, dq, ddq
        mujoco.mj_inverse(MODEL, data)
        result[row] = data.qfrc_inverse[0]
    return result


rng = np.random.default_rng(0)
inputs = {"q": rng.uniform(-3, 3, 400), "dq": rng.uniform(-6, 6, 400), "ddq": rng.uniform(-20, 20, 400)}
real = torque({"mass": 1.15}, inputs) + 0.02 * inputs["dq"] * np.abs(inputs["dq"]) + rng.normal(0, 0.01, 400)

found = llmt.discover(torque, {"mass": llmt.Parameter(1.0, unit="kg")}, inputs, {"torque": real})
print(found.summary)
for term in found.to_dict()["effects"]:
    value = term["parameters"][0]
    print(f"{term['formula']}: {value['value']:.5f} +- {value['std_error']:.5f} N m (true: dq |dq|, 0.02)")
mass = found.to_dict()["simulation"][0]
print(f"mass: {mass['value']:.4f} +- {mass['std_error']:.4f} kg (true: 1.15)")
print(f"gap on {found.gap['heldout_samples']} rows set aside: {found.gap['before']:.3f} -> {found.gap['after']:.3f} N m")
