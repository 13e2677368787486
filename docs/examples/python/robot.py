"""A robot's URDF and a table of measurements in, commands that bring its tool where it should be out."""

from pathlib import Path

import pandas

from llmt import robotics

samples = Path(__file__).parents[2] / "samples"

arm = robotics.robot(samples / "arm.urdf")
measured = pandas.read_csv(samples / "arm_measured.csv")  # q1_rad ... q6_rad, x_mm, y_mm, z_mm
found = robotics.discover(arm, measured)
print(found.summary)
print(found.effects[["location", "value", "standard_error", "unit"]].to_string(float_format="{:.2e}".format))

program = pandas.DataFrame(
    {
        "q1_deg": [0, 20, -40, 60, -80],
        "q2_deg": [0, 30, -20, 10, 40],
        "q3_deg": [0, -20, 30, 40, -10],
        "q4_deg": [0, 45, -60, 90, 20],
        "q5_deg": [30, -40, 50, 60, -70],
        "q6_deg": [0, 90, -90, 45, 120],
    }
)
commands = robotics.compensate(found.robot, program, nominal=arm)
print(commands.commands[[*program, "outcome"]].to_string(float_format="{:.4f}".format))
found.robot.save("improved.yaml")

# The measurements were simulated with arm_true.yaml, so that what the commands do can be seen.
real = robotics.robot(samples / "arm_true.yaml")
frames = {key: found.robot.to_dict()[key] for key in ("base", "tool")}  # where the arm and its tool were found to be
asked = robotics.predict({**arm.to_dict(), **frames}, program)
axes = ["x_mm", "y_mm", "z_mm"]
for name, joints in [("as described", program), ("with the commands", commands.commands)]:
    missed = (real.forward(joints)[axes] - asked[axes]).pow(2).sum(axis=1).pow(0.5)
    print(f"{name}, the real arm misses its targets by {missed.mean():.4f} mm on average")
