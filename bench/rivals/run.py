#!/usr/bin/env python3
"""llmt beside the regressors that Python users install with pip: one thread each, defaults, the same rows.

    python3 bench/rivals/run.py --install           # their environment, build/rivals_env, from requirements.txt
    python3 bench/rivals/run.py --sets FOLDER       # every NAME.csv with a NAME.splits.csv; error: test RMSE
    python3 bench/rivals/run.py --rows 1e4,1e5      # a synthetic function; error: RMSE to it without noise
    python3 bench/rivals/run.py --table             # the tables of README.md and docs/benchmarks.md

A line of the results file, build/rivals.jsonl, is one fit. What is in there is not measured again, so a run that was
cut goes on where it stopped. To measure anew, delete the file, or the lines of a regressor.

A fit is a process of its own, forked when the packages are imported and ChimeraBoost is compiled. Its CPU seconds go
from arrays in memory to the model, and its MiB are what the process grows by. Those of the programs llmt and M5P include
reading the table and writing the model, those of prediction (`predict_cpu` of a line) reading the table and the model
and writing text. Their MiB are all that the program has, but at least the size of this script's process, of which they
are forked.
"""
import argparse
import importlib.metadata
import json
import math
import multiprocessing
import os
import pathlib
import resource
import statistics
import subprocess
import sys
import warnings

HERE = pathlib.Path(__file__).resolve().parent
ROOT = HERE.parents[1]
ENVIRONMENT = ROOT / "build/rivals_env"
ONE_THREAD = {f"{name}_NUM_THREADS": "1" for name in ("OMP", "OPENBLAS", "MKL", "NUMBA")}
IN_README = ["llmt", "ChimeraBoost", "CatBoost", "LightGBM", "XGBoost", "HistGradientBoosting", "Cubist",
             "least squares"]
SYNTHETIC = "synthetic "  # followed by the number of rows: the name of these data


def arguments():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--install", action="store_true", help="make the environment and exit")
    parser.add_argument("--sets", metavar="FOLDER", type=pathlib.Path)
    parser.add_argument("--names", metavar="NAME,...", help="data sets of the folder; default: all")
    parser.add_argument("--splits", type=int, default=5, help="of each data set, from the first; default: %(default)s")
    parser.add_argument("--seeds", type=int, default=1, help="of each fit, from 0; default: %(default)s")
    parser.add_argument("--rows", metavar="COUNT,...", help="training rows of the synthetic function")
    parser.add_argument("--only", metavar="NAME", action="append",
                        help="a regressor; may be repeated; default: those of regressors.py that take seconds")
    parser.add_argument("--seconds", type=int, default=300, help="CPU time that a fit may take; default: %(default)s")
    parser.add_argument("--llmt", default=ROOT / "build/release/bin/llmt", help="the program; default: %(default)s")
    parser.add_argument("--results", default=ROOT / "build/rivals.jsonl", type=pathlib.Path,
                        help="file of all fits; default: %(default)s")
    parser.add_argument("--table", action="store_true", help="print the tables of all results")
    parser.add_argument("--base", metavar="NAME", default="llmt",
                        help="with --table: whose errors and times the others are divided by; default: %(default)s")
    return parser.parse_args()


def install():
    subprocess.run([sys.executable, "-m", "venv", ENVIRONMENT], check=True)
    subprocess.run([ENVIRONMENT / "bin/pip", "install", "--quiet", "-r", HERE / "requirements.txt"], check=True)


def data_of_sets(options):
    """(name, split, function that reads the rows), the first splits of all sets first."""
    import numpy as np

    def read(path):
        return np.loadtxt(path, delimiter=",", skiprows=1)

    def rows(name, split):
        table, is_test = read(options.sets / f"{name}.csv"), read(options.sets / f"{name}.splits.csv")[:, split] == 1
        return table[~is_test, :-1], table[~is_test, -1], table[is_test, :-1], table[is_test, -1]

    found = sorted(path.name.removesuffix(".splits.csv") for path in options.sets.glob("*.splits.csv"))
    names = options.names.split(",") if options.names else found
    return [(name, split, lambda name=name, split=split: rows(name, split))
            for split in range(options.splits) for name in names]


def data_of_function(options):
    """The function of bench/synthetic.hpp in ten inputs: training rows with noise, 100000 test rows without."""
    import numpy as np

    def rows(count):
        random = np.random.default_rng(1)
        x = random.random((count + 100000, 10))
        y = np.where(x[:, 0] < 0.4, 10 * np.sin(np.pi * x[:, 1] * x[:, 2]) + 5 * x[:, 3],
                     20 * (x[:, 4] - 0.5)**2 + 10 * x[:, 5] * x[:, 6] - 5)
        y += 8 * np.maximum(0, x[:, 7] - 0.6) + 2 * x[:, 8]
        return x[:count], y[:count] + random.standard_normal(count), x[count:], y[count:]

    return [(SYNTHETIC + count, 0, lambda count=count: rows(int(float(count)))) for count in options.rows.split(",")]


