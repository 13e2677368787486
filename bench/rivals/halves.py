#!/usr/bin/env python3
"""Two programs `llmt` on the same tables, of which one half chooses and the other confirms.

    python3 bench/rivals/half_tables.py FOLDER                      # tables: public ones and made ones
    python3 bench/rivals/halves.py FOLDER --name before --llmt BUILD_BEFORE/bin/llmt
    python3 bench/rivals/halves.py FOLDER --name after
    python3 bench/rivals/halves.py FOLDER --table before after

FOLDER has NAME.csv with a numeric target y, and halves.json, {"NAME": "choose" or "confirm"}. A quarter of the rows, at
random, is the test; at most 7000 of the others are learned from. Fewer rows have more splits: 6 below 100 rows, 4 below
500, 2 below 2000. What the results file has is not measured again.
"""
import argparse
import csv
import json
import math
import pathlib
import random
import resource
import statistics
import subprocess
import sys
import tempfile

ROOT = pathlib.Path(__file__).resolve().parents[2]
MOST_ROWS = 7000
SPLITS = [(100, 6), (500, 4), (2000, 2), (sys.maxsize, 1)]  # tables below so many rows have so many splits
SAME = 0.0005  # ratios that differ from 1 by less are called equal


def arguments():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("folder", type=pathlib.Path)
    parser.add_argument("--llmt", default=ROOT / "build/release/bin/llmt", help="the program; default: %(default)s")
    parser.add_argument("--name", help="under which its results are kept; fits all tables")
    parser.add_argument("--options", default="--boost", help="of llmt fit; default: %(default)s")
    parser.add_argument("--only", metavar="TABLE,...", help="tables; default: all")
    parser.add_argument("--least", type=int, default=0, help="rows of a table, at least")
    parser.add_argument("--below", type=int, default=sys.maxsize, help="only tables with fewer rows")
    parser.add_argument("--results", default=ROOT / "build/halves.jsonl", type=pathlib.Path,
                        help="file of all fits; default: %(default)s")
    parser.add_argument("--table", nargs=2, metavar=("BEFORE", "AFTER"), help="print the halves' ratios of two names")
    return parser.parse_args()


def read(path):
    with open(path) as file:
        rows = csv.reader(file)
        return next(rows), list(rows)


def write(path, head, rows):
    with open(path, "w") as file:
        writer = csv.writer(file, lineterminator="\n")
        writer.writerow(head)
        writer.writerows(rows)


def tables(options):
    """name -> rows of the table, smallest first."""
    halves = json.loads((options.folder / "halves.json").read_text())
    names = options.only.split(",") if options.only else halves
    rows = {name: len(read(options.folder / f"{name}.csv")[1]) for name in names}
    return {name: rows[name] for name in sorted(rows, key=lambda name: (rows[name], name))
            if options.least <= rows[name] < options.below}


def results(options):
    if not options.results.exists():
        return {}
    lines = map(json.loads, options.results.read_text().splitlines())
    return {(line["name"], line["table"], line["split"]): line for line in lines}


def fit(options, name, split, folder):
    """Test RMSE, and CPU seconds of the fit."""
    head, rows = read(options.folder / f"{name}.csv")
    random.Random(1000 + split).shuffle(rows)
    tested = max(1, len(rows) // 4)
    train, test, model, predicted = (pathlib.Path(folder) / one for one in ("t.csv", "n.csv", "m.json", "p.csv"))
    write(train, head, rows[tested:][:MOST_ROWS])
    write(test, head, rows[:tested])
    for file in (model, predicted):
        file.unlink(missing_ok=True)
    before = resource.getrusage(resource.RUSAGE_CHILDREN)
    subprocess.run([options.llmt, "fit", train, "-t", "y", "-o", model, "--threads", "1", "--seed", "1",
                    *options.options.split()], check=True, capture_output=True)
    after = resource.getrusage(resource.RUSAGE_CHILDREN)
    subprocess.run([options.llmt, "predict", model, test, "-o", predicted], check=True, capture_output=True)
    head, rows = read(predicted)
    y, own = head.index("y"), head.index("y_pred")
    squares = [(float(row[y]) - float(row[own])) ** 2 for row in rows]
    seconds = after.ru_utime + after.ru_stime - before.ru_utime - before.ru_stime
    return {"rmse": math.sqrt(statistics.mean(squares)), "cpu": seconds}


def measure(options):
    done = results(options)
    with open(options.results, "a") as file, tempfile.TemporaryDirectory() as folder:
        for table, rows in tables(options).items():
            for split in range(next(splits for below, splits in SPLITS if rows < below)):
                if (options.name, table, split) in done:
                    continue
                line = {"name": options.name, "table": table, "split": split, **fit(options, table, split, folder)}
                file.write(json.dumps(line) + "\n")
                file.flush()


def print_table(options):
    halves = json.loads((options.folder / "halves.json").read_text())
    before, after = options.table
    lines = results(options)
    ratios = {}
    for table in tables(options):
        both = [(lines[before, table, split], lines[after, table, split]) for split in range(6)
                if (before, table, split) in lines and (after, table, split) in lines]
        if both and all(one["rmse"] > 0.0 for one, _ in both):
            ratios[table] = [sum(new[key] for _, new in both) / sum(old[key] for old, _ in both)
                             for key in ("rmse", "cpu")]
    print("| half | tables | error, geometric mean | better | worse | largest loss | largest gain | CPU |")
    print("| --- | --- | --- | --- | --- | --- | --- | --- |")
    for half in ("choose", "confirm"):
        names = sorted((name for name in ratios if halves[name] == half), key=lambda name: ratios[name][0])
        if not names:
            continue
        error, seconds = (statistics.geometric_mean(ratios[name][k] for name in names) for k in (0, 1))
        better = sum(ratios[name][0] < 1 - SAME for name in names)
        worse = sum(ratios[name][0] > 1 + SAME for name in names)
        last, first = (f"{name} {ratios[name][0]:.3f}" for name in (names[-1], names[0]))
        print(f"| {half} | {len(names)} | {error:.4f} | {better} | {worse} | {last} | {first} | {seconds:.2f} |")
    print("\n| table | rows | half | error | CPU |\n| --- | --- | --- | --- | --- |")
    for name, rows in tables(options).items():
        if name in ratios and abs(ratios[name][0] - 1) > SAME:
            print(f"| {name} | {rows} | {halves[name]} | {ratios[name][0]:.3f} | {ratios[name][1]:.2f} |")


def main():
    options = arguments()
    if options.name:
        measure(options)
    if options.table:
        print_table(options)


if __name__ == "__main__":
    main()
