"""What pysindy names on the rows that `llmt discover` gets, beside the program: seeds as in judge.py.

    pip install pysindy==2.1.0
    python bench/logs/fit_by_pysindy.py --program build/release/bin/llmt --seeds 0:32 --results runs.jsonl

Sequentially thresholded least squares of the gap on a library (polynomials of degree 2 of all inputs, sign, modulus,
x |x|, x^3), columns of unit size, with the derivatives by free parameters projected out first. Of five thresholds the
one is taken that leaves least on the last fifth of the rows; then all rows are fitted. The results file holds runs of
judge.py, for the columns of llmt.
"""

import argparse
import json
import pathlib
import statistics
import tempfile

import numpy as np
import pysindy

import generate
import judge
import verdicts
import way

THRESHOLDS = (0.02, 0.05, 0.1, 0.2, 0.4)  # of the standard deviation of the gap


def library(signals, names):
    """Labels and columns: what the true terms may be, in the words of `llmt discover`."""
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
        if x.min() < 0 < x.max():
            columns |= {f"sign {name}": np.sign(x), f"absolute {name}": np.abs(x), f"signed_square {name}": x * np.abs(x)}
    return columns


def without(columns, x):
    return x - columns @ np.linalg.lstsq(columns, x, rcond=None)[0] if columns.shape[1] else x


def sparse(matrix, gap, threshold):
    """Coefficients by pysindy's STLSQ, of columns and gap of unit size."""
    optimizer = pysindy.STLSQ(threshold=threshold, alpha=1e-6, max_iter=30)
    optimizer.fit(matrix, gap[:, None])
    return np.asarray(optimizer.coef_).ravel()


def identified(case, rows):
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
    unit, first = np.std(left), int(0.8 * len(gap))
    best = None
    for threshold in THRESHOLDS:
        chosen = sparse(reduced[:first], left[:first] / unit, threshold)
        error = np.mean((left[first:] / unit - reduced[first:] @ chosen) ** 2)
        if best is None or error < best[0]:
            best = (error, threshold)
    kept = sparse(reduced, left / unit, best[1]) != 0
    both = np.column_stack([derivatives, matrix[:, kept]])
    solved = np.linalg.lstsq(both, gap, rcond=None)[0] if both.shape[1] else np.zeros(0)
    count = derivatives.shape[1]
    return [label for label, ok in zip(labels, kept) if ok], solved[count:], solved[:count]


def added(case, signals, derivatives, labels, coefficients, changes):
    columns = library(signals, case.given)
    total = sum((c * columns[label] for label, c in zip(labels, coefficients)), np.zeros(len(signals["t"])))
    return total + sum(change * x for change, x in zip(changes, derivatives.values()))


def run(program, seed, folder):
    case = generate.case(seed)
    (first, _, _), (second, _, _) = (way.signals(program, case, number, folder) for number in (1, 2))
    found = identified(case, first)
    columns, nominal, derivatives = way.true_rows(case, second)
    missing = way.hidden_at(case, second, columns, nominal)
    error = way.rms(added(case, columns, derivatives, *found) - missing) / (way.rms(missing) or second.noise["u"])
    gap = second.table["u"] - second.simulated
    gain = way.rms(gap - added(case, second.table, second.derivatives, *found)) / way.rms(gap)
    wanted = verdicts.truth_labels(case) if not case.hidden.regime else []
    return {"seed": seed, "kind": case.kind, "terms": len(found[0]), "labels": found[0][:6], "error": error, "gain": gain,
            "alone": bool(wanted) and sorted(found[0]) == sorted(wanted), "listed": bool(wanted) and set(wanted) <= set(found[0])}


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--program", required=True)
    parser.add_argument("--seeds", required=True, metavar="FIRST:END,...")
    parser.add_argument("--results", type=pathlib.Path, required=True, metavar="FILE", help="of judge.py")
    options = parser.parse_args()
    ours = {r["seed"]: r for r in map(json.loads, options.results.read_text().splitlines()) if "verdict" in r}
    pairs = []
    for seed in judge.seeds_of(options.seeds):
        with tempfile.TemporaryDirectory() as folder:
            result = run(options.program, seed, folder)
        pairs.append((result, ours[seed]))
        print(f"{seed:5} {result['kind']:10} pysindy {result['terms']:3} terms {', '.join(result['labels'])[:80]:80} "
              f"error {result['error']:.3g}, gain {result['gain']:.3g}; llmt {len(ours[seed]['effects'])} terms, "
              f"error {ours[seed]['function_error'] or 0:.3g}, gain {ours[seed]['gain'] or 0:.3g} of {ours[seed]['true_gain']:.3g}", flush=True)
    print(f"\n{'kind':12}{'runs':>5}{'terms':>12}{'alone':>12}{'error':>18}{'gain':>18}{'true':>8}{'worse':>8}   (pysindy, llmt)")
    for kind in dict.fromkeys(result["kind"] for result, _ in pairs):
        of = [(a, b) for a, b in pairs if a["kind"] == kind]
        middle = lambda values: f"{statistics.median(values):.3g}"
        cells = [middle([a["terms"] for a, _ in of]) + ", " + middle([len(b["effects"]) for _, b in of]),
                 f"{sum(a['alone'] for a, _ in of)}, {sum(b['alone'] for _, b in of)}",
                 middle([a["error"] for a, _ in of]) + ", " + middle([b["function_error"] for _, b in of]),
                 middle([a["gain"] for a, _ in of]) + ", " + middle([b["gain"] for _, b in of])]
        worse = f"{sum(a['gain'] > 1.05 for a, _ in of)}, {sum(b['gain'] > 1.05 for _, b in of)}"
        print(f"{kind:12}{len(of):5}{cells[0]:>12}{cells[1]:>12}{cells[2]:>18}{cells[3]:>18}"
              f"{middle([b['true_gain'] for _, b in of]):>8}{worse:>8}")


if __name__ == "__main__":
    main()
