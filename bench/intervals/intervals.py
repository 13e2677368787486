"""Coverage, width and interval score of 90 % intervals: llmt, crepes on CatBoost, and an exact method, in one run.

    pip install -r bench/intervals/requirements.txt
    python bench/intervals/intervals.py [--llmt PROGRAM]... [--data FOLDER] [--splits 1] [--seeds 2] [--no-rivals]

Several programs are compared in the order in which they are given; scores are relative to the first one's tree. Fifths
are of a forest's prediction and of a forest's absolute error, the same for all methods. An exact method holds each row
with probability 0.9, whatever its group. The score is that of Winkler: width + 2 / 0.1 times the distance outside.
"""

import argparse
import subprocess
import tempfile
from collections import defaultdict
from pathlib import Path

import numpy as np
import pandas as pd
from tables import MADE, SETS, made, options_of, public

ALPHA = 0.1


def by_llmt(program, train, test, *options):
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        train.to_csv(folder / "train.csv", index=False)
        test.to_csv(folder / "test.csv", index=False)

        def run(*arguments):
            subprocess.run([program, *map(str, arguments), "--threads", "1"], check=True, capture_output=True)

        weight = ("--weight", "weight") if "weight" in train else ()
        run("fit", folder / "train.csv", "-t", "y", "-o", folder / "model.json", *weight, *options)
        model = folder / ("model.readable.json" if "--readable" in options else "model.json")
        ask = ("predict", model, folder / "test.csv", "--interval", 1 - ALPHA, "-o", folder / "out.csv")
        try:
            run(*ask, *weight)
        except subprocess.CalledProcessError:
            if not weight:
                raise
            run(*ask)  # a program whose intervals know no weights
        out = pd.read_csv(folder / "out.csv")
        in_gap = out["in_gap"].to_numpy() if "in_gap" in out else None
        return out["y_low"].to_numpy(), out["y_high"].to_numpy(), in_gap


def numbers(train, test):
    """Inputs as numbers, categories as positions in the order of their names."""
    X, Z = (table.drop(columns=["y", "weight"], errors="ignore").copy() for table in (train, test))
    for column in X:
        if X[column].dtype.kind not in "fiu":
            levels = {level: k for k, level in enumerate(sorted(X[column].dropna().unique()))}
            X[column], Z[column] = X[column].map(levels), Z[column].map(levels)
    return X.to_numpy(float), Z.to_numpy(float)


def by_crepes(train, test, seed=0):
    """Normalised conformal prediction on CatBoost in five folds, difficulty by a forest of the absolute residuals.

    Errors are multiplied by the root of the row's weight before they are learnt, and divided by it afterwards.
    """
    from catboost import CatBoostRegressor
    from crepes import ConformalRegressor
    from sklearn.ensemble import RandomForestRegressor

    X, Z = numbers(train, test)
    X, Z, y = np.nan_to_num(X, nan=-999), np.nan_to_num(Z, nan=-999), train["y"].to_numpy()
    w, v = (table["weight"].to_numpy() if "weight" in table else np.ones(len(table)) for table in (train, test))
    fold = np.random.default_rng(seed).permutation(len(y)) % 5
    held_out, predicted = np.empty(len(y)), np.zeros(len(Z))
    for k in range(5):
        model = CatBoostRegressor(verbose=0, thread_count=1, random_seed=seed)
        model.fit(X[fold != k], y[fold != k], sample_weight=w[fold != k])
        held_out[fold == k] = model.predict(X[fold == k])
        predicted += model.predict(Z) / 5
    residuals = y - held_out
    sizes = np.abs(residuals) * np.sqrt(w)
    at_train, at_test = np.empty(len(y)), np.zeros(len(Z))
    for k in range(5):
        forest = RandomForestRegressor(100, min_samples_leaf=10, max_features=0.5, random_state=seed)
        forest.fit(X[fold != k], sizes[fold != k])
        at_train[fold == k] = forest.predict(X[fold == k])
        at_test += forest.predict(Z) / 5
    floor = 0.05 * sizes.mean()
    conformal = ConformalRegressor().fit(residuals, sigmas=(at_train + floor) / np.sqrt(w))
    ends = conformal.predict_int(predicted, sigmas=(at_test + floor) / np.sqrt(v), confidence=1 - ALPHA)
    return ends[:, 0], ends[:, 1], None


def forest_keys(train, test):
    from sklearn.ensemble import RandomForestRegressor

    X, Z = numbers(train, test)
    X, Z = np.nan_to_num(X, nan=-999), np.nan_to_num(Z, nan=-999)
    mean = RandomForestRegressor(60, min_samples_leaf=5, max_features=0.5, oob_score=True, random_state=0)
    mean.fit(X, train["y"])
    size = RandomForestRegressor(60, min_samples_leaf=15, max_features=0.5, random_state=0)
    size.fit(X, np.abs(train["y"] - mean.oob_prediction_))
    return mean.predict(Z), size.predict(Z)


def fifths(key, inside):
    return [inside[rows].mean() for rows in np.array_split(np.argsort(key, kind="stable"), 5)]


