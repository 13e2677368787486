"""Random systems that move: no run is to leave its bounds unnamed, and none is to be worse than a linear model."""

import argparse
import json
import math
import random
import statistics
import subprocess
import sys
import tempfile
from pathlib import Path

KINDS = ("oscillator", "saturated", "play", "tank", "coupled")


class System:
    """A random system of one input and one or two outputs."""

    def __init__(self, seed: int) -> None:
        self.random = random.Random(seed)
        self.kind = KINDS[seed % len(KINDS)]
        draw = self.random.uniform
        radius, angle = draw(0.6, 0.95), draw(0.1, 0.8)
        self.a1, self.a2 = 2 * radius * math.cos(angle), -radius * radius
        self.b = draw(0.2, 1.0)
        self.cubic = draw(0.005, 0.02)
        self.limit = draw(0.3, 0.9)
        self.width = draw(0.1, 0.5)
        self.level, self.outflow = 0.5, draw(0.05, 0.15)
        self.coupling = draw(-0.2, 0.2)
        self.rows = self.random.randint(400, 800)
        self.hold = self.random.randint(2, 8)

    def run(self, rows: int, seed: int) -> tuple[list[float], list[list[float]]]:
        """Inputs and outputs; the input holds random values for some rows each."""
        source = random.Random(1000 * seed + 7)
        u, outputs = [], []
        y1 = y2 = q = played = value = before = 0.0
        level = self.level
        for row in range(rows):
            if row % self.hold == 0:
                value = source.uniform(-1, 1)
            if self.kind == "oscillator":
                y = self.a1 * y1 + self.a2 * y2 + self.b * before - self.cubic * max(-8, min(8, y1)) ** 3
            elif self.kind == "saturated":
                y = self.a1 * y1 + self.a2 * y2 + self.b * max(-self.limit, min(self.limit, before))
            elif self.kind == "play":
                played = max(before - self.width, min(before + self.width, played))
                y = self.a1 * y1 + self.a2 * y2 + self.b * played
            elif self.kind == "tank":
                level = level + 0.1 * (before + 1) * self.b - self.outflow * math.sqrt(max(level, 0.0))
                level = y = min(max(level, 0.0), 2.0)
            else:
                y = 0.9 * y1 + self.coupling * q + 0.1 * self.b * before
                q = 0.8 * q - self.coupling * y1 + 0.1 * math.tanh(2 * before)
            y2, y1 = y1, y
            u.append(value)
            outputs.append([y, q] if self.kind == "coupled" else [y])
            before = value
        return u, outputs


def least_squares(rows: list[list[float]], targets: list[float]) -> list[float]:
    """Coefficients by the normal equations, with a trace of ridge."""
    size = len(rows[0])
    matrix = [[sum(r[i] * r[j] for r in rows) for j in range(size)] for i in range(size)]
    right = [sum(r[i] * t for r, t in zip(rows, targets, strict=True)) for i in range(size)]
    for i in range(size):
        matrix[i][i] += 1e-9 * (matrix[i][i] + 1e-12)
    for i in range(size):
        pivot = max(range(i, size), key=lambda k: abs(matrix[k][i]))
        matrix[i], matrix[pivot] = matrix[pivot], matrix[i]
        right[i], right[pivot] = right[pivot], right[i]
        for k in range(i + 1, size):
            factor = matrix[k][i] / matrix[i][i]
            matrix[k] = [a - factor * b for a, b in zip(matrix[k], matrix[i], strict=True)]
            right[k] -= factor * right[i]
    for i in reversed(range(size)):
        right[i] = (right[i] - sum(matrix[i][k] * right[k] for k in range(i + 1, size))) / matrix[i][i]
    return right


