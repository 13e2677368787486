#!/usr/bin/env python3
"""Two programs `llmt` on functions that a seed draws, with tens of thousands of rows: error and time of a sum of trees.

    python3 bench/tables/drawn_functions.py BUILD_BEFORE/bin/llmt BUILD_AFTER/bin/llmt --seeds 1:31

A function of ten inputs, uniform from 0 to 1, is a sum of two to five smooth parts of one to three inputs each (waves
of a product, kinks, quotients, saddles, hills) and of up to three steps, along an axis or across it. Seeds divisible by
three have 100 000 rows, the others 20 000 and 50 000 in turns; the standard deviation of the noise is .01 to 1. The
error is the root mean square against the function without noise at 10 000 further rows, of fits on one thread.
"""

import argparse
import csv
import math
import pathlib
import resource
import statistics
import subprocess
import tempfile

import numpy as np

INPUTS = 10


def drawn_function(random):
    parts = []
    for _ in range(random.integers(2, 6)):
        i, j, k = random.permutation(INPUTS)[:3]
        a, w, c = random.uniform(0.5, 2), random.uniform(1, 4), random.uniform(0.3, 0.7)
        parts.append([
            lambda x, i=i, j=j, a=a, w=w: a * np.sin(w * np.pi * x[:, i] * x[:, j]),
            lambda x, i=i, a=a, c=c: 3 * a * np.maximum(0, x[:, i] - c),
            lambda x, i=i, j=j, a=a: a / (0.3 + x[:, i]) * x[:, j],
            lambda x, i=i, j=j, k=k, a=a: 4 * a * (x[:, i] - 0.5) * (x[:, j] - 0.5) + a * x[:, k],
            lambda x, i=i, j=j, a=a: a * np.exp(-((x[:, i] - 0.4) ** 2 + (x[:, j] - 0.6) ** 2) / 0.05),
        ][random.integers(5)])
    for _ in range(random.integers(0, 4)):
        i, j, k = random.permutation(INPUTS)[:3]
        a, c = random.uniform(0.2, 1.5), random.uniform(0.3, 0.7)
        parts.append([
            lambda x, i=i, a=a, c=c: a * (x[:, i] > c),
            lambda x, i=i, j=j, k=k, a=a, c=c: a * (x[:, i] + 0.3 * x[:, j] - x[:, k] > c - 0.4),
            lambda x, i=i, j=j, a=a, c=c: a * (x[:, i] > c) * x[:, j],
        ][random.integers(3)])
    return lambda x: sum(part(x) for part in parts)


def write(path, x, y):
    head = ",".join([f"x{k}" for k in range(INPUTS)] + ["y"])
    np.savetxt(path, np.c_[x, y], fmt="%.8g", delimiter=",", header=head, comments="")


def fitted(program, folder):
    """Error, CPU seconds of the fit, and whether its trees are soft."""
    before = resource.getrusage(resource.RUSAGE_CHILDREN).ru_utime
    text = subprocess.run([program, "fit", f"{folder}/train.csv", "-t", "y", "--boost", "--threads", "1", "-o",
                           f"{folder}/m.json"], check=True, capture_output=True, text=True).stdout
    seconds = resource.getrusage(resource.RUSAGE_CHILDREN).ru_utime - before
    subprocess.run([program, "predict", f"{folder}/m.json", f"{folder}/test.csv", "-o", f"{folder}/p.csv"], check=True,
                   capture_output=True)
    with open(f"{folder}/p.csv") as file:
        squares = [(float(row["y"]) - float(row["y_pred"])) ** 2 for row in csv.DictReader(file)]
    return math.sqrt(statistics.mean(squares)), seconds, "soft" in text


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("programs", nargs=2, type=pathlib.Path, metavar="PROGRAM")
    parser.add_argument("--seeds", default="1:31", metavar="FIRST:END")
    options = parser.parse_args()
    errors, times = [], []
    for seed in range(*map(int, options.seeds.split(":"))):
        random = np.random.default_rng(seed)
        function, noise = drawn_function(random), 10 ** random.uniform(-2, 0)
        rows = 100_000 if seed % 3 == 0 else (20_000, 50_000)[seed % 2]
        with tempfile.TemporaryDirectory() as folder:
            x = random.random((rows, INPUTS))
            write(f"{folder}/train.csv", x, function(x) + noise * random.standard_normal(rows))
            x = random.random((10_000, INPUTS))
            write(f"{folder}/test.csv", x, function(x))
            first, second = (fitted(program.resolve(), folder) for program in options.programs)
        errors.append(second[0] / first[0])
        times.append(second[1] / first[1])
        print(f"{seed:4} {rows:6} rows, noise {noise:.3f}:", *(
            f"{'soft' if soft else 'crisp'} {error:.4f} {seconds:.1f} s;" for error, seconds, soft in (first, second)),
            f"error {errors[-1]:.3f}, time {times[-1]:.2f}", flush=True)
    other = [k for k, error in enumerate(errors) if error != 1.0]
    print(f"{len(errors)} functions, {len(other)} differ; geometric means: error {statistics.geometric_mean(errors):.4f}, "
          f"time {statistics.geometric_mean(times):.3f}")
    if other:
        print(f"of those that differ: error {statistics.geometric_mean([errors[k] for k in other]):.4f}, "
              f"time {statistics.geometric_mean([times[k] for k in other]):.3f}")


if __name__ == "__main__":
    main()
