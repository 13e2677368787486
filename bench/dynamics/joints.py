"""Torques of a joint as a system that moves, the rigid model's torque among its inputs.

    python bench/dynamics/joints.py --program build/release/bin/llmt --data ../shared/data/logs

`--data` has two arms. lwr/jK_simR.csv and jK_measR.csv are of the joint K and the run R: t, qK, dqK, ddqK and u, the
torque of a rigid model that was fitted to run 0, and the measured one; run 0 is learned. tx40/tx40_ideal_K.sim.csv and
.meas.csv have q, dq, ddq and tau; the first 1000 of 1400 rows are learned. Printed are root mean square errors on the
other rows, in N m: of the rigid model alone, of the rigid model with Coulomb and viscous friction and an offset, fitted
by least squares, and of the free run.
"""

import argparse
import csv
import json
import math
import subprocess
import tempfile
from pathlib import Path

import numpy as np

WINDOW = 5  # measured rows that a run begins with


def columns_of(path, names):
    with path.open() as file:
        return np.array([[float(row[name]) for name in names] for row in csv.DictReader(file)])


def rows_of(simulated, measured, position, speed, torque):
    """Rows u_rigid, q, dq, u of two files."""
    rigid = columns_of(simulated, (torque, position, speed))
    return np.column_stack([rigid, columns_of(measured, (torque,))])


def joints(data):
    """Names of joints, the rows that are learned and the others."""
    for j in range(1, 8):
        runs = [rows_of(*(data / f"lwr/j{j}_{kind}{run}.csv" for kind in ("sim", "meas")), f"q{j}", f"dq{j}", "u")
                for run in (0, 1)]
        yield f"LWR4+, {j}", *runs
    for j in range(1, 7):
        rows = rows_of(*(data / f"tx40/tx40_ideal_{j}.{kind}.csv" for kind in ("sim", "meas")), "q", "dq", "tau")
        yield f"TX40, {j}", rows[:1000], rows[1000:]


def by_hand(learned, tested):
    def columns(rows):
        return np.column_stack([rows[:, 0], np.sign(rows[:, 2]), rows[:, 2], np.ones(len(rows))])

    return columns(tested) @ np.linalg.lstsq(columns(learned), learned[:, 3], rcond=None)[0]


def free_run(program, learned, tested):
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        for file, rows in (("learned.csv", learned), ("tested.csv", tested)):
            np.savetxt(folder / file, rows, delimiter=",", header="u_rigid,q,dq,u", comments="", fmt="%.12g")

        def run(*words):
            return json.loads(subprocess.run([program, *words, "--json"], cwd=folder, capture_output=True, text=True,
                                             check=True).stdout)

        fit = run("fit", "learned.csv", "-t", "u", "--lags", "auto", "--accept-unstable", "-o", "m.json")
        simulated = run("simulate", "m.json", "tested.csv", "--window", str(WINDOW))["simulated"]["u"]
    return np.array([math.nan if value is None else value for value in simulated]), fit


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--program", required=True)
    parser.add_argument("--data", type=Path, required=True)
    arguments = parser.parse_args()
    program = str(Path(arguments.program).resolve())
    print(f"{'joint':9} {'rigid':>7} {'by hand':>8} {'free run':>8}  model")
    for name, learned, tested in joints(arguments.data):
        simulated, fit = free_run(program, learned, tested)

        def error(torques):
            return math.sqrt(np.mean((torques - tested[:, 3])[WINDOW:] ** 2))

        print(f"{name:9} {error(tested[:, 0]):7.3f} {error(by_hand(learned, tested)):8.3f} {error(simulated):8.3f}  "
              f"{fit['lags']}: {fit['model_kind']}", flush=True)


if __name__ == "__main__":
    main()
