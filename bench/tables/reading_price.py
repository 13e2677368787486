#!/usr/bin/env python3
"""Is the price of reading that `llmt fit --readable` says the price that is paid on test rows?

    python3 bench/tables/reading_price.py build/release/bin/llmt ../shared/data/regression
    python3 bench/tables/reading_price.py build/release/bin/llmt FOLDER --sets concrete yacht --splits 2
    python3 bench/tables/reading_price.py build/release/bin/llmt FOLDER --rules 5

FOLDER has NAME.csv with the target `y` and NAME.splits.csv with a column a split, 1: a test row. Of each split: the model
and the readable tree of the training rows, per cent that the tree's held-out error is above the model's (said), and per
cent that its error on the test rows is (paid); beside it least squares of all inputs, and Cubist with its defaults where
Python has the package `cubist`. A line is printed a set: said is within the spread of paid if the mean of said lies
between the smallest and the largest paid of the splits. Needs NumPy.
"""

import argparse
import csv
import json
import pathlib
import subprocess
import tempfile

import numpy as np


def read(path):
    with open(path, newline="") as file:
        rows = list(csv.reader(file))
    return rows[0], np.array(rows[1:], dtype=float)


def write(path, header, rows):
    with open(path, "w", newline="") as file:
        out = csv.writer(file)
        out.writerow(header)
        out.writerows([[repr(float(value)) for value in row] for row in rows])


def rmse(predicted, observed):
    return float(np.sqrt(np.mean((predicted - observed) ** 2)))


def least_squares(train, test):
    def rows(table):
        return np.column_stack([np.ones(len(table)), table[:, :-1] - train[:, :-1].mean(axis=0)])

    slopes = np.linalg.lstsq(rows(train), train[:, -1], rcond=None)[0]
    return rmse(rows(test) @ slopes, test[:, -1])


def cubist_error(train, test):
    try:
        from cubist import Cubist
    except ImportError:
        return None
    model = Cubist().fit(train[:, :-1], train[:, -1])
    return rmse(model.predict(test[:, :-1]), test[:, -1])


def one_split(llmt, header, train, test, rules):
    with tempfile.TemporaryDirectory() as folder:
        folder = pathlib.Path(folder)
        write(folder / "train.csv", header, train)
        write(folder / "test.csv", header, test)
        asked = ["--readable"] + ([f"--readable-rules={rules}"] if rules else [])
        command = [llmt, "fit", "train.csv", "-t", "y", "-o", "m.json", "--json"] + asked
        summary = json.loads(subprocess.run(command, cwd=folder, check=True, capture_output=True, text=True).stdout)

        def error(model):
            subprocess.run([llmt, "predict", model, "test.csv", "-o", "p.csv"], cwd=folder, check=True,
                           capture_output=True)
            names, values = read(folder / "p.csv")
            return rmse(values[:, names.index("y_pred")], test[:, -1])

        model, readable = error("m.json"), error("m.readable.json")
    simple, chosen = summary["readable"][0], summary["partitions"][0]["cv_rmse"]
    return {"said": 100 * (simple["cv_rmse"] / chosen - 1), "paid": 100 * (readable / model - 1),
            "rules": simple["leaves"], "size": simple["size"], "model": model, "readable": readable,
            "least_squares": least_squares(train, test), "cubist": cubist_error(train, test),
            "path": simple.get("path", []), "chosen": chosen, "cv_rmse": simple["cv_rmse"]}


def line(name, found):
    said, paid = (np.array([each[key] for each in found]) for key in ("said", "paid"))
    inside = paid.min() <= said.mean() <= paid.max()
    low_high = "{:.0f} to {:.0f}".format
    of = {key: [each[key] for each in found] for key in found[0]}
    cubist = f"{np.mean(of['cubist']):.4g}" if None not in of["cubist"] else "-"
    print(f"| {name} | {said.mean():.0f} % ({low_high(said.min(), said.max())}) "
          f"| {paid.mean():.0f} % ({low_high(paid.min(), paid.max())}) | {'yes' if inside else 'no'} "
          f"| {min(of['rules'])} to {max(of['rules'])}, {min(of['size'])} to {max(of['size'])} "
          f"| {np.mean(of['model']):.4g} | {np.mean(of['readable']):.4g} | {np.mean(of['least_squares']):.4g} "
          f"| {cubist} |", flush=True)
    return inside


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("llmt")
    parser.add_argument("data", type=pathlib.Path)
    parser.add_argument("--sets", nargs="*")
    parser.add_argument("--splits", type=int, default=5)
    parser.add_argument("--rules", type=int, help="the step with this many rules")
    parser.add_argument("--json", type=pathlib.Path, help="also write what was found of each split")
    arguments = parser.parse_args()
    llmt = str(pathlib.Path(arguments.llmt).resolve())
    sets = arguments.sets or sorted(p.name[:-len(".splits.csv")] for p in arguments.data.glob("*.splits.csv"))
    print("| set | said | paid on test rows | within | rules, size | model | readable | least squares | Cubist |")
    print("| --- | --- | --- | --- | --- | --- | --- | --- | --- |", flush=True)
    everything, inside = {}, 0
    for name in sets:
        header, table = read(arguments.data / f"{name}.csv")
        splits = read(arguments.data / f"{name}.splits.csv")[1][:, :arguments.splits]
        everything[name] = [one_split(llmt, header, table[split == 0], table[split == 1], arguments.rules)
                            for split in splits.T]
        inside += line(name, everything[name])
        if arguments.json:
            arguments.json.write_text(json.dumps(everything))
    print(f"\nsaid within the spread of paid: {inside} of {len(sets)}")


if __name__ == "__main__":
    main()