def judged(low, high, in_gap, test, keys):
    y = test["y"].to_numpy()
    inside = (low <= y) & (y <= high)
    outside = np.maximum(low - y, 0) + np.maximum(y - high, 0)
    return inside, {
        "coverage": inside.mean(),
        "width": np.mean(high - low),
        "score": np.mean(high - low + 2 / ALPHA * outside),
        "of prediction": fifths(keys[0], inside),
        "of difficulty": fifths(keys[1], inside),
        "rows": len(y),
        "in gaps": in_gap,
    }


def methods_of(arguments):
    methods = {}
    for k, program in enumerate(arguments.llmt):
        label = "" if len(arguments.llmt) == 1 else f" {k + 1}"
        methods[f"tree{label}"] = lambda train, test, told, p=program: by_llmt(p, train, test, *told)
        methods[f"sum{label}"] = lambda train, test, told, p=program: by_llmt(p, train, test, "--boost")
        if arguments.readable:
            methods[f"readable{label}"] = lambda train, test, told, p=program: by_llmt(p, train, test, "--readable", *told)
    if not arguments.no_rivals:
        methods["crepes"] = lambda train, test, told: by_crepes(train, test)
    return methods


def summary(results, first, names):
    """One line a method over the given tables."""
    print(f"\n{'over ' + str(len(names)) + ' tables':14} cov.  worst pred  worst diff  best diff  in band  score  w/o yacht")
    for method in results:
        of = [results[method][name] for name in names]
        bands = [f for r in of if r["rows"] >= 800 for f in r["of prediction"] + r["of difficulty"]]
        ratios = {n: results[method][n]["score"] / results[first][n]["score"] for n in names}
        scores = [np.exp(np.mean(np.log([r for n, r in ratios.items() if not n.startswith(out)]))) for out in ("-", "yacht")]
        print(
            f"{method:14} {np.mean([r['coverage'] for r in of]):.3f}"
            f" {np.mean([min(r['of prediction']) for r in of]):9.3f} {np.mean([min(r['of difficulty']) for r in of]):11.3f}"
            f" {np.mean([max(r['of difficulty']) for r in of]):10.3f}"
            f" {np.mean([0.87 <= f <= 0.93 for f in bands]) if bands else np.nan:9.2f} {scores[0]:7.3f} {scores[1]:8.3f}"
        )


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--llmt", action="append", help="program, several times for several versions")
    parser.add_argument("--data", help="folder of public sets: NAME.csv, NAME.splits.csv")
    parser.add_argument("--sets", default=",".join(SETS))
    parser.add_argument("--splits", type=int, default=1)
    parser.add_argument("--seeds", type=int, default=2)
    parser.add_argument("--made", default=";".join(MADE), help="names of made tables, separated by semicolons")
    parser.add_argument("--readable", action="store_true")
    parser.add_argument("--no-rivals", action="store_true")
    arguments = parser.parse_args()
    arguments.llmt = arguments.llmt or ["llmt"]
    methods = methods_of(arguments)
    first = next(iter(methods))
    results = defaultdict(dict)
    groups, flagged = (defaultdict(lambda: defaultdict(list)) for _ in range(2))
    asked = arguments.made.split(";")
    tables = [(f"{name} {seed}", made(name, seed)) for name in asked for seed in range(1, arguments.seeds + 1)]
    if arguments.data:
        names = arguments.sets.split(",")
        tables += [(f"{n} {s}", public(arguments.data, n, s)) for n in names for s in range(arguments.splits)]
    for name, (train, test, of_rows) in tables:
        keys = forest_keys(train, test)
        rng = np.random.default_rng(1)
        exact = fifths(keys[0], rng.uniform(size=len(test)) < 1 - ALPHA)
        print(f"\n{name}: {len(train)} rows; exact: worst fifth {min(exact):.3f}")
        for method, ends in methods.items():
            inside, found = judged(*ends(train, test, options_of(name.rsplit(" ", 1)[0])), test, keys)
            results[method][name] = found
            line = f"{method:14} coverage {found['coverage']:.3f} width {found['width']:8.4g} score {found['score']:8.4g}"
            for what in ("of prediction", "of difficulty"):
                line += f"  {what} " + " ".join(f"{share:.2f}" for share in found[what])
            if found["in gaps"] is not None:
                line += f"  in gaps: {found['in gaps'].mean():.3f}"
            for what, group in of_rows.items():
                for value in np.unique(group):
                    share = inside[np.asarray(group) == value].mean()
                    groups[method, name.rsplit(" ", 1)[0], what][value].append(share)
                    line += f"  {what} {value}: {share:.2f}"
                    if found["in gaps"] is not None:
                        in_gap = found["in gaps"][np.asarray(group) == value].mean()
                        flagged[method, name.rsplit(" ", 1)[0], what][value].append(in_gap)
            print(line, flush=True)
    of_sets = [name for name, _ in tables if name.split()[0] in SETS]
    of_made = [name for name, _ in tables if name not in of_sets]
    for names in (of_made, of_sets):
        if names:
            summary(results, first, names)
    for title, shares_of in (("coverage by group", groups), ("in gaps by group", flagged)):
        print(f"\n{title}, mean of the seeds")
        for (method, name, what), of_values in shares_of.items():
            means = " ".join(f"{value}: {np.mean(shares):.3f}" for value, shares in of_values.items())
            print(f"{method:14} {name}, {what}: {means}")


if __name__ == "__main__":
    main()
