"""Free runs on public benchmarks of nonlinear system identification, by the program llmt."""

import argparse
import csv
import gzip
import json
import math
import resource
import subprocess
import sys
import tempfile
from pathlib import Path


def columns_of(path: Path, header: bool) -> list[list[float]]:
    """The numbers of a CSV file by columns; NaN where there is none."""
    opened = gzip.open(path, "rt") if path.suffix == ".gz" else path.open()
    with opened as file:
        rows = [row for row in csv.reader(file) if any(row)]
    if header:
        rows = rows[1:]

    def number(text: str) -> float:
        try:
            return float(text)
        except ValueError:
            return math.nan

    width = max(len(row) for row in rows)
    return [[number(row[k]) if k < len(row) else math.nan for row in rows] for k in range(width)]


def complete(u: list[float], y: list[float]) -> tuple[list[float], list[float]]:
    pairs = [(a, b) for a, b in zip(u, y, strict=True) if not (math.isnan(a) or math.isnan(b))]
    return [a for a, _ in pairs], [b for _, b in pairs]


class Task:
    """A learning record, test records, and how they are judged."""

    def __init__(self, name, train, tests, window, step, unit="", factor=1.0):
        self.name, self.train, self.tests = name, train, tests
        self.window, self.step, self.unit, self.factor = window, step, unit, factor


def tasks(data: Path):
    u, y = complete(*columns_of(data / "odes/silverbox_SNLS80mV.csv.gz", True)[:2])

    def part(begin, end):
        return u[begin:end], y[begin:end]

    learned = 40650 + int(0.75 * (127400 - 40650))
    tests = {"multisine": part(learned, 127400), "arrow": part(100, 40575), "no extrapolation": part(100, 32100)}
    yield Task("Silverbox", part(40650, learned), tests, 50, 1 / 610.35, "mV", 1e3)
    u_learn, u_test, y_learn, y_test = columns_of(data / "odes/cascaded_tanks.csv", True)[:4]
    for window in (50, 5):
        yield Task(f"tanks, window {window}", complete(u_learn, y_learn), {"test": complete(u_test, y_test)}, window, 4.0, "V")
    for file, pairs in (("DATAUNIF", {"low": (0, 2), "high": (1, 3)}), ("DATAPRBS", {"1": (1, 0), "1.5": (3, 2), "0.5": (5, 4)})):
        table = columns_of(data / f"dynamics/{file}.csv", True)
        for learned in (400, 300):
            for name, (input_column, output_column) in pairs.items():
                u, y = complete(table[input_column], table[output_column])
                tests = {"test": (u[learned:], y[learned:])}
                yield Task(f"drives {file} {name}, {learned} rows", (u[:learned], y[:learned]), tests, 10, 0.02)
    learn, test = (complete(*columns_of(data / f"dynamics/EMPS_{part}.csv", False)[:2]) for part in ("est", "val"))
    yield Task("EMPS", learn, {"test": test}, 20, 0.001, "mm", 1e3)


def write(path: Path, record) -> None:
    u, y = record
    path.write_text("u,y\n" + "".join(f"{a!r},{b!r}\n" for a, b in zip(u, y, strict=True)))


def rmse_of(program: str, folder: Path, model: str, record, window: int) -> float:
    write(folder / "test.csv", record)
    done = subprocess.run(
        [program, "simulate", model, "test.csv", "--window", str(window), "--json"],
        cwd=folder, capture_output=True, text=True, check=True,
    )
    simulated = json.loads(done.stdout)["simulated"]["y"]
    # The window is that of the benchmark, also where the model looks back further.
    errors = [a - (b if b is not None else math.inf) for a, b in zip(record[1][window:], simulated[window:], strict=True)]
    return math.sqrt(sum(e * e for e in errors) / len(errors))


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--program", required=True)
    parser.add_argument("--data", type=Path, required=True)
    parser.add_argument("--only", default="", help="tasks whose name begins so")
    arguments = parser.parse_args()
    program = str(Path(arguments.program).resolve())
    print(f"{'record':38} {'test':17} {'RMSE':>9} {'held out':>9} {'linear':>9} {'CPU s':>7}  model")
    learned: dict[str, tuple[str, dict, float]] = {}
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        for number, task in enumerate(tasks(arguments.data)):
            if not task.name.startswith(arguments.only):
                continue
            key = repr((task.name.split(", window")[0], task.step))
            if key not in learned:
                write(folder / "train.csv", task.train)
                before = resource.getrusage(resource.RUSAGE_CHILDREN)
                done = subprocess.run(
                    [program, "fit", "train.csv", "-t", "y", "--lags", "auto", "--accept-unstable", "--json",
                     "-o", f"{number}.json"],
                    cwd=folder, capture_output=True, text=True,
                )
                if done.returncode != 0:
                    sys.exit(done.stderr)
                after = resource.getrusage(resource.RUSAGE_CHILDREN)
                cpu = after.ru_utime + after.ru_stime - before.ru_utime - before.ru_stime
                learned[key] = (str(number), json.loads(done.stdout), cpu)
            which, fit, cpu = learned[key]
            for test, record in task.tests.items():
                error = task.factor * rmse_of(program, folder, f"{which}.json", record, task.window)
                linear = task.factor * fit["linear"]["rmse"][0]
                held_out = task.factor * fit["held_out"]["rmse"][0]
                label = f"{task.name} [{task.unit}]" if task.unit else task.name
                print(f"{label:38} {test:17} {error:9.4g} {held_out:9.4g} {linear:9.4g} {cpu:7.1f}  "
                      f"{fit['lags']}: {fit['model_kind']}", flush=True)


if __name__ == "__main__":
    main()