def cpu_between(before, after):
    return after.ru_utime + after.ru_stime - before.ru_utime - before.ru_stime


def work(make, seed, data, seconds, sender):
    """In the process of a fit: sends its result."""
    import numpy as np

    resource.setrlimit(resource.RLIMIT_CPU, (seconds, seconds + 5))
    resource.setrlimit(resource.RLIMIT_CORE, (0, 0))
    warnings.simplefilter("ignore")
    train_x, train_y, test_x, test_y = data
    model = make(seed)
    clock = getattr(model, "clock", resource.RUSAGE_SELF)

    try:
        before = resource.getrusage(clock)
        model.fit(train_x, train_y)
        after = resource.getrusage(clock)
        result = {"fit_cpu": cpu_between(before, after), "fit_mib": (after.ru_maxrss - before.ru_maxrss) / 1024}
        predicted = np.asarray(model.predict(test_x)).ravel()
        result["predict_cpu"] = cpu_between(after, resource.getrusage(clock))
        result["rmse"] = float(np.sqrt(np.mean((predicted - test_y)**2)))
        result["r2"] = 1 - result["rmse"]**2 / float(np.var(test_y))
        if not math.isfinite(result["rmse"]):
            result = {"failed": "predictions are not finite"}
        elif hasattr(model, "leaves"):
            result["leaves"] = model.leaves
        sender.send(result)
    except Exception as error:
        sender.send({"failed": f"{type(error).__name__}: {error}"})


def fit(make, seed, data, seconds):
    receiver, sender = multiprocessing.Pipe(duplex=False)
    process = multiprocessing.get_context("fork").Process(target=work, args=(make, seed, data, seconds, sender))
    process.start()
    sender.close()
    try:
        result = receiver.recv()
    except EOFError:
        result = None
    process.join()
    return result or {"failed": f"the process ended with {process.exitcode}; its limit was {seconds} CPU s"}


def read_results(path):
    """(data, split, seed, regressor) -> the last line of it."""
    lines = path.read_text().splitlines() if path.exists() else []
    return {(line["data"], line["split"], line.get("seed", 0), line["regressor"]): line
            for line in map(json.loads, lines)}


def measure(options, data):
    """The fits of `data`, (name, split, function that reads the rows), that the results file does not have."""
    from regressors import ONLY_WHEN_NAMED, REGRESSORS, WEKA, Llmt

    Llmt.program = options.llmt
    names = options.only or [name for name in REGRESSORS if name not in ONLY_WHEN_NAMED]
    if unknown := set(names) - set(REGRESSORS):
        sys.exit(f"run.py: no regressor {', '.join(sorted(unknown))}; there are: {'; '.join(REGRESSORS)}")
    # What the machine lacks is not a failed fit, which would be kept.
    for name, path in {"llmt": options.llmt, "llmt (boost)": options.llmt, "llmt (crisp)": options.llmt,
                       "M5P": WEKA}.items():
        if name in names and not os.path.exists(path):
            sys.exit(f"run.py: {name} needs {path}, which is not there")
    if "ChimeraBoost" in names:
        import chimeraboost

        chimeraboost.warmup()
    packages = {name: REGRESSORS[name][0] for name in names}
    versions = {name: importlib.metadata.version(package) if package else "" for name, package in packages.items()}
    done = read_results(options.results)
    options.results.parent.mkdir(exist_ok=True)
    for name, split, read in data:
        missing = [(seed, one) for seed in range(options.seeds) for one in names
                   if done.get((name, split, seed, one), {}).get("version") != versions[one]]
        rows = read() if missing else None
        for seed, one in missing:
            result = {"data": name, "split": split, "seed": seed, "regressor": one, "version": versions[one],
                      "rows": len(rows[1]), "inputs": rows[0].shape[1]}
            result |= fit(REGRESSORS[one][1], seed, rows, options.seconds)
            figures = result.get("failed") or "{rmse:.5g}, {fit_cpu:.3g} CPU s".format(**result)
            print(f"{name}, split {split}, seed {seed}, {one}: {figures}", file=sys.stderr)
            with open(options.results, "a") as file:
                file.write(json.dumps(result) + "\n")


def number(value):
    return f"{value:.0f}" if value >= 1000 else f"{value:#.4g}"


def summarise(results, base):
    """data -> regressor -> fits (split, seed), means over them, and the ratios to `base` in the same fits."""
    summary = {}
    for (data, split, seed, regressor), line in results.items():
        if "rmse" in line:
            summary.setdefault(data, {}).setdefault(regressor, {})[split, seed] = line
    for rows in summary.values():
        own = rows.get(base, {})
        for regressor, lines in rows.items():
            rows[regressor] = {"fits": sorted(lines)} | {
                key: next(iter(lines.values()))[key] for key in ("version", "rows", "inputs")}
            for key in ("rmse", "fit_cpu", "fit_mib", "leaves"):
                if all(key in line for line in lines.values()):
                    rows[regressor][key] = statistics.mean(line[key] for line in lines.values())
                if key in ("rmse", "fit_cpu") and all(one in own for one in lines):
                    rows[regressor][key + " ratio"] = rows[regressor][key] / statistics.mean(
                        own[one][key] for one in lines)
    return summary


