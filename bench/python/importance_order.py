"""Do the inputs stand in the order that scikit-learn's permutation importance gives?

    PYTHONPATH=build/release/python python bench/python/importance_order.py ../shared/data/regression

FOLDER has NAME.csv with the target `y` and NAME.splits.csv with a column a split, 1: a test row. Of the first split: the
default fit of the training rows, and on the same test rows (at most 2000) `model.permutation_importance` and
`sklearn.inspection.permutation_importance` of the same model, scored by the root mean square error, ten repeats each. Of
the inputs whose increase is above two of its standard errors the two orders are compared: pairs that stand the other way
round, and of these the ones whose increases differ by more than two standard errors of scikit-learn's ten repeats.
Needs scikit-learn.
"""

import argparse
import csv
import pathlib

import numpy as np
from sklearn.inspection import permutation_importance

from llmt import LocalLinearTreeRegressor


def read(path):
    with open(path, newline="") as file:
        rows = list(csv.reader(file))
    return rows[0], np.array(rows[1:], dtype=float)


def line(name, folder, rows, repeats):
    header, table = read(folder / f"{name}.csv")
    is_test = read(folder / f"{name}.splits.csv")[1][:, 0] == 1
    model = LocalLinearTreeRegressor(n_jobs=1).fit(table[~is_test, :-1], table[~is_test, -1])
    test = table[is_test][:rows]
    own = model.permutation_importance(test[:, :-1], test[:, -1], n_repeats=repeats).set_index("input")
    rival = permutation_importance(model, test[:, :-1], test[:, -1], scoring="neg_root_mean_squared_error",
                                   n_repeats=repeats, random_state=1)
    above = own[own["increase"] > 2 * own["standard_error"]]
    place = {f"x{j}": j for j in range(table.shape[1] - 1)}
    order = [place[each] for each in above.index]
    means = rival.importances_mean
    error = rival.importances_std / np.sqrt(repeats)
    swapped = [(a, b) for k, a in enumerate(order) for b in order[k + 1:] if means[a] < means[b]]
    clear = [(a, b) for a, b in swapped if means[b] - means[a] > 2 * np.hypot(error[a], error[b])]
    pairs = len(order) * (len(order) - 1) // 2
    print(f"| {name} | {len(test)} | {len(order)} of {len(place)} | {pairs} | {len(swapped)} | {len(clear)} "
          f"| {', '.join(header[j] for j in order[:4])} |", flush=True)
    return len(swapped), len(clear)


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("data", type=pathlib.Path)
    parser.add_argument("--rows", type=int, default=2000)
    parser.add_argument("--repeats", type=int, default=10)
    arguments = parser.parse_args()
    print("| set | rows | inputs above 2 s | pairs | other way round | beyond chance | the first |")
    print("| --- | --- | --- | --- | --- | --- | --- |", flush=True)
    found = [line(path.name[: -len(".splits.csv")], arguments.data, arguments.rows, arguments.repeats)
             for path in sorted(arguments.data.glob("*.splits.csv"))]
    print(f"\nsame order on {sum(s == 0 for s, _ in found)} of {len(found)} sets, up to chance on "
          f"{sum(c == 0 for _, c in found)}")


if __name__ == "__main__":
    main()
