#!/usr/bin/python3
"""llmt beside the regressors that a Debian machine can install, in one run, on the same data, under the same limits.

On the benchmarks' synthetic function (error: RMSE to the noise-free truth on 100000 fresh rows; noise of the data: 1), or
with --sets FOLDER on every NAME.csv with a NAME.splits.csv (format: bench/data_sets.hpp; error: mean test RMSE).

Every fit is a process of its own, `RUNNER METHOD TRAIN TEST COLUMNS THREADS`, that reads two files of doubles (column
after column, the output last) and prints one line of JSON: fit_wall and fit_cpu, the seconds from data in memory to a
model; predict_wall and predict_cpu, seconds per million rows; memory, the bytes by which fitting raised the peak;
rmse; leaves (for earth terms). Exit 77: not installed.
"""
import argparse
import collections
import json
import math
import os
import resource
import statistics
import subprocess
import sys
import tempfile

HERE = os.path.dirname(os.path.abspath(__file__))
ROOT = os.path.dirname(os.path.dirname(HERE))
PYTHON = "/usr/bin/python3"  # the one that Debian's packages belong to
WEKA = "/usr/share/java/weka.jar"
PACKAGES = {
    "llmt": None, "llmt-crisp": None, "HistGB": "python3-sklearn", "XGBoost": "python3-xgboost",
    "M5P": "weka default-jdk-headless", "earth": "r-cran-earth", "lmtree": "r-cran-partykit", "tree": "python3-sklearn",
    "least-squares": "python3-sklearn"}


def arguments():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--bin", default=os.path.join(ROOT, "build/bench/bin"), help="where llmt's benchmarks are")
    parser.add_argument("--methods", default=",".join(PACKAGES), help="comma-separated; default: %(default)s")
    parser.add_argument("--rows", default="1e4,1e5", help="numbers of training rows; default: %(default)s")
    parser.add_argument("--inputs", type=int, default=10)
    parser.add_argument("--seeds", type=int, default=1, help="samples: mean errors, median times; default: %(default)s")
    parser.add_argument("--sets", metavar="FOLDER", help="data sets instead of the synthetic function")
    parser.add_argument("--names", help="comma-separated data sets; default: all")
    parser.add_argument("--threads", type=int, default=1)
    parser.add_argument("--seconds", type=int, default=300, help="CPU time a process may take; default: %(default)s")
    parser.add_argument("--gigabytes", type=int, default=8, help="memory a process may take; default: %(default)s")
    parser.add_argument("--json", default="rivals.json", help="file for all results; default: %(default)s")
    return parser.parse_args()


class Bench:
    def __init__(self, options, folder):
        self.options, self.folder = options, folder
        self.train, self.test = os.path.join(folder, "train"), os.path.join(folder, "test")
        self.left_out = {}  # method -> why
        self.records = []

    def rivals(self, *arguments):
        """What bench/rivals/rivals.cpp prints."""
        command = [os.path.join(self.options.bin, "rivals"), *map(str, arguments)]
        return subprocess.run(command, check=True, stdout=subprocess.PIPE, text=True).stdout

    def command(self, method):
        if method.startswith("llmt"):
            return [os.path.join(self.options.bin, "rivals"), "fit"]
        if method == "M5P":
            classes = os.path.join(self.folder, "java")
            if not os.path.isdir(classes):
                subprocess.run(["javac", "-cp", WEKA, "-d", classes, os.path.join(HERE, "WekaRival.java")], check=True,
                               capture_output=True)
            return ["java", f"-Xmx{self.options.gigabytes}g", "-XX:+UseSerialGC",
                    f"-XX:ActiveProcessorCount={self.options.threads}", "-cp", f"{WEKA}:{classes}", "WekaRival"]
        if method in ("earth", "lmtree"):
            return ["Rscript", "--vanilla", os.path.join(HERE, "r_rival.R")]
        return [PYTHON, os.path.join(HERE, "python_rival.py")]

    def limit(self):
        resource.setrlimit(resource.RLIMIT_CPU, (self.options.seconds, self.options.seconds + 5))
        resource.setrlimit(resource.RLIMIT_DATA, (self.options.gigabytes << 30,) * 2)
        resource.setrlimit(resource.RLIMIT_CORE, (0, 0))

    def run(self, method, columns):
        """One fit: what the runner printed, or None and an entry in left_out."""
        threads = str(self.options.threads)
        names = ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS", "BLIS_NUM_THREADS")
        try:
            done = subprocess.run(self.command(method) + [method, self.train, self.test, str(columns), threads],
                                  env=os.environ | {name: threads for name in names}, preexec_fn=self.limit,
                                  capture_output=True, text=True)
        except (OSError, subprocess.CalledProcessError):
            self.left_out[method] = "not installed"
            return None
        if done.returncode == 0:
            return json.loads(done.stdout.splitlines()[-1])
        if done.returncode == 77:
            self.left_out[method] = "not installed"
        elif done.returncode in (-24, -9, 152, 137):
            self.left_out[method] = f"not finished within {self.options.seconds} CPU s"
        else:
            self.left_out[method] = f"failed: {(done.stderr.strip().splitlines() or [f'exit {done.returncode}'])[-1]}"
        return None

    def run_all(self, data, samples):
        """All methods on each of `samples`, which write the files and return the number of columns. Sample by sample,
        so that the machine's moods hit all methods alike."""
        results = collections.defaultdict(list)
        for sample in samples:
            columns = sample()
            for method in self.options.methods.split(","):
                if method not in self.left_out:
                    print(f"{data}: {method} ...", file=sys.stderr, end="\r")
                    result = self.run(method, columns)
                    print(" " * 60, file=sys.stderr, end="\r")
                    if result:
                        results[method].append(result)
                    self.records.append({"data": data, "method": method} | (result or {"left_out": self.left_out[method]}))
        summary = {method: summarise(runs) for method, runs in results.items()}
        print_table(data, summary, self.left_out)
        return summary


