#!/usr/bin/env python3
"""What `llmt check` says of new rows of which it is known what changed: the rate of each verdict.

    python3 bench/tables/check_rates.py build/release/bin/llmt                    40 draws of 200 rows, tree and sum
    python3 bench/tables/check_rates.py build/release/bin/llmt --draws 200 --rows 100

A table of 800 rows: six numbers, a category of four levels, y with a step, a curve, a product and noise whose standard
deviation grows with one input from 0.2 to 0.6. A draw is a new table of each kind:
  unchanged   drawn as the table of the fit
  noise       its standard deviation doubled
  shift       one input moved by a third of its standard deviation, and y with it
  category    a level has another name in a tenth of the rows
  swapped     two inputs of one distribution in each other's column
Needs NumPy.
"""

import argparse
import collections
import csv
import json
import pathlib
import subprocess
import tempfile

import numpy as np

NAMES = ["a", "b", "c", "d", "e", "f", "mode", "y"]
LEVELS = np.array(["auto", "dry", "eco", "off"])
CODES = {0: "good", 3: "moved", 1: "no longer good", 4: "not evaluated"}


def table(random, rows, noise=1.0, shift=0.0):
    x = random.normal(size=(rows, 6))
    x[:, 5] = random.uniform(size=rows)
    x[:, 1] += shift
    mode = random.integers(0, 4, size=rows)
    y = 2 * (x[:, 0] > 0.3) + np.sin(2 * x[:, 1]) + 0.8 * x[:, 2] * x[:, 3] + 0.5 * mode + 0.3 * x[:, 4]
    return x, LEVELS[mode], y + noise * (0.2 + 0.4 * x[:, 5]) * random.normal(size=rows)


def of_kind(kind, random, rows):
    x, mode, y = table(random, rows, noise=2.0 if kind == "noise" else 1.0, shift=1 / 3 if kind == "shift" else 0.0)
    if kind == "category":
        mode = np.where(random.uniform(size=rows) < 0.1, "AUTO", mode)
    if kind == "swapped":
        x[:, [0, 2]] = x[:, [2, 0]]
    return x, mode, y


def write(path, x, mode, y):
    with open(path, "w", newline="") as file:
        writer = csv.writer(file)
        writer.writerow(NAMES)
        writer.writerows([*row, word, value] for row, word, value in zip(x.tolist(), mode, y.tolist()))


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("llmt")
    parser.add_argument("--draws", type=int, default=40)
    parser.add_argument("--rows", type=int, default=200)
    arguments = parser.parse_args()
    kinds = ["unchanged", "noise", "shift", "category", "swapped"]
    print("| model | new rows | " + " | ".join(CODES.values()) + " | named |")
    print("| --- " * (len(CODES) + 3) + "|")
    with tempfile.TemporaryDirectory() as name:
        folder = pathlib.Path(name)
        for options in ([], ["--boost"]):
            counts = {kind: collections.Counter() for kind in kinds}
            named = collections.Counter()
            for draw in range(arguments.draws):
                random = np.random.default_rng([20261129, draw])
                write(folder / "train.csv", *table(random, 800))
                fit = [arguments.llmt, "fit", folder / "train.csv", "-t", "y", "-o", folder / "m.json", "--threads", "1"]
                subprocess.run(fit + options, check=True, capture_output=True)
                for kind in kinds:
                    write(folder / "new.csv", *of_kind(kind, random, arguments.rows))
                    ask = [arguments.llmt, "check", folder / "m.json", folder / "new.csv", "--json"]
                    said = subprocess.run(ask, capture_output=True, text=True)
                    counts[kind][CODES[said.returncode]] += 1
                    moved = {of["name"] for of in json.loads(said.stdout)["inputs"] if of["moved"]}
                    wanted = {"shift": "b", "category": "mode"}.get(kind)
                    named[kind] += wanted in moved if wanted else not moved
            for kind in kinds:
                cells = [str(counts[kind][word]) for word in CODES.values()]
                print(f"| {'sum' if options else 'tree'} | {kind} | " + " | ".join(cells) + f" | {named[kind]} |", flush=True)
    print("\nnamed: the input that changed is said to have moved; where none changed, that none is.")


if __name__ == "__main__":
    main()
