#!/usr/bin/env python3
"""Makes the ten sets of the README's table from the public files, with the splits that its figures were measured on.

    python3 bench/sets/sets.py DOWNLOADS FOLDER

DOWNLOADS holds the public files under the names below (docs/public-data.md says where they are from); FOLDER gets
NAME.csv and NAME.splits.csv for each that is there, in the form that `study sets --data FOLDER` reads. A file
with other rows than we measured, or in another order, is refused. The splits, NAME.txt beside this script, have one
digit to base 32 for each row: bit k, from the lowest, says whether the row is a test row of split k.
"""
import csv
import gzip
import os
import sys

# Name, public file, and the fingerprint of its numbers.
SETS = [
    ("abalone", "abalone.arff", 0.023357),
    ("airfoil", "airfoil.csv.gz", 0.349887),
    ("california", "cal.housing.arff", 0.101632),
    ("ccpp", "power-plant.txt", -0.001820),
    ("concrete", "concrete.txt", -0.546503),
    ("cpu_act", "cpu.act.arff", 5.495631),
    ("fried", "fried.arff", 0.121953),
    ("kin8nm", "kin8nm.arff", 0.246788),
    ("puma8NH", "puma8NH.arff", -0.215057),
    ("yacht", "yacht.txt", 0.194433),
]
DIGITS = "0123456789abcdefghijklmnopqrstuv"
SPLITS = 5


def read_arff(path):
    """Names and rows; of a nominal attribute all values but the last one in the alphabet become columns of 0 and 1."""
    attributes, rows, in_data = [], [], False
    with open(path) as lines:
        for line in map(str.strip, lines):
            if not line or line.startswith("%"):
                continue
            if in_data:
                rows.append([cell.strip() for cell in line.split(",")])
            elif line.lower().startswith("@attribute"):
                name, kind = line.split(None, 2)[1:]
                values = sorted(v.strip() for v in kind.strip("{}").split(",")) if kind.startswith("{") else None
                attributes.append((name.strip("'\""), values))
            in_data = in_data or line.lower().startswith("@data")
    names, columns = [], []
    for (name, values), cells in zip(attributes, zip(*rows)):
        if values is None:
            names.append(name)
            columns.append([float(cell) for cell in cells])
        else:
            for value in values[:-1]:
                names.append(name + "_" + value)
                columns.append([float(cell == value) for cell in cells])
    return names, [list(row) for row in zip(*columns)]


def read_numbers(path):
    with gzip.open(path, "rt") if path.endswith(".gz") else open(path) as lines:
        rows = [[float(cell) for cell in line.replace(",", " ").split()] for line in lines if line.strip()]
    return [str(k) for k in range(len(rows[0]))], rows


def fingerprint(rows):
    """A number that depends on every cell and its place, and hardly on the last digits that a copy was rounded to."""
    total = 0.0
    for j, column in enumerate(zip(*rows)):
        weights = [(31 * i + 17 * j) % 101 - 50 for i in range(len(column))]
        size = sum(abs(weight * value) for weight, value in zip(weights, column))
        total += (j + 1) * sum(weight * value for weight, value in zip(weights, column)) / size
    return total


def write(path, rows):
    with open(path, "w", newline="") as file:
        csv.writer(file, lineterminator="\n").writerows(rows)


def make(name, source, expected, folder):
    names, rows = read_arff(source) if source.endswith(".arff") else read_numbers(source)
    if not abs(fingerprint(rows) - expected) < 1e-5:
        return f"{name}: {source} is not the file that was measured, or in another order ({fingerprint(rows):.6f})"
    with open(os.path.join(os.path.dirname(os.path.abspath(__file__)), name + ".txt")) as file:
        codes = [DIGITS.index(digit) for digit in file.read() if not digit.isspace()]
    if len(codes) != len(rows):
        return f"{name}: {len(rows)} rows, the splits have {len(codes)}"
    header = [f"x{k}_{column}" for k, column in enumerate(names[:-1])] + ["y"]
    write(os.path.join(folder, name + ".csv"), [header] + [[repr(value) for value in row] for row in rows])
    splits = [[code >> k & 1 for k in range(SPLITS)] for code in codes]
    write(os.path.join(folder, name + ".splits.csv"), [[f"split{k}" for k in range(SPLITS)]] + splits)
    return f"{name}: {len(rows)} rows, {len(header) - 1} inputs"


def main():
    if len(sys.argv) != 3:
        sys.exit(__doc__)
    downloads, folder = sys.argv[1:]
    os.makedirs(folder, exist_ok=True)
    for name, source, expected in SETS:
        path = os.path.join(downloads, source)
        print(make(name, path, expected, folder) if os.path.exists(path) else f"{name}: there is no {path}")


if __name__ == "__main__":
    main()
