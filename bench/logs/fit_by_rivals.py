"""What pysindy and SysIdentPy name on the rows that `llmt discover` gets, beside the program: seeds as in judge.py.

    pip install pysindy==2.1.0 sysidentpy==0.9.0
    python bench/logs/fit_by_rivals.py --program build/release/bin/llmt --seeds 0:32 --results runs.jsonl

Both get a library (polynomials of degree 2 of all inputs, sign, modulus, x |x|, x^3), columns of unit size, with the
derivatives by free parameters projected out first. pysindy: sequentially thresholded least squares of the gap; of five
thresholds the one is taken that leaves least on the last fifth of the rows. SysIdentPy: orthogonal forward regression
by the error reduction ratio (FROLS), as many terms, at most ten, as Akaike's criterion says. Then all rows are fitted.
The results file holds runs of judge.py, for the columns of llmt.
"""

import argparse
import json
import pathlib
import statistics
import tempfile

import numpy as np
import pysindy
from sysidentpy.basis_function import Polynomial
from sysidentpy.model_structure_selection import FROLS

import generate
import judge
import verdicts
import way

THRESHOLDS = (0.02, 0.05, 0.1, 0.2, 0.4)  # of the standard deviation of the gap


def library(signals, names, crossing=None):
    """Labels and columns: what the true terms may be, in the words of `llmt discover`. `crossing`: inputs whose
    sign counts; without it, those that change it."""
    columns = {"offset": np.ones(len(signals[names[0]]))}
    poly = pysindy.PolynomialLibrary(degree=2, include_bias=False)
    matrix = np.asarray(poly.fit_transform(np.column_stack([signals[name] for name in names])))
    for text, column in zip(poly.get_feature_names(names), matrix.T):
        parts = text.split()
        family = "product" if len(parts) == 2 else "square" if text.endswith("^2") else "linear"
        columns[verdicts.label(family, ",".join(part.removesuffix("^2") for part in parts))] = column
    for name in names:
        x = signals[name]
        columns[f"cube {name}"] = x**3
        if name in crossing if crossing is not None else x.min() < 0 < x.max():
            columns |= {f"sign {name}": np.sign(x), f"absolute {name}": np.abs(x), f"signed_square {name}": x * np.abs(x)}
    return columns


def without(columns, x):
    return x - columns @ np.linalg.lstsq(columns, x, rcond=None)[0] if columns.shape[1] else x


def sparse(matrix, gap, threshold):
    """Coefficients by pysindy's STLSQ, of columns and gap of unit size."""
    optimizer = pysindy.STLSQ(threshold=threshold, alpha=1e-6, max_iter=30)
    optimizer.fit(matrix, gap[:, None])
    return np.asarray(optimizer.coef_).ravel()


def by_pysindy(reduced, left):
    """Which columns stay."""
    unit, first = np.std(left), int(0.8 * len(left))
    best = None
    for threshold in THRESHOLDS:
        chosen = sparse(reduced[:first], left[:first] / unit, threshold)
        error = np.mean((left[first:] / unit - reduced[first:] @ chosen) ** 2)
        if best is None or error < best[0]:
            best = (error, threshold)
    return sparse(reduced, left / unit, best[1]) != 0


def by_sysidentpy(reduced, left):
    """Which columns stay."""
    most = min(10, reduced.shape[1])
    if most == 0:
        return np.zeros(0, bool)
    search = FROLS(basis_function=Polynomial(degree=1), order_selection=False, n_terms=most, model_type="NFIR")
    search.max_lag = 0  # rows are no sequence here
    _, order, *_ = search.error_reduction_ratio(reduced, left[:, None], most)
    criteria = []
    for count in range(most + 1):
        columns = reduced[:, order[:count]]
        rest = without(columns, left)
        criteria.append(len(left) * np.log(np.mean(rest**2) + 1e-300) + 2 * count)
    kept = np.zeros(reduced.shape[1], bool)
    kept[order[: int(np.argmin(criteria))]] = True
    return kept


