"""python3 bench/distributed/cost_model.py [--rows N]: seconds of each kind of pass by rows and inputs, a formula fitted
to them, what it says of a table that was left out, and what it says of tables that nobody ran
(docs/algorithms/distributed.md, "Cost model"). Everything on one thread."""

import argparse
import sys
import time

import numpy as np

from llmt import LocalLinearTreeRegressor, distributed

BLOCK = 65536
BINS = 64
BANDWIDTH = 1e9  # bytes a second between two machines


def table(rows: int, inputs: int) -> tuple[np.ndarray, np.ndarray]:
    rng = np.random.default_rng(1)
    x = rng.uniform(size=(rows, inputs))
    y = 10 * np.sin(np.pi * x[:, 0] * x[:, 1]) + 20 * (x[:, 2] - 0.5) ** 2 + 10 * x[:, 3] + 5 * x[:, 4]
    return np.asfortranarray(x), y + rng.normal(size=rows)


def features(step: str, rows: float, inputs: int) -> list[float]:
    """What the seconds of a pass are a sum of multiples of."""
    gram = (inputs + 2) * (inputs + 3) / 2
    return {
        "describe": [rows, rows * inputs],
        "grow": [rows * inputs, rows * inputs * gram],
        "gather": [rows, rows * inputs],
        "blend": [rows * inputs, rows * gram],
    }[step]


def measure(rows: int, inputs: int) -> dict[str, dict[str, list[float]]]:
    """Of every step the seconds of its passes, the bytes of their sums, and the seconds of what follows them."""
    x, y = table(rows, inputs)
    estimator = LocalLinearTreeRegressor(validity="crisp", cv=2, max_leaves=8, n_jobs=1)
    memory = {"branch_rows": rows // 6, "sample_rows": 16384}
    state = distributed.start([f"x{j}" for j in range(inputs)], "y", **memory, estimator=estimator)
    found: dict[str, dict[str, list[float]]] = {}
    while (step := distributed.status(state)["step"]) != "finished":
        parts = []
        begin = time.process_time()
        for first in range(0, rows, 4 * BLOCK):
            shard = slice(first, min(rows, first + 4 * BLOCK))
            parts.append(distributed.sums(state, x[shard], y[shard], first // BLOCK))
        sums = distributed.merge(parts)
        of_pass = time.process_time() - begin
        begin = time.process_time()
        state = distributed.advance(state, sums, max_threads=1)
        of_step = found.setdefault(step, {"pass": [], "advance": [], "bytes": []})
        of_step["pass"].append(of_pass)
        of_step["advance"].append(time.process_time() - begin)
        of_step["bytes"].append(len(sums))
    return found


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--rows", type=int, default=400_000)
    given = parser.parse_args()
    runs = {
        (rows, inputs): measure(rows, inputs)
        for rows, inputs in [
            (given.rows // 2, 5),
            (given.rows, 5),
            (given.rows // 2, 10),
            (given.rows, 10),
            (given.rows, 20),
        ]
    }
    left_out = (given.rows * 2, 15)
    checked = measure(*left_out)
    for (rows, inputs), found in [*runs.items(), (left_out, checked)]:
        for step, of_step in found.items():
            print(
                f"{rows:>9} x {inputs:<3} {step:9} {len(of_step['pass'])} passes, "
                f"{np.mean(of_step['pass']):.3f} CPU s each, "
                f"{max(of_step['bytes'])} bytes at most, then {np.mean(of_step['advance']):.3f} CPU s"
            )
    formulas = {}
    for step in ("describe", "grow", "gather", "blend"):
        design = np.array([features(step, *size) for size, found in runs.items() if step in found])
        seconds = np.array([np.mean(found[step]["pass"]) for found in runs.values() if step in found])
        # Relative errors count.
        formulas[step] = np.maximum(
            np.linalg.lstsq(design / seconds[:, None], np.ones(len(seconds)), rcond=None)[0], 0.0
        )
        said = float(np.dot(features(step, *left_out), formulas[step]))
        took = float(np.mean(checked[step]["pass"])) if step in checked else float("nan")
        print(
            f"{step:9} {formulas[step]}: of {left_out[0]} x {left_out[1]} it says {said:.2f} s, measured {took:.2f} s"
        )
    per_row_of_branch = np.mean(
        [
            sum(found["gather"]["advance"]) / (rows * inputs**2)
            for (rows, inputs), found in runs.items()
            if "gather" in found
        ]
    )
    print(f"branches: {per_row_of_branch:.3g} CPU s for a row times the square of the inputs")
    for rows, inputs, machines, cores, branch in [(1e9, 30, 16, 16, 4e6), (1e11, 10, 256, 16, 4e6)]:
        workers = machines * cores
        branches = rows / (0.6 * branch)
        grow = np.log2(branches) + branches * inputs * BINS * (inputs + 2) * (inputs + 3) / 2 / 2**22
        passes = {"describe": 1.0, "grow": grow, "gather": rows / branch * 1.2, "blend": 1.0}
        seconds = {
            step: passes[step] * np.dot(features(step, rows, inputs), formulas[step]) / workers for step in passes
        }
        # Of every level of the tree of machines the first process receives one message of at most 32 MiB, then the rows.
        received = np.ceil(np.log2(machines)) * grow * 2**25 + 8 * (inputs + 1) * rows
        of_branches = per_row_of_branch * rows * inputs**2 / cores
        print(
            f"{rows:.0e} x {inputs} on {machines} machines of {cores} cores, branches of {branch:.0e} rows: "
            + ", ".join(f"{passes[step]:.0f} {step} {seconds[step] / 3600:.2f} h" for step in passes)
            + f", {branches:.0f} branches one after the other {of_branches / 3600:.1f} h, "
            f"to the first process {received / 1e9:.0f} GB: {received / BANDWIDTH / 3600:.2f} h"
        )
    return 0


if __name__ == "__main__":
    sys.exit(main())
