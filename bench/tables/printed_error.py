#!/usr/bin/env python3
"""Is the printed held-out error the error on new rows? Tables as people have them, drawn by a seed.

    python3 bench/tables/printed_error.py build/release/bin/llmt                 42 tables, seed 20261128
    python3 bench/tables/printed_error.py build/release/bin/llmt --seed 7 --tables 8

For each table `llmt fit --readable` and `llmt fit --boost` with defaults; their printed error over the error on 4000 new
rows, which are drawn as the table was: new states of a log, rows of new machines where the table has groups, the words
that the table has. Needs NumPy.
"""

import argparse
import csv
import json
import pathlib
import subprocess
import tempfile

import numpy as np

NEW_ROWS = 4000


class Truth:
    """A function of numbers with a curve, a step, a product and a gate, drawn once for a table."""

    def __init__(self, random, inputs):
        self.linear = random.normal(size=inputs) * (random.random(inputs) < 0.7)
        self.places = random.integers(0, inputs, size=4)
        self.step = random.normal()
        self.sizes = random.uniform(0.3, 1.5, size=3) * random.choice([-1.0, 1.0], size=3)

    def __call__(self, x):
        a, b, c, d = (x[:, k] for k in self.places)
        return (x @ self.linear + self.sizes[0] * np.sin(2 * a) + self.sizes[1] * b * c +
                self.sizes[2] * (d > 0.5 * self.step))


def count(random, low=50, high=5000):
    return int(np.exp(random.uniform(np.log(low), np.log(high))))


def plain(random):
    """Independent rows."""
    inputs, noise = random.integers(2, 11), random.uniform(0.05, 0.5)
    truth = Truth(random, inputs)

    def draw(rows, _):
        x = random.normal(size=(rows, inputs))
        return x, truth(x) + noise * random.normal(size=rows), {}

    return draw(count(random), False), draw(NEW_ROWS, True), []