def summarise(runs):
    middle = lambda key: statistics.median(run[key] for run in runs)
    return {key: middle(key) for key in ("fit_wall", "fit_cpu", "predict_cpu", "memory", "leaves")} | {
        "rmse": statistics.mean(run["rmse"] for run in runs), "runs": len(runs)}


def print_table(data, summary, left_out):
    print(f"\n{data}")
    own = summary.get("llmt")
    head = ("fit wall s", "x llmt", "fit CPU s", "x llmt", "CPU s/1e6", "x llmt", "error", "x llmt", "leaves",
            "extra MiB", "runs")
    print(f"{'':14}" + "".join(f"{word:>11}" for word in head))
    for method, row in summary.items():
        line = f"{method:14}"
        for key in ("fit_wall", "fit_cpu", "predict_cpu", "rmse"):
            ratio = f"{row[key] / own[key]:.3g}" if own and own[key] > 0 else "-"
            line += f"{row[key]:11.4g}{ratio:>11}"
        print(line + f"{row['leaves']:11.0f}{row['memory'] / 2**20:11.1f}{row['runs']:11}")
    for method, why in left_out.items():
        packages = f" ({PACKAGES[method]})" if why == "not installed" and PACKAGES[method] else ""
        print(f"{method:14} left out: {why}{packages}")
    sys.stdout.flush()


def synthetic(bench):
    options = bench.options
    for rows in options.rows.split(","):
        rows = int(float(rows))

        def sample(seed):
            bench.rivals("sample", rows, options.inputs, seed, bench.train, bench.test)
            return options.inputs + 1

        bench.run_all(f"synthetic function, {rows} rows x {options.inputs} inputs, {options.threads} thread(s)",
                      [lambda seed=seed: sample(seed) for seed in range(1, options.seeds + 1)])


def sets(bench):
    folder = bench.options.sets
    names = bench.options.names.split(",") if bench.options.names else []
    ratios = collections.defaultdict(list)
    for line in bench.rivals("sets", folder, *names).splitlines():
        name, rows, columns, splits = line.split("\t")

        def sample(split):
            bench.rivals("split", folder, name, split, bench.train, bench.test)
            return int(columns)

        data = f"{name}, {rows} rows x {int(columns) - 1} inputs, {bench.options.threads} thread(s)"
        summary = bench.run_all(data, [lambda split=split: sample(split) for split in range(int(splits))])
        # A method that was too slow gets another chance with the next data set.
        bench.left_out = {method: why for method, why in bench.left_out.items() if why == "not installed"}
        for method, row in summary.items():
            if "llmt" in summary and row["runs"] == summary["llmt"]["runs"]:
                own = summary["llmt"]
                ratios[method].append([row["rmse"] / own["rmse"]] + [
                    max(row[key], 1e-4) / max(own[key], 1e-4) for key in ("fit_cpu", "predict_cpu")])  # as clocks tell
    print("\nGeometric means of the ratios to llmt, over the sets where all splits were done")
    print(f"{'':14}{'error':>11}{'fit CPU s':>11}{'CPU s/1e6':>11}{'sets':>11}")
    for method, values in ratios.items():
        means = [math.exp(statistics.mean(map(math.log, column))) for column in zip(*values)]
        print(f"{method:14}" + "".join(f"{mean:11.3g}" for mean in means) + f"{len(values):11}")


def machine():
    with open("/proc/cpuinfo") as file:
        model = next((line.split(":")[1].strip() for line in file if line.startswith("model name")), "unknown")
    return {"processor": model, "cores": os.cpu_count()}


def main():
    options = arguments()
    if not os.access(os.path.join(options.bin, "rivals"), os.X_OK):
        sys.exit(f"run.py: no program rivals in {options.bin}; build the preset bench, or say where with --bin")
    if unknown := set(options.methods.split(",")) - set(PACKAGES):
        sys.exit(f"run.py: no method {', '.join(sorted(unknown))}; there are {', '.join(PACKAGES)}")
    with tempfile.TemporaryDirectory() as folder:
        bench = Bench(options, folder)
        (sets if options.sets else synthetic)(bench)
    with open(options.json, "w") as file:
        content = {"machine": machine(), "options": vars(options), "runs": bench.records}
        json.dump(content, file, indent=1)


main()
