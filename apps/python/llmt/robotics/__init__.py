"""Calibrate a robot from measured positions, name what its model lacks, and remove it.

>>> from llmt import robotics
>>> arm = robotics.robot("docs/samples/arm.yaml")
>>> found = robotics.discover(arm, "docs/samples/arm_measured.csv")
>>> found.verdict
'named'
>>> found.effects[["name", "location"]].values.tolist()
[['joint_compliance', 'joint2'], ['joint_compliance', 'joint3']]

A robot is a URDF or YAML file, the text of one, or a dict with the keys of the YAML. Measurements are a path or a table
with the columns of the CSV files, whose names end with their units: ``q1_deg`` or ``q1_rad``, ``x_mm``. A message
about a table counts its rows from 0; the page of a result counts lines, the header is line 1.

The functions do what the commands of ``llmt-robot`` do, and their arguments are its options.
"""

from llmt.robotics._results import Calibration, Check, Commands, Discovery, PoseChoice, RobotWarning
from llmt.robotics._robot import Robot, predict, robot
from llmt.robotics._tasks import calibrate, check, compensate, discover, export, poses, simulate

__all__ = [
    "Calibration",
    "Check",
    "Commands",
    "Discovery",
    "PoseChoice",
    "Robot",
    "RobotWarning",
    "calibrate",
    "check",
    "compensate",
    "discover",
    "export",
    "poses",
    "predict",
    "robot",
    "simulate",
]
