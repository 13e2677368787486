"""What Python adds to the C++ program: seconds and memory of fit and predict, for every form of the same table.

    python bench/python/overhead.py build/release/bin/llmt [ROWS]

Everybody fits one crisp tree without folds. The program's seconds include reading the table from CSV.
"""

import multiprocessing
import resource
import subprocess
import sys
import tempfile
import time
from pathlib import Path

import numpy as np

COLUMNS = 10
OPTIONS = {"cv": 0, "validity": "crisp"}


def numbers(rows):
    rng = np.random.default_rng(0)
    X = rng.uniform(-1, 1, (rows, COLUMNS))
    return X, np.where(X[:, 0] > 0, X[:, 1], X[:, 2]) + 0.1 * rng.normal(size=rows)


def forms():
    names = [f"x{column}" for column in range(COLUMNS)]

    def pandas(X):
        import pandas

        return pandas.DataFrame(X, columns=names)

    def polars(X):
        import polars

        return polars.DataFrame(dict(zip(names, X.T)))

    def pyarrow(X):
        import pyarrow

        return pyarrow.table(dict(zip(names, np.asfortranarray(X).T)))

    return {
        "numpy, C order": np.ascontiguousarray,
        "numpy, Fortran order": np.asfortranarray,
        "pandas": pandas,
        "polars": polars,
        "pyarrow": pyarrow,
    }


def status(field):
    """Megabytes of resident memory: VmRSS now, VmHWM its highest value since begin_peak()."""
    for line in Path("/proc/self/status").read_text().splitlines():
        if line.startswith(field):
            return int(line.split()[1]) / 1024
    raise OSError(f"/proc/self/status has no {field}")


def begin_peak():
    Path("/proc/self/clear_refs").write_text("5")
    return status("VmRSS")


def cpu():
    usage = resource.getrusage(resource.RUSAGE_SELF)
    return usage.ru_utime + usage.ru_stime


def measure(form, rows, answers):
    from llmt import LocalLinearTreeRegressor

    X, y = numbers(rows)
    table = forms()[form](X)
    del X
    before = begin_peak()
    start = cpu()
    model = LocalLinearTreeRegressor(**OPTIONS).fit(table, y)
    fit = cpu() - start, status("VmHWM") - before
    before = begin_peak()
    start = cpu()
    model.predict(table)
    answers.put((*fit, cpu() - start, status("VmHWM") - before, model.to_json()))


def program_seconds(program, X, y):
    with tempfile.TemporaryDirectory() as folder:
        table = Path(folder) / "table.csv"
        header = ",".join([f"x{column}" for column in range(COLUMNS)] + ["y"])
        np.savetxt(table, np.column_stack([X, y]), delimiter=",", header=header, comments="", fmt="%.17g")
        model = Path(folder) / "model.json"
        command = [program, "fit", str(table), "--target", "y", "--cv", "0", "--validity", "crisp", "-o", str(model)]
        before = resource.getrusage(resource.RUSAGE_CHILDREN)
        subprocess.run(command, check=True, stdout=subprocess.DEVNULL)
        fitted = resource.getrusage(resource.RUSAGE_CHILDREN)
        subprocess.run([program, "predict", str(model), str(table), "--json"], check=True, stdout=subprocess.DEVNULL)
        predicted = resource.getrusage(resource.RUSAGE_CHILDREN)

        def seconds(a, b):
            return b.ru_utime + b.ru_stime - a.ru_utime - a.ru_stime

        return seconds(before, fitted), seconds(fitted, predicted), model.read_text()


def main():
    program = sys.argv[1]
    rows = int(sys.argv[2]) if len(sys.argv) > 2 else 1_000_000
    X, y = numbers(rows)
    fit_seconds, predict_seconds, text = program_seconds(program, X, y)
    print(f"{rows} rows x {COLUMNS} columns: {X.nbytes / 2**20:.0f} MB; CPU seconds; MB: most memory beyond what was there before")
    print(f"{'':24} {'fit s':>8} {'fit MB':>8} {'predict s':>10} {'predict MB':>10}  model")
    print(f"{'program (reads CSV)':24} {fit_seconds:8.2f} {'':>8} {predict_seconds:10.2f}")
    context = multiprocessing.get_context("spawn")
    for form in forms():
        answers = context.Queue()
        child = context.Process(target=measure, args=(form, rows, answers))
        child.start()
        fit, fit_mb, predict, predict_mb, model = answers.get()
        child.join()
        same = "same bytes" if model == text else "differs"
        print(f"{form:24} {fit:8.2f} {fit_mb:8.0f} {predict:10.2f} {predict_mb:10.0f}  {same}")


if __name__ == "__main__":
    main()
