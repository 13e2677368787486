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
FAMILIES = ["linear", "sign", "stribeck", "tanh", "asinh", "signed_square", "square", "cube", "absolute", "step", "hinge",
            "offset", "gain"]


def read(folder):
    positions = np.loadtxt(folder / "pos_read_data.csv", delimiter=",", skiprows=1)
    torques = np.loadtxt(folder / "curr_data.csv", delimiter=",", skiprows=1)
    gears, drives = RATIOS.copy(), RATIOS.copy()
    gears[5, 4] = drives[4, 5] = 32.0
    q = np.linalg.solve(gears, positions.T).T + np.radians([0, -90, 90, 0, 0, 0])
    u = torques @ drives.T
    return {**{f"q{j + 1}": q[:, j] for j in range(6)}, **{f"u{j + 1}": u[:, j] for j in range(6)}}


def arm(folder):
    text = (folder / "tx40.urdf").read_text()
    text = re.sub(r"<(visual|collision)>.*?</\1>", "", text, flags=re.S)  # meshes are not there, and not needed
    spec = mujoco.MjSpec.from_string(text)
    spec.compiler.boundinertia = 1e-5  # the last link has none in the file
    return spec


def independent(columns):
    """The columns of a basis, by Gram-Schmidt with pivoting, scaled to a root mean square of 1."""
    scales = np.sqrt(np.mean(columns**2, axis=0))
    rest = columns[:, scales > 1e-9] / scales[scales > 1e-9]
    kept, basis = [], np.empty((len(columns), 0))
    numbers = np.flatnonzero(scales > 1e-9)
    while rest.shape[1]:
        left = rest - basis @ (basis.T @ rest)
        sizes = np.sqrt(np.mean(left**2, axis=0))
        best = int(np.argmax(sizes))
        if sizes[best] < 0.02:
            break
        kept.append(int(numbers[best]))
        basis = np.column_stack([basis, left[:, best] / np.linalg.norm(left[:, best])])
    return kept, scales


def main():
    parser = argparse.ArgumentParser(description=__doc__.split("\n")[0])
    parser.add_argument("folder", type=pathlib.Path)
    parser.add_argument("--cutoff", type=float, default=40.0, help="Hz")
    parser.add_argument("--every", type=int, default=None, help="samples from row to row")
    parser.add_argument("--joints", default="1,2,3,4,5,6")
    arguments = parser.parse_args()

    log = read(arguments.folder)
    names = [f"q{j}" for j in range(1, 7)]
    rows = llmt.signals(log, rate=5000.0, position=names, torque=[f"u{j}" for j in range(1, 7)],
                        cutoff=arguments.cutoff, every=arguments.every, standstill=0.0)
    print(rows)
    spec = arm(arguments.folder)
    parameters = llmt.mujoco.parameters(spec, ["mass", "com", "inertia", "armature"])
    simulation = llmt.mujoco.inverse_dynamics(spec, parameters)
    nominal = {name: parameter.value for name, parameter in parameters.items()}
    table = {name: np.asarray(column) for name, column in rows.inputs.items()}
    torques = simulation(nominal, table)
    derivatives = simulation.jacobian(nominal, table)

    print("\njoint  by hand: Coulomb  viscous  rest without  rest with   llmt.discover")
    for joint in (int(text) - 1 for text in arguments.joints.split(",")):
        begin = clock.process_time()
        columns = derivatives[:, joint, :]
        labels = list(parameters)
        # The rotor of motor 6 turns with q5 + q6: its inertia couples both joints, and so does its friction.
        speeds = {name: table[f"d{name}"] for name in [names[joint]]}
        if joint >= 4:
            other = names[9 - joint]
            columns = np.column_stack([columns, table[f"dd{other}"]])
            labels.append(f"coupling with dd{other}")
            speeds["motor6"] = table["dq5"] + table["dq6"]
        kept, scales = independent(columns)
        rigid = columns[:, kept] / scales[kept]
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
        inputs = {"t": table["t"], names[joint]: table[names[joint]], f"d{names[joint]}": table[f"d{names[joint]}"]}
        if joint >= 4:
            inputs["dmotor6"] = speeds["motor6"]
        found = llmt.discover(simulate, {f"p{k}": llmt.Parameter(0.0, scale=1.0) for k in range(len(kept))},
                              inputs, {f"u{joint + 1}": measured}, time="t")
        hand = "  ".join(f"{value:8.3f}" for value in by_hand[len(kept):])
        print(f"{joint + 1}      {hand}  {alone.std():8.3f} {rest.std():8.3f}  {found.summary}")
        for term in found.to_dict()["effects"]:
            values = ", ".join(f"{p['name']} {p['value']:.3f} +- {p['std_error'] or float('nan'):.3f}" for p in term["parameters"])
            print(f"       {'confirmed' if term['confirmed'] else 'tentative'}  {term['formula']}: {values}; {term['rivals']}")
        left = measured - found.corrected[:, 0]
        print(f"       gap {found.gap['before']:.3f} -> {found.gap['after']:.3f}, rest of all rows {left.std():.3f}, "
              f"{len(kept)} rigid parameters, {len(measured)} rows, {clock.process_time() - begin:.0f} s CPU")


if __name__ == "__main__":
    main()