def identified(case, rows, choose):
    """Labels and coefficients of terms, and changes of the free parameters."""
    columns = library(rows.table, case.given)
    labels, matrix = list(columns), np.column_stack(list(columns.values()))
    derivatives = np.column_stack([*rows.derivatives.values()]) if case.free else np.empty((len(matrix), 0))
    gap = rows.table["u"] - rows.simulated
    reduced, left = without(derivatives, matrix), without(derivatives, gap)
    size = np.sqrt(np.mean(reduced**2, axis=0))
    usable = size > 1e-6 * np.sqrt(np.mean(matrix**2, axis=0))
    labels, matrix = [label for label, ok in zip(labels, usable) if ok], matrix[:, usable]
    reduced, size = reduced[:, usable] / size[usable], size[usable]
    kept = choose(reduced, left)
    both = np.column_stack([derivatives, matrix[:, kept]])
    solved = np.linalg.lstsq(both, gap, rcond=None)[0] if both.shape[1] else np.zeros(0)
    count = derivatives.shape[1]
    return [label for label, ok in zip(labels, kept) if ok], solved[count:], solved[:count]


def added(case, signals, derivatives, labels, coefficients, changes):
    columns = library(signals, case.given, case.given)
    total = sum((c * columns[label] for label, c in zip(labels, coefficients)), np.zeros(len(signals["t"])))
    return total + sum(change * x for change, x in zip(changes, derivatives.values()))


RIVALS = {"pysindy": by_pysindy, "SysIdentPy": by_sysidentpy}


def run(program, seed, folder):
    """What each rival finds."""
    case = generate.case(seed)
    (first, _, _), (second, _, _) = (way.signals(program, case, number, folder) for number in (1, 2))
    columns, nominal, derivatives = way.true_rows(case, second)
    missing = way.hidden_at(case, second, columns, nominal)
    gap = second.table["u"] - second.simulated
    wanted = verdicts.truth_labels(case) if not case.hidden.regime else []
    results = {}
    for rival, choose in RIVALS.items():
        found = identified(case, first, choose)
        error = way.rms(added(case, columns, derivatives, *found) - missing) / (way.rms(missing) or second.noise["u"])
        gain = way.rms(gap - added(case, second.table, second.derivatives, *found)) / way.rms(gap)
        results[rival] = {"kind": case.kind, "terms": len(found[0]), "labels": found[0], "error": error, "gain": gain,
                          "alone": bool(wanted) and sorted(found[0]) == sorted(wanted)}
    return results


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--program", required=True)
    parser.add_argument("--seeds", required=True, metavar="FIRST:END,...")
    parser.add_argument("--results", type=pathlib.Path, required=True, metavar="FILE", help="of judge.py")
    options = parser.parse_args()
    ours = {r["seed"]: r for r in map(json.loads, options.results.read_text().splitlines()) if "verdict" in r}
    runs = []
    for seed in judge.seeds_of(options.seeds):
        with tempfile.TemporaryDirectory() as folder:
            results = run(options.program, seed, folder)
        own = ours[seed]
        results["llmt"] = {"kind": own["kind"], "terms": len(own["effects"]), "labels": own["effects"],
                           "error": own["function_error"] or 0.0, "gain": own["gain"] or 1.0, "alone": own["alone"]}
        runs.append((results, own["true_gain"]))
        print(f"{seed:5} {own['kind']:10} truth {own['true_gain']:.3g}; " + "; ".join(
            f"{name} {r['terms']} terms, error {r['error']:.3g}, gain {r['gain']:.3g}" for name, r in results.items()), flush=True)
    middle = lambda values: f"{statistics.median(values):.3g}"
    print(f"\n{'kind':12}{'runs':>5}  {'':10}{'terms':>7}{'alone':>7}{'error':>10}{'gain':>10}{'true':>8}{'worse':>7}")
    for kind in [*dict.fromkeys(results["llmt"]["kind"] for results, _ in runs), "all"]:
        of = [run for run in runs if kind in ("all", run[0]["llmt"]["kind"])]
        for name in of[0][0]:
            own = [results[name] for results, _ in of]
            print(f"{kind:12}{len(of):5}  {name:10}{middle([r['terms'] for r in own]):>7}{sum(r['alone'] for r in own):7}"
                  f"{middle([r['error'] for r in own]):>10}{middle([r['gain'] for r in own]):>10}"
                  f"{middle([truth for _, truth in of]):>8}{sum(r['gain'] > 1.05 for r in own):7}")


if __name__ == "__main__":
    main()
