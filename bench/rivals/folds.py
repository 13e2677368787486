#!/usr/bin/env python3
"""The regressors of regressors.py on many tables, over five folds: ranks, R2, errors and times.

    python3 bench/rivals/folds.py FOLDER --below 500           # every NAME.csv with a numeric target y, smallest first
    python3 bench/rivals/folds.py FOLDER --table               # of all results so far
    python3 bench/rivals/folds.py FOLDER --table --published pilot_folds.csv

The folds are scikit-learn's KFold(5, shuffle=True, random_state=42) of the table as it stands, as in the published
results of PILOT. Fits and results file are those of run.py; its --install makes the environment.

A table is compared if all its folds have all regressors that take part. Published results, R2 of a table, fold
(1 to 5) and method, take part in the ranks and in the mean R2.
"""
import argparse
import csv
import pathlib
import statistics
import sys

import run

FOLDS = 5
SMALL = 500  # tables with fewer rows have means of their own
DEFAULT = ["llmt (boost)", "llmt", "ChimeraBoost", "CatBoost", "LightGBM", "XGBoost", "HistGradientBoosting",
           "random forest", "ridge"]


def arguments():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("folder", type=pathlib.Path)
    parser.add_argument("--names", metavar="NAME,...", help="tables; default: all")
    parser.add_argument("--below", metavar="ROWS", type=int, default=sys.maxsize,
                        help="only tables with fewer rows")
    parser.add_argument("--only", metavar="NAME", action="append",
                        help=f"a regressor; may be repeated; default: {', '.join(DEFAULT)}")
    parser.add_argument("--seconds", type=int, default=300, help="CPU time that a fit may take; default: %(default)s")
    parser.add_argument("--llmt", default=run.ROOT / "build/release/bin/llmt", help="the program; default: %(default)s")
    parser.add_argument("--results", default=run.ROOT / "build/folds.jsonl", type=pathlib.Path,
                        help="file of all fits; default: %(default)s")
    parser.add_argument("--table", action="store_true", help="measure nothing, print the tables of the results")
    parser.add_argument("--base", metavar="NAME", default="ChimeraBoost",
                        help="whose errors and times the others are divided by; default: %(default)s")
    parser.add_argument("--published", metavar="FILE", type=pathlib.Path, help="columns table, fold, method and r2")
    options = parser.parse_args()
    options.only = options.only or DEFAULT
    if options.table and options.base not in options.only:
        parser.error(f"--base {options.base} must be among the regressors that are compared")
    options.seeds = 1
    return options


def tables(options):
    """name -> rows, smallest first."""
    found = {}
    for path in options.folder.glob("*.csv"):
        with open(path) as file:
            if "y" in next(file).strip().split(","):
                found[path.stem] = sum(1 for _ in file)
    names = options.names.split(",") if options.names else found
    return {name: found[name] for name in sorted(names, key=lambda name: (found[name], name))
            if found[name] < options.below}


def data_of_folds(options):
    import numpy as np
    from sklearn.model_selection import KFold

    def rows(name, fold):
        with open(options.folder / f"{name}.csv") as file:
            target = next(file).strip().split(",").index("y")
            table = np.loadtxt(file, delimiter=",")
        x, y = np.delete(table, target, axis=1), table[:, target]
        train, test = list(KFold(FOLDS, shuffle=True, random_state=42).split(x))[fold]
        return x[train], y[train], x[test], y[test]

    return [(name, fold, lambda name=name, fold=fold: rows(name, fold))
            for name in tables(options) for fold in range(FOLDS)]


def read_published(path):
    """(table, "published: METHOD") -> R2 of the folds."""
    r2 = {}
    with open(path) as file:
        for line in csv.DictReader(file):
            r2.setdefault((line["table"], f"published: {line['method']}"), []).append(float(line["r2"]))
    return r2


def mean_ranks(scores):
    """name -> mean rank, from name -> scores on the tables; equal ones share the mean of their ranks."""
    by_table = list(zip(*scores.values()))

    def rank(own, others):
        return sum(other > own for other in others) + (1 + others.count(own)) / 2

    return {name: statistics.mean(map(rank, own, by_table)) for name, own in scores.items()}


def print_group(title, names, methods, r2, lines, base):
    """`r2`: (table, method) -> R2 of the folds. `lines`: the same -> lines of the folds, without published methods."""
    ranks = mean_ranks({method: [statistics.mean(r2[name, method]) for name in names] for method in methods})

    def ratios(method, key):
        def mean(name, one):
            return statistics.mean(line[key] for line in lines[name, one])

        return [mean(name, method) / mean(name, base) for name in names]

    rows = []
    for method in sorted(methods, key=ranks.get):
        clipped = statistics.mean(max(0, one) for name in names for one in r2[name, method])
        row = [method, f"{ranks[method]:.2f}", f"{clipped:.4f}"]
        if (names[0], method) in lines:
            errors = ratios(method, "rmse")
            row += [f"{statistics.geometric_mean(errors):.3f}", f"{sum(one < 1 for one in errors)}",
                    f"{statistics.geometric_mean(ratios(method, 'fit_cpu')):.2g}"]
        else:
            row += ["", "", ""]
        rows.append(row)
    run.print_markdown(f"{title}: {len(names)}", ["", "mean rank", "mean R2, at least 0", f"RMSE / {base}",
                                                  f"better than {base}", f"CPU / {base}"], rows)


def print_tables(options):
    lines = {}
    for (table, _, _, regressor), line in sorted(run.read_results(options.results).items()):
        if "failed" in line:
            print(f"{table}, fold {line['split']}, {regressor}: {line['failed']}")
        else:
            lines.setdefault((table, regressor), []).append(line)
    r2 = {one: [line["r2"] for line in folds] for one, folds in lines.items()}
    published = read_published(options.published) if options.published else {}
    r2 |= published
    methods = [*options.only, *dict.fromkeys(method for _, method in published)]
    rows = tables(options)
    names = [name for name in rows if all(len(r2.get((name, method), [])) == FOLDS for method in methods)]
    groups = {
        "All tables": names,
        f"Fewer than {SMALL} rows": [name for name in names if rows[name] < SMALL],
        f"At least {SMALL} rows": [name for name in names if rows[name] >= SMALL],
        "Not Friedman's": [name for name in names if "fri_c" not in name],
        f"Not Friedman's, fewer than {SMALL} rows": [
            name for name in names if "fri_c" not in name and rows[name] < SMALL],
    }
    printed = [[]]
    for title, group in groups.items():
        if group not in printed:
            printed.append(group)
            print_group(title, group, methods, r2, lines, options.base)
    if missing := [name for name in rows if name not in names]:
        print(f"\nNot compared, as folds are missing: {', '.join(missing)}")


def main():
    sys.dont_write_bytecode = True  # no __pycache__ among the sources
    options = arguments()
    run.enter_environment()
    if options.table:
        return print_tables(options)
    return run.measure(options, data_of_folds(options))


if __name__ == "__main__":
    sys.exit(main())