def linear_error(u, noisy, test_u, test_y, lag=2) -> list[float]:
    """Free-run errors of the ARX model of two lags by least squares of the next row."""
    outputs = len(noisy[0])

    def regressors(inputs, past, row):
        return [1.0, *(past[row - k][o] for k in range(1, lag + 1) for o in range(outputs)),
                *(inputs[row - k] for k in range(1, lag + 1))]

    rows = [regressors(u, noisy, row) for row in range(lag, len(u))]
    models = [least_squares(rows, [noisy[row][o] for row in range(lag, len(u))]) for o in range(outputs)]
    run = [list(test_y[row]) for row in range(lag)]
    squares = [0.0] * outputs
    for row in range(lag, len(test_u)):
        x = regressors(test_u, run, row)
        run.append([max(-1e6, min(1e6, sum(a * b for a, b in zip(x, model, strict=True)))) for model in models])
        for o in range(outputs):
            squares[o] += (run[row][o] - test_y[row][o]) ** 2
    return [math.sqrt(s / (len(test_u) - lag)) for s in squares]


def noisy(system: "System", clean: list[list[float]], spread: list[float]) -> list[list[float]]:
    """Measured outputs: two per cent of the deviation is noise."""
    return [[v + 0.02 * s * system.random.gauss(0, 1) for v, s in zip(row, spread, strict=True)] for row in clean]


def write(path: Path, u, outputs) -> None:
    names = ["y", "q"][: len(outputs[0])]
    lines = [",".join(["u", *names])] + [",".join(map(repr, [a, *row])) for a, row in zip(u, outputs, strict=True)]
    path.write_text("\n".join(lines) + "\n")


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--program", required=True)
    parser.add_argument("--seeds", default="0:100", help="FIRST:END")
    parser.add_argument("--lags", default="auto")
    arguments = parser.parse_args()
    program = str(Path(arguments.program).resolve())
    first, end = map(int, arguments.seeds.split(":"))
    ratios, left, unnamed, worse = [], 0, 0, 0
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        for seed in range(first, end):
            system = System(seed)
            u, clean = system.run(system.rows, seed)
            spread = [statistics.pstdev(row[o] for row in clean) for o in range(len(clean[0]))]
            seen = noisy(system, clean, spread)
            test_u, test_y = system.run(10 * system.rows, seed + 100_000)
            write(folder / "train.csv", u, seen)
            write(folder / "test.csv", test_u, test_y)
            targets = "y,q" if system.kind == "coupled" else "y"
            lags = arguments.lags
            fitted = subprocess.run([program, "fit", "train.csv", "-t", targets, "--lags", lags, "--json",
                                     "--accept-unstable", "-o", "m.json"], cwd=folder, capture_output=True, text=True)
            if fitted.returncode != 0:
                sys.exit(f"seed {seed}: {fitted.stderr}")
            fit = json.loads(fitted.stdout)
            done = subprocess.run([program, "simulate", "m.json", "test.csv", "--json"], cwd=folder, capture_output=True,
                                  text=True, check=True)
            run = json.loads(done.stdout)
            runs_away = run["records"][0]["leaves_bounds_at"] is not None
            errors = [value if value is not None else math.inf for value in run["errors"]["rmse"]]
            linear = linear_error(u, seen, test_u, test_y)
            ratio = math.sqrt(sum((e / s) ** 2 for e, s in zip(errors, spread, strict=True))
                              / sum((e / s) ** 2 for e, s in zip(linear, spread, strict=True)))
            left += runs_away
            unnamed += runs_away and fit["stable"]
            worse += ratio > 1.05
            ratios.append(ratio)
            print(f"{seed:4} {system.kind:11} error / linear {ratio:6.3f}  {fit['lags']}: {fit['model_kind']}"
                  f"{' LEFT ITS BOUNDS' if runs_away else ''}", flush=True)
    print(f"{len(ratios)} systems: {left} runs left their bounds, {unnamed} of them unnamed; {worse} worse than linear by "
          f"more than 5 %; median ratio {statistics.median(ratios):.3f}, largest {max(ratios):.3f}")


if __name__ == "__main__":
    main()
