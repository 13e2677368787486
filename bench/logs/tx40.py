#!/usr/bin/env python3
"""What the rigid model of a real arm lacks, from its published log: motor positions, motor torques, URDF.

    PYTHONPATH=build/release/python python3 bench/logs/tx40.py ../shared/data/logs/tx40/original [--cutoff HZ] [--joints 1,2]

1. Joint angles and torques from those of the motors (gear ratios; joints 5 and 6 are coupled), at 5 kHz.
2. `llmt.signals`: rows.
3. `llmt.mujoco`: the torques of the URDF, and their derivatives by masses, centres, inertias and rotors.
4. `llmt.discover` for each joint: the rigid parameters are fitted together with what is missing.

Prints what was found beside Coulomb and viscous friction that is fitted by hand together with the same parameters.
"""

import argparse
import pathlib
import re
import time as clock

import mujoco
import numpy as np

import llmt
import llmt.mujoco

RATIOS = np.diag([32.0, 32.0, 45.0, -48.0, 45.0, 32.0])


def read(folder):
    positions = np.loadtxt(folder / "pos_read_data.csv", delimiter=",", skiprows=1)
    torques = np.loadtxt(folder / "curr_data.csv", delimiter=",", skiprows=1)
    gears, drives = RATIOS.copy(), RATIOS.copy()
    gears[5, 4] = drives[4, 5] = 32.0
    q = np.linalg.solve(gears, positions.T).T + np.radians([0, -90, 90, 0, 0, 0])
    u = torques @ drives.T
    turns = {"m6": q[:, 4] + q[:, 5]}  # motor 6
    return {**{f"q{j + 1}": q[:, j] for j in range(6)}, **turns, **{f"u{j + 1}": u[:, j] for j in range(6)}}


def arm(folder):
    text = (folder / "tx40.urdf").read_text()
    text = re.sub(r"<(visual|collision)>.*?</\1>", "", text, flags=re.S)  # meshes are not there, and not needed
    spec = mujoco.MjSpec.from_string(text)
    spec.compiler.boundinertia = 1e-5  # the last link has none in the file
    return spec


def principal(columns, share):
    """Combinations of the columns (of root mean square 1) that the motion excites: those of the singular values above a
    share of the largest. The others cannot be told from noise."""
    scales = np.sqrt(np.mean(columns**2, axis=0))
    there = scales > 1e-9
    left, sizes, _ = np.linalg.svd(columns[:, there] / scales[there], full_matrices=False)
    return left[:, sizes > share * sizes[0]] * np.sqrt(len(columns))


def main():
    parser = argparse.ArgumentParser(description=__doc__.split("\n")[0])
    parser.add_argument("folder", type=pathlib.Path)
    parser.add_argument("--cutoff", type=float, default=40.0, help="Hz")
    parser.add_argument("--every", type=int, default=None, help="samples from row to row")
    parser.add_argument("--standstill", type=float, default=0.02, help="rad/s")
    parser.add_argument(
        "--share", type=float, default=0.3, help="smallest singular value of a combination of parameters"
    )
    parser.add_argument("--joints", default="1,2,3,4,5,6")
    arguments = parser.parse_args()

    log = read(arguments.folder)
    names = [f"q{j}" for j in range(1, 7)]
    rows = llmt.signals(
        log,
        rate=5000.0,
        position=[*names, "m6"],
        torque=[f"u{j}" for j in range(1, 7)],
        cutoff=arguments.cutoff,
        every=arguments.every,
        standstill=arguments.standstill,
    )
    print(rows)
    spec = arm(arguments.folder)
    parameters = llmt.mujoco.parameters(spec, ["mass", "com", "inertia", "armature"])
    simulation = llmt.mujoco.inverse_dynamics(spec, parameters, position=names)
    nominal = {name: parameter.value for name, parameter in parameters.items()}
    table = {name: np.asarray(column) for name, column in rows.inputs.items()}
    torques = simulation(nominal, table)
    derivatives = simulation.jacobian(nominal, table)

    print("\njoint  by hand: Coulomb  viscous  rest without  rest with   llmt.discover")
    for joint in (int(text) - 1 for text in arguments.joints.split(",")):
        begin = clock.process_time()
        columns = derivatives[:, joint, :]
        # The rotor of motor 6 turns with q5 + q6: its inertia couples both joints, and so does its friction.
        speeds = {name: table[f"d{name}"] for name in [names[joint]]}
        if joint >= 4:
            other = names[9 - joint]
            columns = np.column_stack([columns, table[f"dd{other}"]])
            speeds["m6"] = table["dm6"]
        # Amplifiers have an offset, which is no friction either.
        rigid = np.column_stack([principal(columns, arguments.share), np.ones(len(columns))])
        measured = np.asarray(rows.torques[f"u{joint + 1}"])

        def simulate(values, inputs, rigid=rigid, joint=joint):
            changes = np.array([values[f"p{k}"] for k in range(rigid.shape[1])])
            return torques[:, joint] + rigid @ changes

        simulate.jacobian = lambda values, inputs, rigid=rigid: rigid[:, np.newaxis, :]

        friction = np.column_stack([f(v) for v in speeds.values() for f in (np.sign, lambda v: v)])
        gap = measured - torques[:, joint]
        by_hand = np.linalg.lstsq(np.column_stack([rigid, friction]), gap, rcond=None)[0]
        rest = gap - np.column_stack([rigid, friction]) @ by_hand
        alone = gap - rigid @ np.linalg.lstsq(rigid, gap, rcond=None)[0]
        inputs = {f"d{names[joint]}": table[f"d{names[joint]}"]}
        if joint >= 4:
            inputs["dm6"] = table["dm6"]
        found = llmt.discover(
            simulate,
            {f"p{k}": llmt.Parameter(0.0, scale=1.0) for k in range(rigid.shape[1])},
            inputs,
            {f"u{joint + 1}": measured},
            time=rows.time,
            without=["previous", "rate", "direction"],
        )
        hand = "  ".join(f"{value:8.3f}" for value in by_hand[rigid.shape[1] :])
        print(f"{joint + 1}      {hand}  {alone.std():8.3f} {rest.std():8.3f}  {found.summary}")
        for term in found.to_dict()["effects"]:
            values = ", ".join(
                f"{p['name']} {p['value']:.3f} +- {p['std_error'] or float('nan'):.3f}" for p in term["parameters"]
            )
            print(
                f"       {'confirmed' if term['confirmed'] else 'tentative'}  {term['formula']}: {values}; {term['rivals']}"
            )
        left = measured - found.corrected[:, 0]
        print(
            f"       gap {found.gap['before']:.3f} -> {found.gap['after']:.3f}, rest of all rows {left.std():.3f}, "
            f"{rigid.shape[1]} rigid parameters, {len(measured)} rows, {clock.process_time() - begin:.0f} s CPU"
        )


if __name__ == "__main__":
    main()
