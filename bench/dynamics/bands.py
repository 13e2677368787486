"""The band of llmt simulate --interval on fresh runs of the random systems of systems.py: which share lies inside."""

import argparse
import json
import statistics
import subprocess
import sys
import tempfile
from pathlib import Path

from systems import System, noisy, write


def shares(run: dict, names: list[str], measured: list[list[float]], rows: int) -> tuple[list[bool], list[bool]]:
    """Whether the measured values lie inside: all simulated ones, and those of the first ten rows of each run."""
    everywhere, early = [], []
    for o, name in enumerate(names):
        low, high = run["low"][name], run["high"][name]
        for row, values in enumerate(measured):
            since = row % rows - run["records"][0]["first"] + 1
            if since < 1:
                continue
            inside = low[row] is not None and low[row] <= values[o] <= high[row]
            everywhere.append(inside)
            if since <= 10:
                early.append(inside)
    return everywhere, early


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--program", required=True)
    parser.add_argument("--seeds", default="0:10", help="FIRST:END")
    parser.add_argument("--interval", type=float, default=0.9)
    parser.add_argument("--runs", type=int, default=10, help="fresh runs of each system, as long as its record")
    parser.add_argument("--lags", default="auto")
    parser.add_argument("--skip", type=int, default=100, help="rows before a fresh run; 0: it begins at rest")
    arguments = parser.parse_args()
    program = str(Path(arguments.program).resolve())
    first, end = map(int, arguments.seeds.split(":"))
    all_inside, all_early = [], []
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        for seed in range(first, end):
            system = System(seed)
            u, clean = system.run(system.rows, seed)
            spread = [statistics.pstdev(row[o] for row in clean) for o in range(len(clean[0]))]
            write(folder / "train.csv", u, noisy(system, clean, spread))
            names = ["y", "q"][: len(spread)]
            fitted = subprocess.run([program, "fit", "train.csv", "-t", ",".join(names), "--lags", arguments.lags, "--json",
                                     "--accept-unstable", "-o", "m.json"], cwd=folder, capture_output=True, text=True)
            if fitted.returncode != 0:
                sys.exit(f"seed {seed}: {fitted.stderr}")
            lines, measured = [",".join(["run", "u", *names])], []
            for run in range(arguments.runs):
                inputs, outputs = system.run(system.rows + arguments.skip, seed + 100_000 * (run + 1))
                inputs, outputs = inputs[arguments.skip :], noisy(system, outputs[arguments.skip :], spread)
                measured += outputs
                lines += [",".join([str(run), *map(repr, [a, *row])]) for a, row in zip(inputs, outputs, strict=True)]
            (folder / "fresh.csv").write_text("\n".join(lines) + "\n")
            done = subprocess.run([program, "simulate", "m.json", "fresh.csv", "--groups", "run", "--interval",
                                   str(arguments.interval), "--json"], cwd=folder, capture_output=True, text=True,
                                  check=True)
            run = json.loads(done.stdout)
            inside, early = shares(run, names, measured, system.rows)
            width = statistics.fmean(
                (high - low) / s
                for name, s in zip(names, spread, strict=True)
                for low, high in zip(run["low"][name], run["high"][name], strict=True) if low is not None)
            all_inside.append(statistics.fmean(inside))
            all_early.append(statistics.fmean(early))
            fit = json.loads(fitted.stdout)
            print(f"{seed:4} {system.kind:11} {100 * all_inside[-1]:6.1f} % inside, {100 * all_early[-1]:6.1f} % of the "
                  f"first 10 rows; mean width {width:6.3f} deviations  {fit['lags']}: {fit['model_kind']}", flush=True)
    print(f"{len(all_inside)} systems: {100 * statistics.fmean(all_inside):.1f} % inside, of single systems "
          f"{100 * min(all_inside):.1f} to {100 * max(all_inside):.1f} %; {100 * statistics.fmean(all_early):.1f} % of the "
          f"first 10 rows of a run")


if __name__ == "__main__":
    main()