def log_of_states(random):
    """Every state logged several times, the sensors differing in the last digits; some logs have a time stamp.

    New states are of the same time: of later ones no held-out row of the table can tell.
    """
    inputs, times = random.integers(2, 7), random.integers(2, 9)
    jitter, hidden = random.choice([0.0, 1e-15, 1e-12, 1e-9, 1e-7]), random.uniform(0.2, 0.8)
    has_time = random.random() < 0.5
    truth = Truth(random, inputs)

    def draw(rows, is_new):
        repeats = 1 if is_new else times
        states = max(40, rows // repeats)
        state = random.normal(size=(states, inputs))
        of_state = truth(state) + hidden * random.normal(size=states)
        x = np.repeat(state, repeats, axis=0)
        x = x + jitter * random.normal(size=x.shape)
        y = np.repeat(of_state, repeats) + 0.02 * random.normal(size=len(x))
        time = 1.7e9 + 1e4 * np.sort(random.random(len(x)))
        return x, y, {"time": time} if has_time else {}

    return draw(count(random, 200), False), draw(NEW_ROWS, True), []


def machines(random):
    """Rows of machines with a character of their own, and new rows of other machines; the groups are said."""
    inputs, own = random.integers(2, 7), random.uniform(0.2, 1.0)
    truth = Truth(random, inputs)
    machines_there = random.integers(12, 40)

    def draw(rows, is_new):
        number = 400 if is_new else machines_there
        machine = random.integers(0, number, size=rows)
        place = random.normal(size=(number, inputs))
        offset = own * random.normal(size=number)
        x = place[machine] + 0.3 * random.normal(size=(rows, inputs))
        y = truth(x) + offset[machine] + 0.1 * random.normal(size=rows)
        return x, y, {"machine": np.array([f"m{k}" for k in machine])}

    return draw(count(random, 200), False), draw(NEW_ROWS, True), ["--groups", "machine"]


def words(random):
    """Numbers and words, most of them rare, each with an effect of its own."""
    inputs, levels = random.integers(2, 6), random.integers(5, 41)
    truth = Truth(random, inputs)
    effect = random.normal(size=levels) * random.uniform(0.5, 2.0)
    frequency = 1.0 / np.arange(1, levels + 1) ** random.uniform(0.5, 1.5)
    frequency /= frequency.sum()

    def draw(rows, _):
        x = random.normal(size=(rows, inputs))
        word = random.choice(levels, p=frequency, size=rows)
        y = truth(x) + effect[word] * (1.0 + 0.3 * x[:, 0]) + 0.3 * random.normal(size=rows)
        return x, y, {"shop": np.array([f"shop{k}" for k in word])}

    return draw(count(random, 150), False), draw(NEW_ROWS, True), []


def few(random):
    """Few rows of many inputs that say the same few things."""
    inputs, factors = random.integers(8, 31), random.integers(2, 6)
    loading = random.normal(size=(factors, inputs))
    slope = random.normal(size=factors)

    def draw(rows, _):
        factor = random.normal(size=(rows, factors))
        x = factor @ loading + 0.3 * random.normal(size=(rows, inputs))
        return x, factor @ slope + 0.5 * np.sin(2 * factor[:, 0]) + 0.3 * random.normal(size=rows), {}

    return draw(count(random, 50, 150), False), draw(NEW_ROWS, True), []


def factorial(random):
    """A designed experiment with replicates of part of the settings; new rows are of the other settings."""
    levels = random.integers(3, 7, size=3)
    replicates, noise = random.integers(2, 9), random.uniform(0.05, 0.3)
    truth = Truth(random, 3)
    cells = np.stack(np.meshgrid(*(np.linspace(-1.5, 1.5, k) for k in levels), indexing="ij"), -1).reshape(-1, 3)
    cells = cells[random.permutation(len(cells))]
    there = 2 * len(cells) // 3

    def draw(rows, is_new):
        x = cells[random.integers(there, len(cells), size=rows)] if is_new else np.repeat(cells[:there], replicates, axis=0)
        x = x[random.permutation(len(x))]
        return x, truth(x) + noise * random.normal(size=len(x)), {}

    return draw(0, False), draw(NEW_ROWS, True), []


def catalogue(random):
    """Things that are listed once or several times, each with a quality of its own; new rows list the same things."""
    inputs, rows_there = random.integers(4, 11), count(random, 300)
    truth = Truth(random, inputs)
    things = random.normal(size=(2 * rows_there, inputs))
    quality = random.uniform(0.3, 1.0) * random.normal(size=len(things))
    frequency = random.exponential(size=len(things)) ** random.uniform(0.5, 1.5)
    frequency /= frequency.sum()

    def draw(rows, _):
        thing = random.choice(len(things), p=frequency, size=rows)
        return things[thing], truth(things[thing]) + quality[thing] + 0.1 * random.normal(size=rows), {}

    return draw(rows_there, False), draw(NEW_ROWS, True), []


KINDS = (plain, log_of_states, machines, words, few, factorial, catalogue)


def write(path, table):
    x, y, other = table
    names = [f"x{k + 1}" for k in range(x.shape[1])]
    with open(path, "w", newline="") as file:
        writer = csv.writer(file)
        writer.writerow([*names, *other, "y"])
        for k in range(len(y)):
            writer.writerow([*(repr(float(value)) for value in x[k]), *(of[k] for of in other.values()), repr(float(y[k]))])


def run(command):
    done = subprocess.run([str(part) for part in command], capture_output=True, text=True)
    if done.returncode != 0:
        raise SystemExit(f"{' '.join(map(str, command))}\n{done.stderr}")
    return done.stdout


def paid(llmt, folder, model, y):
    run([llmt, "predict", model, folder / "new.csv", "-o", folder / "predicted.csv"])
    with open(folder / "predicted.csv", newline="") as file:
        rows = list(csv.reader(file))
    column = max(k for k, name in enumerate(rows[0]) if name.startswith("y") and "pred" in name)
    predicted = np.array([float(row[column]) for row in rows[1:]])
    return float(np.sqrt(np.mean((predicted - y) ** 2)))


def ratios(llmt, folder, train, new, options):
    """Printed error over paid error by kind of model."""
    write(folder / "train.csv", train)
    write(folder / "new.csv", new)
    y = new[1]
    found = {}
    tree = json.loads(run([llmt, "fit", folder / "train.csv", "-t", "y", "--readable", "--json", "--threads", 1, "-o",
                           folder / "m.json", *options]))
    found["tree"] = tree["partitions"][0]["chosen"]["cv_rmse"], paid(llmt, folder, folder / "m.json", y)
    found["readable"] = tree["readable"][0]["cv_rmse"], paid(llmt, folder, folder / "m.readable.json", y)
    boosted = json.loads(run([llmt, "fit", folder / "train.csv", "-t", "y", "--boost", "--json", "--threads", 1, "-o",
                              folder / "b.json", *options]))
    found["sum"] = boosted["sums"][0]["held_out_rmse"], paid(llmt, folder, folder / "b.json", y)
    return found


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("llmt", type=pathlib.Path)
    parser.add_argument("--seed", type=int, default=20261128)
    parser.add_argument("--tables", type=int, default=42)
    arguments = parser.parse_args()
    all_ratios = {}
    for number in range(arguments.tables):
        random = np.random.default_rng([arguments.seed, number])
        kind = KINDS[number % len(KINDS)]
        train, new, options = kind(random)
        with tempfile.TemporaryDirectory() as folder:
            found = ratios(arguments.llmt, pathlib.Path(folder), train, new, options)
        line = f"{number:3} {kind.__name__:14} {len(train[1]):5} x {train[0].shape[1]:2} "
        for name, (printed, error) in found.items():
            all_ratios.setdefault(name, []).append(printed / error)
            line += f"  {name} {printed:.3f} / {error:.3f} = {printed / error:.2f}"
        print(line, flush=True)
    for name, values in all_ratios.items():
        print(f"{name:9} mean {np.mean(values):.3f}, least {min(values):.2f}, largest {max(values):.2f}, "
              f"within .7 ... 1.4: {sum(0.7 <= value <= 1.4 for value in values)} of {len(values)}")


if __name__ == "__main__":
    main()