def print_markdown(title, head, rows):
    print(f"\n{title}\n")
    for row in [head, ["---"] * len(head), *rows]:
        print(f"| {' | '.join(row)} |")


def print_readme(summary, sets):
    shown = [name for name in IN_README if all(name in summary[data] for data in sets)]
    rows = []
    for data in sets:
        cells = [number(summary[data][name]["rmse"]) for name in shown]
        best = number(min(summary[data][name]["rmse"] for name in shown))
        bold = [f"**{cell}**" if cell == best else cell for cell in cells]
        own = summary[data]["llmt"]
        rows.append([data, f"{own['rows']} x {own['inputs']}", bold[0], f"{own['leaves']:.0f}", *bold[1:]])
    print_markdown("README: mean test RMSE", ["data", "training rows x inputs", shown[0], "leaves", *shown[1:]], rows)


def print_sets(summary, sets, names):
    most = max(len(row["fits"]) for data in sets for row in summary[data].values())

    def cell(row):
        if not row:
            return "–"
        return number(row["rmse"]) + (f" ({len(row['fits'])})" if len(row["fits"]) < most else "")

    print_markdown(f"Mean test RMSE over {most} fits (splits, seeds); in brackets: over fewer", ["", *sets],
                   [[name, *(cell(summary[data].get(name)) for data in sets)] for name in names])


def print_means(summary, sets, names, base):
    ranked = [name for name in names if all(name in summary[data] for data in sets)]

    def rank(data, name):
        own = summary[data][name]["rmse ratio"]
        others = [summary[data][other]["rmse ratio"] for other in ranked]
        return sum(other < own for other in others) + (1 + others.count(own)) / 2

    def mean(rows, key):
        return math.exp(statistics.mean(math.log(row[key]) for row in rows))

    rows = []
    for name in names:
        own = [summary[data][name] for data in sets if name in summary[data]]
        ranks = f"{statistics.mean(rank(data, name) for data in sets):.1f}" if name in ranked else "–"
        median = statistics.median(row["rmse ratio"] for row in own)
        rows.append([name, own[0]["version"], f"{len(own)} x {len(own[0]['fits'])}", ranks, f"{median:.3f}",
                     f"{mean(own, 'rmse ratio'):.3f}", f"{mean(own, 'fit_cpu ratio'):.2g}"])
    print_markdown(f"Over the sets: mean rank among {len(ranked)}; median and geometric mean of the ratios to {base}",
                   ["", "version", "sets x fits", "mean rank", "RMSE, median", "RMSE, mean", "CPU, mean"], rows)


def print_functions(summary, functions, names):
    def cell(row):
        return "{fit_cpu:.2f}; {fit_mib:.0f}; {rmse:.4f}".format(**{"fit_mib": math.nan} | row) if row else "–"

    print_markdown("Synthetic function: CPU seconds and MiB of the fit; error", ["", *functions],
                   [[name, *(cell(summary[data].get(name)) for data in functions)] for name in names])


def print_tables(results, base):
    from regressors import REGRESSORS

    summary = {data: rows for data, rows in summarise(results, base).items() if base in rows}
    sets = sorted((data for data in summary if not data.startswith(SYNTHETIC)), key=str.lower)
    functions = sorted(set(summary) - set(sets), key=lambda data: float(data.removeprefix(SYNTHETIC)))

    def measured(data):
        return [name for name in REGRESSORS if any(name in summary[one] for one in data)]

    if sets:
        if base == "llmt":
            print_readme(summary, sets)
        print_sets(summary, sets, measured(sets))
        print_means(summary, sets, measured(sets), base)
    if functions:
        print_functions(summary, functions, measured(functions))
    for (data, split, seed, regressor), line in results.items():
        if "failed" in line:
            print(f"\n{data}, split {split}, seed {seed}, {regressor}: {line['failed']}")


def enter_environment():
    python = ENVIRONMENT / "bin/python"
    if not python.exists():
        sys.exit("run.py: the packages are not there; run with --install first")
    if pathlib.Path(sys.prefix) != ENVIRONMENT:
        os.execve(python, [python, *sys.argv], os.environ | ONE_THREAD)


def main():
    sys.dont_write_bytecode = True  # no __pycache__ among the sources
    options = arguments()
    if options.install:
        return install()
    if not options.table and not options.sets and not options.rows:
        sys.exit("run.py: say on which data, with --sets or --rows, or --table; --help explains")
    enter_environment()
    if options.table:
        return print_tables(read_results(options.results), options.base)
    data = (data_of_sets(options) if options.sets else []) + (data_of_function(options) if options.rows else [])
    return measure(options, data)


if __name__ == "__main__":
    sys.exit(main())
